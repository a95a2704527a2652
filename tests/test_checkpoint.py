import errno
import resource

import numpy as np
import pytest

from parameterize import checkpoint
from parameterize.checkpoint import CheckpointError, Checkpoints

IDENTITY = {"surface": "abc", "seed": 0, "config": {"steps": [1, 2]}}


def test_what_was_saved_comes_back(tmp_path):
    x = np.random.default_rng(0).normal(size=(4, 3))
    tensors = {
        "a": x,
        "same": x,
        "view": x[:2],
        "turned": x.T,
        "number": np.array([1, 2]),
        "step": np.array(3.0),
    }
    state = {"step": 7, "loss": 0.1 + 0.2, "key": [float("inf"), 1.0], "corners": None}
    Checkpoints(tmp_path, IDENTITY, resume=False).save("training", tensors, state)
    found, back = Checkpoints(tmp_path, IDENTITY, resume=True).load("training")
    assert back == state
    assert found.keys() == tensors.keys()
    assert all(np.array_equal(found[k], v) and found[k].dtype == v.dtype for k, v in tensors.items())


def test_the_latest_replaces_and_leaves_no_other_file(tmp_path):
    checkpoints = Checkpoints(tmp_path / "new" / "folder", IDENTITY, resume=True)
    assert checkpoints.load("training") is None
    for step in range(3):
        checkpoints.save("training", {"x": np.array([step])}, {"step": step})
    assert checkpoints.load("training")[1] == {"step": 2}
    assert [p.name for p in (tmp_path / "new" / "folder").iterdir()] == ["training.safetensors"]


def test_a_full_disk_leaves_the_older_checkpoint_and_no_other_file(tmp_path):
    checkpoints = Checkpoints(tmp_path, IDENTITY, resume=True)
    checkpoints.save("training", {"x": np.zeros(1)}, {"step": 1})
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(OSError, match=r"training\.safetensors") as caught:
            checkpoints.save("training", {"x": np.zeros(10_000)}, {"step": 2})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert caught.value.errno == errno.EFBIG
    assert [p.name for p in tmp_path.iterdir()] == ["training.safetensors"]
    assert checkpoints.load("training")[1] == {"step": 1}


def test_without_a_folder_nothing_is_kept():
    checkpoints = Checkpoints(None, IDENTITY, resume=True)
    checkpoints.save("training", {"x": np.zeros(1)}, {})
    assert checkpoints.load("training") is None


@pytest.mark.parametrize("name", ["surface", "seed", "config"])
def test_another_run_is_refused_and_the_difference_named(tmp_path, name):
    Checkpoints(tmp_path, IDENTITY, resume=False).save("training", {"x": np.zeros(1)}, {})
    other = Checkpoints(tmp_path, IDENTITY | {name: "other"}, resume=True)
    with pytest.raises(CheckpointError, match=rf"\(different: {name}\)"):
        other.load("training")


def test_of_many_settings_those_that_differ_are_named(tmp_path):
    Checkpoints(tmp_path, IDENTITY, resume=False).save("training", {"x": np.zeros(1)}, {})
    other = Checkpoints(tmp_path, IDENTITY | {"seed": 1, "config": {"steps": [1, 3], "rounds": 2}}, resume=True)
    with pytest.raises(CheckpointError, match=r"another run \(different: config\.rounds, config\.steps, seed\)"):
        other.load("training")


def test_another_version_is_refused_by_name(tmp_path, monkeypatch):
    checkpoints = Checkpoints(tmp_path, IDENTITY, resume=True)
    monkeypatch.setattr(checkpoint, "FORMAT", 99)
    checkpoints.save("training", {"x": np.zeros(1)}, {})
    monkeypatch.undo()
    with pytest.raises(CheckpointError, match=r"another version of iga-nn \(format 99, this one reads \d+\)"):
        checkpoints.load("training")


def test_any_damaged_byte_is_refused(tmp_path):
    checkpoints = Checkpoints(tmp_path, IDENTITY, resume=True)
    checkpoints.save("training", {"x": np.arange(3.0), "y": np.ones(2)}, {"step": 1})
    path = tmp_path / "training.safetensors"
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(CheckpointError, match=r"training\.safetensors: "):
            checkpoints.load("training")


def test_a_broken_file_is_refused(tmp_path):
    checkpoints = Checkpoints(tmp_path, IDENTITY, resume=True)
    checkpoints.save("training", {"x": np.zeros(100)}, {})
    path = tmp_path / "training.safetensors"
    whole = path.read_bytes()
    for content in (b"", b"nonsense", whole[: len(whole) // 2]):
        path.write_bytes(content)
        with pytest.raises(CheckpointError, match="not a readable checkpoint"):
            checkpoints.load("training")


def test_every_start_has_checkpoints_of_its_own(tmp_path):
    first = Checkpoints(tmp_path, IDENTITY, resume=True)
    second = first.of_part(1)
    first.save("spline", {"x": np.zeros(1)}, {"number": 1})
    assert second.load("spline") is None
    second.save("spline", {"x": np.ones(1)}, {"number": 2})
    assert [c.load("spline")[1]["number"] for c in (first, second)] == [1, 2]


def test_a_fresh_run_removes_its_old_checkpoints_and_nothing_else(tmp_path):
    for part in ("1", "coarse"):
        Checkpoints(tmp_path, IDENTITY, resume=False).of_part(part).save("spline", {"x": np.zeros(1)}, {})
    (tmp_path / "weights.safetensors").write_bytes(b"somebody's")
    Checkpoints(tmp_path, IDENTITY, resume=False)
    assert [p.name for p in tmp_path.iterdir()] == ["weights.safetensors"]
    assert Checkpoints(tmp_path, IDENTITY, resume=True).load("spline") is None


def test_a_stage_with_other_options_starts_anew(tmp_path):
    one, two = (Checkpoints(tmp_path, {"seed": 1}, resume=True).with_options({"load": k}) for k in (1, 2))
    one.save("steps", {"u": np.ones(2)}, {"step": 3})
    assert one.load("steps")[1] == {"step": 3} and two.load("steps") is None
    two.check()  # it is of this run
