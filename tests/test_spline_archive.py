"""volume.npz of several patches; of one patch it is what it was."""

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of
from glued import demand_same

import iga_nn
from parameterize.files import array_names, load_arrays, save_arrays
from parameterize.spline import archive
from parameterize.spline.body import Body
from solve import benchmark_volume
from solve.field import BodyField, SplineField

TURNS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 1, 0), (False, True, False))]
PLACES = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]


def names(body):
    parts = ("degrees", "knots_u", "knots_v", "knots_w", "control_points")
    return ("interfaces", *(f"p{number}_{part}" for number in range(len(body)) for part in parts))


@pytest.mark.parametrize("body", [row_of(PLACES, TURNS), ring(1), ring(3), exact_ring()])
def test_a_body_is_read_again_bit_by_bit(body, tmp_path):
    body.save(tmp_path / "body.npz")
    again = iga_nn.load_volume(tmp_path / "body.npz")
    assert again.interfaces == body.interfaces
    demand_same(again, body)


def test_one_patch_is_written_as_a_volume(tmp_path):
    volume = benchmark_volume(2)
    volume.save(tmp_path / "volume.npz")
    Body((volume,)).save(tmp_path / "body.npz")
    assert (tmp_path / "body.npz").read_bytes() == (tmp_path / "volume.npz").read_bytes()
    assert isinstance(iga_nn.load_volume(tmp_path / "body.npz"), iga_nn.BSplineVolume)
    assert len(Body.load(tmp_path / "volume.npz")) == 1


@pytest.fixture
def in_groups(monkeypatch):
    """Patches are written in groups although they are few."""
    monkeypatch.setattr(archive, "MOST_APART", 1)


@pytest.mark.parametrize("body", [row_of(PLACES, TURNS), ring(3), exact_ring(), row_of(PLACES, TURNS[:1] * 3)])
def test_many_patches_are_written_in_groups_and_read_again(body, in_groups, tmp_path):
    body.save(tmp_path / "body.npz")
    again = iga_nn.load_volume(tmp_path / "body.npz")
    assert again.interfaces == body.interfaces
    demand_same(again, body)
    assert len(array_names(tmp_path / "body.npz")) == 1 + (6 + (body.patches[0].weights is not None)) * len(body.groups)


def test_a_field_on_many_patches_is_written_in_groups(in_groups, tmp_path):
    body = row_of(PLACES, TURNS)
    field = BodyField(tuple(SplineField(one.degrees, one.knots, one.control_points) for one in body))
    field.save(tmp_path / "solution.npz")
    again = BodyField.load(tmp_path / "solution.npz")
    for one, other in zip(again.patches, field.patches, strict=True):
        assert one.degrees == other.degrees and np.array_equal(one.coefficients, other.coefficients)


@pytest.mark.parametrize(
    "change", [lambda row: row[1:], lambda row: 0 * row, lambda row: row + 1, lambda row: 1.0 * row]
)
def test_damaged_groups_are_refused(change, in_groups, tmp_path):
    row_of(PLACES, TURNS[:1] * 3).save(tmp_path / "body.npz")
    held = load_arrays(tmp_path / "body.npz", tuple(array_names(tmp_path / "body.npz")))
    save_arrays(tmp_path / "bad.npz", **held | {"g0_patches": change(held["g0_patches"])})
    with pytest.raises(iga_nn.InputError, match=r"bad\.npz: each patch must be in one group"):
        iga_nn.load_volume(tmp_path / "bad.npz")


def test_groups_with_more_control_points_than_patches_are_refused(in_groups, tmp_path):
    exact_ring().save(tmp_path / "body.npz")
    held = load_arrays(tmp_path / "body.npz", tuple(array_names(tmp_path / "body.npz")))
    twice = np.concatenate([held["g0_control_points"]] * 2)
    save_arrays(tmp_path / "bad.npz", **held | {"g0_control_points": twice})
    with pytest.raises(iga_nn.InputError, match=r"bad\.npz: each patch must be in one group"):
        iga_nn.load_volume(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("interfaces", lambda rows: rows[:, :6], "interfaces must have 7 whole numbers a row"),
        ("interfaces", lambda rows: 1.0 * rows, "interfaces must have 7 whole numbers a row"),
        ("interfaces", lambda rows: rows + [0, 6, 0, 0, 0, 0, 0], "faces are 0 to 5"),
        ("interfaces", lambda rows: rows - [9, 0, 0, 0, 0, 0, 0], "there are 3 patches, from 0 on"),
        ("interfaces", lambda rows: np.concatenate([rows, rows]), "is glued twice"),
        ("p1_control_points", lambda points: points + 1e-9, "the control points or weights of the two faces differ"),
        ("p1_control_points", lambda points: points * np.nan, "patch 1: control_points must be finite"),
        ("p2_knots_u", lambda row: row[1:], "patch 2: "),
        ("p0_degrees", lambda degrees: degrees + 1, "patch 0: "),
    ],
)
def test_damaged_arrays_are_refused(name, change, says, tmp_path):
    body = row_of(PLACES, TURNS)
    body.save(tmp_path / "body.npz")
    held = load_arrays(tmp_path / "body.npz", names(body))
    save_arrays(tmp_path / "bad.npz", **held | {name: change(held[name])})
    with pytest.raises(iga_nn.InputError, match=r"bad\.npz: .*" + says):
        iga_nn.load_volume(tmp_path / "bad.npz")


def test_a_missing_array_is_named(tmp_path):
    body = row_of(PLACES, TURNS)
    body.save(tmp_path / "body.npz")
    held = load_arrays(tmp_path / "body.npz", names(body))
    del held["p1_knots_v"]
    save_arrays(tmp_path / "bad.npz", **held)
    with pytest.raises(iga_nn.InputError, match=r"bad\.npz: has no array named p1_knots_v"):
        iga_nn.load_volume(tmp_path / "bad.npz")
