"""Kernels are compiled ahead of the first run."""

import os
import subprocess
import sys

import pytest

from iga_nn.compile_kernels import main

SMALL = ("--control-points", "10", "--steps-factor", "0.1")


@pytest.mark.slow
@pytest.mark.parametrize("body", ["bean", "seashell"])
def test_a_usual_run_compiles_nothing_after_it(body, tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    subprocess.run([sys.executable, "-P", "-m", "iga_nn.compile_kernels"], env=environment, check=True)
    command = [sys.executable, "-P", "-m", "iga_nn", "run", "poisson", body, *SMALL, "--out", str(tmp_path / "out")]
    run = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert run.returncode in (0, 3), run.stderr
    assert "compiling kernels" not in run.stderr


def test_an_unknown_part_is_refused_in_one_line(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["everything"])
    assert ended.value.code == 2 and capsys.readouterr().err.count("\n") == 1
