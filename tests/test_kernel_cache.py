"""A read-only installation without a home: runs work, and their kernels are not kept."""

import os
import subprocess
import sys

import pytest

# numba and we make a temporary file to see whether a folder can be written; here the temporary folder alone can.
READ_ONLY = """
import sys, tempfile
make = tempfile.TemporaryFile

def refusing(*given, dir=None, **more):
    if not str(dir).startswith(tempfile.gettempdir()):
        raise OSError(30, "Read-only file system", str(dir))
    return make(*given, dir=dir, **more)

tempfile.TemporaryFile = refusing
from iga_nn.cli.commands import main
code = main(sys.argv[1:])
from parameterize.kernel_cache import FOLDER
import os
print("kernels in", os.environ.get(FOLDER))
sys.exit(code)
"""


def run(tmp_path, *arguments, **environment):
    (scratch := tmp_path / "scratch").mkdir()
    known = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    known |= {"TMPDIR": str(scratch), "HOME": "/proc", "OMP_NUM_THREADS": "1", **environment}
    command = [sys.executable, "-c", READ_ONLY, *arguments]
    done = subprocess.run(command, env=known, cwd=tmp_path, capture_output=True, text=True)
    return done, [path for path in scratch.iterdir() if path.name.startswith("iga-nn")]


@pytest.mark.skipif(os.name != "posix", reason="/proc is no home anywhere else")
def test_a_read_only_installation_keeps_no_kernels_and_works(tmp_path):
    done, left = run(tmp_path, "check", "cube")
    assert done.returncode == 0, done.stderr
    assert "accepted" in done.stdout and "scratch/iga-nn-kernels-" in done.stdout and not left


def test_a_folder_of_the_user_is_left_alone(tmp_path):
    kept = tmp_path / "scratch" / "kept"
    done, _ = run(tmp_path, "--version", NUMBA_CACHE_DIR=str(kept))
    assert done.returncode == 0 and f"kernels in {kept}" in done.stdout and kept.is_dir()
