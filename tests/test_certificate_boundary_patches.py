"""Whether the outer boundary of several patches meets itself, on bodies of which it is known."""

import numpy as np
import pytest
from patches import SYMMETRIES, around_a_line, cells, frame, patch, plate_with_hole, ring, sector, slit, turned
from volumes import bent

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.spline.body import Body
from parameterize.spline.interface import Interface
from parameterize.spline.volume import BSplineVolume

QUARTERS = [(k / 4, (k + 1) / 4) for k in range(4)]


@pytest.mark.parametrize(
    "body",
    [
        Body.from_patches(cells([(0, 0, 0), (1, 0, 0), (0, 1, 0)])),
        frame(),
        plate_with_hole(),
        Body.from_patches([patch(ring(0, 1), (24, 4, 4))]),
        Body.from_patches([patch(ring(0, 1), (4, 4, 4))]),
        Body.from_patches([patch(ring(*part)) for part in QUARTERS]),
        Body.from_patches([patch(ring(0.0, 0.4), 6), patch(ring(0.4, 0.8), 6)]),
        around_a_line(4),
    ],
    ids=["L", "frame", "plate", "ring", "ring of one span", "ring of four", "open ring", "turn around a line"],
)
def test_good_bodies_are_injective(body):
    assert certify(body).verdict == "certified"
    found = check_boundary(body)
    assert found.injective is True and found.overlap is False and found.meeting is None


@pytest.mark.parametrize("symmetry", SYMMETRIES[::5])
def test_the_orientation_of_a_patch_changes_nothing(symmetry):
    pieces = [patch(ring(*part), (6, 4, 5)) for part in QUARTERS]
    pieces[1] = turned(pieces[1], symmetry)
    assert check_boundary(Body.from_patches(pieces)).injective is True


def test_patches_of_other_degrees_and_knots():
    straight = BSplineVolume.from_function(lambda u, v, w: (u, v, w), (3, 5, 6), 2)
    knots = (np.array([0.0, 0.0, 0.3, 1.0, 1.0]), *straight.knots[1:])
    wide = BSplineVolume((1, 2, 2), knots, np.zeros((3, *straight.shape[1:], 3)))
    wide.control_points[:] = straight.control_points[-1] + np.array([0.0, 0.4, 1.0])[:, None, None, None] * [1, 0, 0]
    body = Body.from_patches([straight, wide])
    assert len(body.interfaces) == 1 and check_boundary(body).injective is True


@pytest.mark.parametrize(("turns", "rise", "injective"), [(0.98, 0.0, True), (1.02, 0.0, False), (1.3, 1.2, True)])
def test_patches_that_overlap_away_from_their_interfaces(turns, rise, injective):
    """A bar in three patches, bent onto itself; a spring passes above itself."""
    parts = [
        patch(ring(k * turns / 3, (k + 1) * turns / 3, lift=lambda angle: rise * angle / (2.0 * np.pi)), (8, 4, 4))
        for k in range(3)
    ]
    body = Body.from_patches(parts)
    assert len(body.interfaces) == 2 and certify(body).verdict == "certified"
    found = check_boundary(body)
    assert found.injective is injective
    if not injective:
        assert set(found.meeting.patches) == {0, 2}
        for number, place in zip(found.meeting.patches, found.meeting.parameters, strict=True):
            assert body.patches[number](place)[0] == pytest.approx(found.meeting.point, abs=1e-9)


def test_a_meeting_names_its_patches():
    arm = patch(lambda u, v, w: (3.0 - 4.0 * u, v * 0.5 + 0.2, 0.4 + 0.3 * w))  # back through the first patch
    bars = cells([(0, 0, 0), (1, 0, 0)], 4, 3)
    found = check_boundary(Body.from_patches([*bars, arm]))
    assert found.injective is False and 2 in found.meeting.patches
    first, second = found.meeting.patches
    assert f"parameters p{first} (" in str(found.meeting) and f") and p{second} (" in str(found.meeting)
    assert found.as_dict()["boundary_meeting"]["patches"] == [first, second]
    alone = check_boundary(bent(1.3))
    assert alone.meeting.patches is None and "parameters (" in str(alone.meeting)


