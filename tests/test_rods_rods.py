"""Sections across a branch."""

import numpy as np
import pytest
from thick_graphs import curve, loop, thick

from parameterize.layouts.rods.clearance import Clearance
from parameterize.layouts.rods.frames import angle_about
from parameterize.layouts.rods.rods import PARTS, quarter_turns, ring, rod
from parameterize.surface.solid import Solid

X, Y, Z = np.eye(3)
SQUARE = 0.1 * np.array([[-X - Y, -X + Y], [X - Y, X + Y]])  # corners [u][v], right-handed with Z


def turned(corners, angle):
    c, s = np.cos(angle), np.sin(angle)
    return corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def straight():
    skeleton, vertices, faces = thick([-Z, Z], [(0, 1, curve(-Z, Z))])
    return skeleton.branches[0], Clearance(skeleton, Solid(vertices, faces))


def test_the_turn_between_two_faces_is_the_least_and_spread_out(straight):
    branch, room = straight
    first, last = SQUARE - 0.8 * Z, turned(SQUARE, np.radians(130.0)) + 0.8 * Z
    last = np.rot90(last, quarter_turns(first, last, branch.points))
    found = rod(branch.points, branch.radii, (0.2, 1.8), first, last, room)
    sections = found.sections(np.ones(len(found.centers)))
    assert np.allclose(sections[0], first) and np.allclose(sections[-1], last)
    sides = (sections[:, 1] - sections[:, 0]).mean(axis=1)
    turns = np.degrees([angle_about(Z, X, side) for side in sides])
    assert np.isclose(turns[-1], 40.0) and np.allclose(turns[3:-3], np.linspace(0.0, 40.0, len(turns))[3:-3], atol=1.0)


def test_two_faces_near_each_other_are_joined_by_one_straight_piece(straight):
    branch, room = straight
    found = rod(branch.points, branch.radii, (0.9, 1.1), SQUARE - 0.1 * Z, SQUARE + 0.1 * Z, room)
    assert np.allclose(found.sections(np.ones(2)), [SQUARE - 0.1 * Z, SQUARE + 0.1 * Z])


def test_sections_of_a_flat_body_are_flat():
    skeleton, vertices, faces = thick([-Z, Z], [(0, 1, curve(-Z, Z))])
    wide = Clearance(skeleton, Solid(vertices * [1.8, 1.0, 1.0], faces))
    branch = skeleton.branches[0]
    found = rod(branch.points, branch.radii, (0.2, 1.8), None, None, wide)
    width, height = (
        np.linalg.norm(found.offsets[:, 1, 1] - x, axis=-1) for x in (found.offsets[:, 0, 1], found.offsets[:, 1, 0])
    )
    assert np.allclose(width / height, 1.8, atol=0.1)


def test_a_ring_closes_after_quarter_turns():
    points = loop(0 * X, X, Y, 0.8) + 0.3 * np.sin(3 * np.linspace(0.0, 2 * np.pi, 61))[:, None] * Z
    skeleton, vertices, faces = thick([points[0]], [(0, 0, points)])
    found, quarters = ring(points, skeleton.branches[0].radii, Clearance(skeleton, Solid(vertices, faces)))
    sections = found.sections(np.ones(len(found.centers)))
    assert np.array_equal(sections[-1], np.rot90(sections[0], quarters)) and (len(sections) - 1) % PARTS == 0
    sides = np.linalg.norm(np.diff(sections, axis=0), axis=-1)
    assert sides.max() < 1.7 * sides.mean()  # no corner has a long way: the turn is spread out
