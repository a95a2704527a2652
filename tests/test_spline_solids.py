"""The solids of a body's patches: names and numbers, in files, on finer knots and in checkpoints."""

import numpy as np
import pytest
from cube_grids import box

import iga_nn
from iga_nn import Body
from parameterize.checkpoint import Checkpoints
from parameterize.files import load_arrays, save_arrays
from parameterize.spline import archive
from parameterize.spline.solids import PatchSolids
from parameterize.spline.spline_map import ControlNets, SplineMap
from parameterize.ways.laid import kept_blocks

ROW = [box((x, 0, 0)) for x in range(3)]


def test_solids_are_given_by_name_or_by_number():
    named = Body.from_patches(ROW, solids=["steel", "pad", "steel"]).solids
    assert named.labels == ("steel", "pad") and named.of_patches == ["steel", "pad", "steel"]
    assert named.has("steel").tolist() == [True, False, True]
    numbered = Body.from_patches(ROW, solids=[0, 2, 2]).solids
    assert numbered.labels == ("solid1", "solid2", "solid3")
    partly = PatchSolids(np.array([0, 1, 1]), ("", "pad"))
    assert Body.from_patches(ROW, solids=partly).solids.labels == ("solid1", "pad")


def test_a_body_without_solids_is_one_solid():
    solids = Body.from_patches(ROW).solids
    assert solids.is_plain and solids.numbers.tolist() == [0, 0, 0] and solids.labels == ("solid1",)


@pytest.mark.parametrize(
    ("solids", "says"),
    [
        ([0, 1], "solids are given of 2 patches: the body has 3"),
        ([0, -1, 0], "whole numbers from 0 on"),
        ([0.0, 1.0, 2.0], "whole numbers from 0 on"),
        (np.zeros((3, 1), dtype=int), "whole numbers from 0 on"),
    ],
)
def test_other_solids_are_refused(solids, says):
    with pytest.raises(ValueError, match=says):
        Body.from_patches(ROW, solids=solids)
    with pytest.raises(ValueError, match="there is a solid 2, but the solids have 1 names"):
        PatchSolids(np.array([0, 2]), ("steel",))
    with pytest.raises(ValueError, match="there is no solid 'wood': the body has steel, pad"):
        Body.from_patches(ROW, solids=["steel", "pad", "pad"]).solids.has("wood")


@pytest.mark.parametrize("most", [1, 1000])
def test_solids_are_in_the_file(most, monkeypatch, tmp_path):
    monkeypatch.setattr(archive, "MOST_APART", most)
    body = Body.from_patches(ROW, solids=["steel", "a pad, of rubber", "steel"])
    body.save(tmp_path / "body.npz")
    again = iga_nn.load_volume(tmp_path / "body.npz").solids
    assert again.names == body.solids.names and np.array_equal(again.numbers, body.solids.numbers)
    Body.from_patches(ROW).save(tmp_path / "plain.npz")
    assert not {"solids", "solid_names"} & set(archive.array_names(tmp_path / "plain.npz"))
    assert iga_nn.load_volume(tmp_path / "plain.npz").solids.is_plain


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"solids": np.array([0.0, 1.0, 0.0])}, "whole numbers from 0 on"),
        ({"solids": np.array([0, 1])}, "solids are given of 2 patches: the body has 3"),
        ({"solid_names": np.array("steel")}, "there is a solid 1, but the solids have 1 names"),
    ],
)
def test_damaged_solids_are_refused(change, says, tmp_path):
    Body.from_patches(ROW, solids=["steel", "pad", "steel"]).save(tmp_path / "body.npz")
    held = load_arrays(tmp_path / "body.npz", tuple(archive.array_names(tmp_path / "body.npz")))
    save_arrays(tmp_path / "bad.npz", **held | change)
    with pytest.raises(iga_nn.InputError, match=r"bad\.npz: .*" + says):
        iga_nn.load_volume(tmp_path / "bad.npz")


def test_solids_are_kept_on_finer_knots_and_in_checkpoints(tmp_path):
    body = Body.from_patches(ROW, solids=["steel", "pad", "steel"])
    degree, knots = body.patches[0].degrees[0], tuple(patch.knots for patch in body)
    nets = ControlNets(degree, knots, body.interfaces, body.solids)
    blocks = SplineMap(nets, nets.joined([np.moveaxis(patch.control_points, -1, 0) for patch in body]))
    finer = blocks.on_knots(tuple(tuple(np.sort(np.append(row, 0.5)) for row in own) for own in knots)).body
    kept_blocks(Checkpoints(tmp_path, {}, resume=False), lambda: blocks)
    resumed = kept_blocks(Checkpoints(tmp_path, {}, resume=True), lambda: pytest.fail("they are kept")).body
    for other in (finer, resumed):
        assert other.solids.of_patches == ["steel", "pad", "steel"]