@pytest.mark.parametrize("shrink", [0.0, 0.2])
def test_a_ring_that_winds_twice(shrink):
    """det J > 0 everywhere and both traces agree, but the boundary passes through itself."""
    body = Body.from_patches([patch(ring(0, 2, lambda angle: 1.5 + shrink * np.cos(angle / 2.0)), (36, 4, 4))])
    assert len(body.interfaces) == 1 and certify(body).verdict == "certified"
    assert check_boundary(body).injective is False


def test_a_ring_that_lies_twice_in_the_same_place():
    """The second turn is the first one again: nothing crosses, and nothing is claimed."""
    turn = patch(ring(0.0, 1.0), (14, 4, 4))
    points = turn.control_points.copy()
    points[-1] = points[0]
    turn = BSplineVolume(turn.degrees, turn.knots, points)
    glued = Interface((0, "u1"), (1, "u0")), Interface((1, "u1"), (0, "u0"))
    assert certify(Body((turn, turn), glued)).verdict == "certified"
    assert check_boundary(Body((turn, turn), glued), max_depth=3).injective is not True


def test_a_line_with_two_turns_around_it():
    """Eight right angles around the line: det J > 0, the two sides of all interfaces opposite."""
    body = around_a_line(8)
    found = certify(body)
    assert found.verdict == "certified" and found.volume == pytest.approx(8.0)
    assert check_boundary(body).injective is False


@pytest.mark.parametrize("symmetry", SYMMETRIES[::7])
def test_a_patch_folded_back_over_its_neighbour(symmetry):
    back = turned(patch(lambda u, v, w: (1.0 - 0.5 * u, v, w)), symmetry)
    body = Body.from_patches([patch(lambda u, v, w: (u, v, w)), back])
    assert check_boundary(body, max_depth=4).injective is not True


def test_patches_that_touch_along_an_edge_without_an_interface_meet():
    found = check_boundary(Body.from_patches(cells([(0, 0, 0), (1, 1, 0)])))
    assert found.injective is not True
    joined = check_boundary(Body.from_patches(cells([(0, 0, 0), (1, 0, 0), (1, 1, 0)])))
    assert joined.injective is True


@pytest.mark.parametrize("gap", [1e-2, 1e-5, -1e-2])
def test_a_plate_cut_open_beside_its_hole(gap):
    """The last sector ends short of the first one, or past it."""
    sectors = [patch(sector(k, k + 1), 6) for k in range(7)] + [patch(sector(7.0, 8.0 - gap), 6)]
    body = Body.from_patches(sectors)
    assert len(body.interfaces) == 7
    assert check_boundary(body).injective is (gap > 0.0)


@pytest.mark.parametrize(("gap", "bend"), [(0.0, 0.3), (0.1, 1.0), (0.01, 0.3), (-0.01, 0.3)])
def test_a_slit_between_curved_walls(gap, bend):
    """Where the walls join, in two patches, Newton's method finds one point twice: that is no meeting."""
    body = slit(gap, bend)
    assert len(body.interfaces) == (4 if gap == 0.0 else 3)
    assert check_boundary(body).injective is (gap >= 0.0)


@pytest.mark.parametrize(("factor", "offset"), [(1e-120, 0.0), (1e30, 0.0), (1.0, 1e9)])
def test_the_answer_depends_neither_on_units_nor_on_the_place(factor, offset):
    for turns, injective in ((1.0, True), (1.02, False)):
        parts = [patch(ring(k * turns / 4, (k + 1) * turns / 4), (6, 4, 4)) for k in range(4)]
        body = Body.from_patches(parts)
        moved = tuple(part.transformed(factor, np.full(3, offset)) for part in body)
        assert check_boundary(Body(moved, body.interfaces)).injective is injective


def test_a_body_without_a_boundary_is_refused():
    point = BSplineVolume.uniform(np.zeros((2, 2, 2, 3)), degree=1)
    glued = tuple(Interface((0, f"{name}0"), (0, f"{name}1")) for name in "uvw")
    with pytest.raises(ValueError, match="every face is glued"):
        Body((point,), glued)
