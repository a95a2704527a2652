"""`make setup` removes from the environment what no run loads."""

import ctypes
import importlib.util
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import iga_nn

ROOT = Path(iga_nn.__file__).resolve().parents[1]
SPEC = importlib.util.spec_from_file_location("trim", ROOT / ".ci" / "trim.py")
trim = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(trim)
LIBRARY = Path(np._core._multiarray_umath.__file__)
linux_only = pytest.mark.skipif(sys.platform != "linux", reason="libraries of Linux are stripped alone")


def test_what_is_loaded_stays(tmp_path):
    gone = ["torch/test/a.py", "torch/bin/test_api", "torch/include/a.h", "lib64/libembree4.a", "numpy/lib/tests/b.py"]
    gone += ["skimage/data/coins.png", "scipy/a.pxd", "vtkmodules/a.pyi"]
    kept = ["torch/bin/torch_shm_manager", "torch/testing/a.py", "numpy/testing/tests.py", "other/tests/a.py"]
    kept += ["skimage/data/__init__.py", "numpy/a.pyi"]
    for name in (*gone, *kept):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    trim.trim(tmp_path)
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()) == sorted(kept)
    trim.trim(tmp_path)  # once more, as make does where pyproject.toml has changed


@linux_only
@pytest.mark.skipif(shutil.which("strip") is None, reason="this system has no strip")
def test_a_stripped_library_still_loads(tmp_path):
    copy = Path(shutil.copy(LIBRARY, tmp_path / "copy.so"))
    trim.strip(copy)
    ctypes.PyDLL(str(copy))
    assert list(tmp_path.iterdir()) == [copy]
    assert copy.stat().st_size <= LIBRARY.stat().st_size


@linux_only
def test_a_library_that_strip_would_spoil_is_kept(tmp_path, monkeypatch):
    assert trim.is_loadable(LIBRARY)
    content = bytearray(LIBRARY.read_bytes())
    place, size = int.from_bytes(content[32:40], "little"), int.from_bytes(content[54:56], "little")
    first = next(at for at in range(place, len(content), size) if content[at] == 1)  # a segment that is loaded
    content[first + 8] ^= 1  # its offset in the file
    spoiled = tmp_path / "spoiled.so"
    spoiled.write_bytes(content)
    assert not trim.is_loadable(spoiled)
    with pytest.raises(OSError, match="not page-aligned"):
        ctypes.PyDLL(str(spoiled))
    (tmp_path / "text.so").write_text("no library")
    assert not trim.is_loadable(tmp_path / "text.so")
    good = Path(shutil.copy(LIBRARY, tmp_path / "good.so"))

    def spoil(arguments, **_):
        Path(arguments[3]).write_bytes(content)
        return trim.subprocess.CompletedProcess(arguments, 0)

    monkeypatch.setattr(trim.subprocess, "run", spoil)
    trim.strip(good)
    assert good.read_bytes() == LIBRARY.read_bytes()
