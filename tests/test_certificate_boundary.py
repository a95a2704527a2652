"""Whether a boundary meets itself, on maps of which it is known."""

import json

import numpy as np
import pytest
from volumes import bent, mapped

from parameterize.certificate.boundary import check_boundary, overlapping_boxes
from parameterize.certificate.certify import certify
from parameterize.spline.bspline import greville, interpolate_grid, open_uniform_knots
from parameterize.spline.volume import BSplineVolume


@pytest.mark.parametrize("degrees", [(1, 1, 1), (2, 2, 2), (3, 3, 3), (1, 2, 3), (3, 1, 2)])
@pytest.mark.parametrize("spans", [1, 2, 3])
def test_a_sheared_cube_is_injective(degrees, spans):
    shape = tuple(p + spans for p in degrees)
    volume = mapped(lambda u, v, w: (u + 0.5 * v, 2.0 * v, 0.3 * w - 0.4 * u), shape, degrees)
    assert check_boundary(volume).injective is True


def test_unequal_knots():
    knots = np.array([0, 0, 0, 0, 0.01, 0.02, 0.7, 0.7, 1, 1, 1, 1])
    rows = greville(knots, 3)
    points = np.stack(np.meshgrid(rows, rows, rows, indexing="ij"), axis=-1)
    points += 0.002 * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
    assert check_boundary(BSplineVolume((3, 3, 3), (knots,) * 3, points)).injective is True


@pytest.mark.parametrize(
    ("turns", "rise", "injective"),
    [(0.9, 0.0, True), (0.98, 0.0, True), (1.02, 0.0, False), (1.3, 0.0, False), (1.3, 0.4, False), (1.5, 1.8, True)],
)
def test_a_bar_bent_onto_itself_is_caught_although_nowhere_folded(turns, rise, injective):
    volume = bent(turns, rise)
    assert certify(volume).verdict == "certified"  # det J > 0: locally nothing is wrong
    found = check_boundary(volume)
    assert found.injective is injective
    assert (found.meeting is None) == injective
    if found.meeting is not None:
        first, second = np.array(found.meeting.parameters)
        assert np.abs(first - second).max() > 0.5  # far apart along the bar
        for parameter in (first, second):
            assert np.abs(parameter - 0.5).max() == 0.5  # on the boundary of the cube
            assert volume(parameter)[0] == pytest.approx(found.meeting.point, abs=1e-9)


def test_ends_that_just_meet_are_never_called_injective():
    closed = bent(1.0)
    points = closed.control_points.copy()
    points[-1] = points[0]
    found = check_boundary(BSplineVolume(closed.degrees, closed.knots, points), max_depth=4)
    assert found.injective is not True


@pytest.mark.parametrize("gap", [0.3, 1e-2, 1e-3, -1e-3, -1e-2])
def test_the_gap_between_the_turns_of_a_spring(gap):
    """One turn lies rise / turns above the one before, and the bar is 0.6 high."""
    turns = 1.3
    assert check_boundary(bent(turns, turns * (0.6 + gap))).injective is (gap > 0.0)


@pytest.mark.parametrize("gap", [1e-4, 1e-7, 1e-11])
def test_curved_sheets_that_nearly_touch_in_one_point(gap):
    """The proof needs patches so small that they are flat beside the gap: their number does not grow on the way."""
    knots = (open_uniform_knots(4, 3),) * 3
    u, v, w = np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij")
    between = gap + 0.05 * ((u - 0.4) ** 2 + (v - 0.4) ** 2)
    values = np.stack([u, v, (u - 0.4) ** 2 + w * between], axis=-1)
    volume = BSplineVolume((3, 3, 3), knots, interpolate_grid(knots, 3, values))
    assert check_boundary(volume).injective is True


@pytest.mark.parametrize("sharpness", [1e-1, 1e-2, 1e-4])
def test_knife_edges(sharpness):
    """Two faces that enclose a tiny angle, of unequal speed, sheared and curved along their edge."""

    def place(u, v, w):
        return u + 0.5 * w + 0.2 * v**2, v + 0.3 * u - 0.2 * w, sharpness * (w - u) + 0.1 * v**2

    assert check_boundary(mapped(place)).injective is True


@pytest.mark.parametrize("factor", [1e-300, 1e-120, 1e-6, 1e30, 1e99])
def test_the_answer_does_not_depend_on_units(factor):
    for turns, injective in ((0.98, True), (1.02, False)):
        assert check_boundary(bent(turns).transformed(factor, np.zeros(3))).injective is injective


