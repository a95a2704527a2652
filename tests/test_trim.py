"""`make setup` removes from the environment what no run loads."""

import importlib.util
from pathlib import Path

import iga_nn

ROOT = Path(iga_nn.__file__).resolve().parents[1]


def test_what_is_loaded_stays(tmp_path):
    gone = ["torch/test/a.py", "torch/bin/test_api", "torch/include/a.h", "lib64/libembree4.a", "numpy/lib/tests/b.py"]
    kept = ["torch/bin/torch_shm_manager", "torch/testing/a.py", "numpy/testing/tests.py", "other/tests/a.py"]
    for name in (*gone, *kept):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    spec = importlib.util.spec_from_file_location("trim", ROOT / ".ci" / "trim.py")
    trim = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(trim)
    trim.trim(tmp_path)
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()) == sorted(kept)
    trim.trim(tmp_path)  # once more, as make does where pyproject.toml has changed