@pytest.mark.parametrize("offset", [1e6, 1e9, 1e11])
def test_far_from_the_origin_the_coordinates_are_taken_as_they_are(offset):
    """Rounding to what is left of their digits moves the control points; the proofs are of those moved points."""
    assert check_boundary(bent(0.98).transformed(1.0, np.full(3, offset))).injective is True
    far = bent(1.02).transformed(1.0, np.full(3, offset))
    found = check_boundary(far)
    assert found.injective is False
    first, second = np.array(found.meeting.parameters)
    assert np.abs(first - second).max() > 0.5
    assert np.abs(far(first) - far(second)).max() <= 4.0 * np.spacing(offset)


def test_where_hardly_a_digit_is_left_nothing_is_claimed():
    assert check_boundary(bent(1.02).transformed(1.0, np.full(3, 1e14)), max_depth=3).injective is not True


def disturbed(rng):
    """A turned cube with random control points, one corner of it flattened or not."""
    degree = int(rng.integers(1, 4))
    knots = open_uniform_knots(int(rng.integers(max(3, degree + 1), 6)), degree)
    rows = greville(knots, degree)
    points = np.stack(np.meshgrid(rows, rows, rows, indexing="ij"), axis=-1)
    points += 10.0 ** rng.uniform(-2.0, -0.5) * np.diff(rows).min() * rng.normal(size=points.shape)
    if rng.random() < 0.5:
        points[..., 2] -= 0.9 * points[..., 0] * points[..., 2]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return BSplineVolume.uniform(points @ (np.linalg.det(turn) * turn).T, degree)


def test_far_from_the_origin_neighbours_beside_an_edge_are_no_meeting():
    """Two points beside an edge of the cube differ by less than the last digit of such coordinates."""
    rng = np.random.default_rng(0)
    answers = []
    while len(answers) < 24:
        volume = disturbed(rng)
        if certify(volume, max_depth=3).verdict == "certified" and check_boundary(volume).injective is True:
            direction = rng.normal(size=3)
            for offset in (1e6, 1e9, 1e11):
                answers.append(check_boundary(volume.transformed(1.0, offset * direction)).injective)
    assert answers.count(True) == len(answers)


def test_collapsed_faces_are_undecided():
    points = bent(0.5).control_points.copy()
    points[:, :, 0] = points[:, :, :1].mean(axis=1)  # the face w = 0 shrunk to a line
    assert check_boundary(BSplineVolume.uniform(points), max_depth=3).injective is not True
    assert check_boundary(BSplineVolume.uniform(0.0 * points), max_depth=2).injective is None


def test_bad_depth():
    with pytest.raises(ValueError, match="max_depth"):
        check_boundary(bent(0.5), max_depth=-1)


@pytest.mark.parametrize("size", [0.01, 0.2, 2.0])
def test_overlapping_boxes_are_those_of_the_plain_comparison(size):
    rng = np.random.default_rng(1)
    low = rng.uniform(size=(200, 3)) * [1.0, 5.0, 0.2]
    high = low + size * rng.uniform(size=(200, 3)) ** 2
    apart = np.any((low[:, None] > high) | (low > high[:, None]), axis=2)
    expected = {(i, j) for i, j in np.argwhere(~apart).tolist() if i < j}
    found = [tuple(sorted(pair)) for pair in overlapping_boxes(low, high).tolist()]
    assert len(found) == len(expected) and set(found) == expected
    assert overlapping_boxes(low[:0], high[:0]).shape == (0, 2)


def test_the_report_names_the_place_in_plain_types():
    found = check_boundary(bent(1.3)).as_dict()
    assert found["boundary_injective"] is False
    assert json.loads(json.dumps(found)) == found
    assert len(found["boundary_meeting"]["parameters"]) == 2 and len(found["boundary_meeting"]["point"]) == 3
    assert check_boundary(bent(0.5)).as_dict() == {"boundary_injective": True, "boundary_meeting": None}


def test_check_refuses_to_call_an_overlapping_volume_good(tmp_path, capsys):
    from iga_nn.cli import NOT_CERTIFIED
    from iga_nn.cli.commands import main

    bent(1.3).save(tmp_path / "ring.npz")
    assert main(["check", str(tmp_path / "ring.npz")]) == NOT_CERTIFIED
    said = capsys.readouterr().out
    assert "certified" in said and "boundary_meeting: parameters" in said
