"""How far the room of a branch reaches, and where the curve of a flat ring lies in it."""

import numpy as np
import trimesh
from shapes import CORNERS, CUBE_FACES

from parameterize.layouts.rods.centering import centered
from parameterize.layouts.rods.clearance import Clearance
from parameterize.layouts.rods.rods import ring
from parameterize.layouts.skeleton.graph import Branch, Skeleton
from parameterize.surface.solid import Solid

HEIGHT = 3.0  # of a tube between radii 0.8 and 1


def tube():
    mesh = trimesh.creation.annulus(0.8, 1.0, HEIGHT, sections=48)
    return Solid(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def circle(heights, body):
    turns = np.linspace(0.0, 2.0 * np.pi, 61)
    points = np.stack([0.9 * np.cos(turns), 0.9 * np.sin(turns), heights(turns)], axis=1)
    radii = body.depths(points)
    return Skeleton(points[:1], radii[:1], (Branch((0, 0), points, radii),), tube=0.1, cell=0.05)


def test_the_room_of_a_branch_ends_where_another_is_nearer():
    body = Solid(CORNERS, CUBE_FACES)
    lines = [np.linspace([x, 0.5, 0.1], [x, 0.5, 0.9], 50) for x in (0.25, 0.75)]
    nodes = np.concatenate([line[[0, -1]] for line in lines])
    branches = tuple(Branch((2 * k, 2 * k + 1), line, body.depths(line)) for k, line in enumerate(lines))
    room = Clearance(Skeleton(nodes, body.depths(nodes), branches, tube=0.5, cell=0.05), body)
    place = np.array([0.25, 0.5, 0.5])
    left, right = (float(room.rays(place, sign * np.eye(3)[0])) for sign in (-1.0, 1.0))
    assert np.isclose(left, 0.25, rtol=1e-4)
    assert 0.2 < right < 0.5 / 1.75  # the other line is nearer than 0.75 of the way from there on


def test_the_curve_of_a_flat_ring_goes_to_the_middle():
    body = tube()
    (branch,) = centered(circle(lambda turns: 0.6 + 0.3 * np.sin(2.0 * turns), body), body).branches
    assert np.abs(branch.points[:, 2]).max() < 0.05 * HEIGHT
    assert np.array_equal(branch.points[0], branch.points[-1])


def test_blocks_of_a_tube_are_as_wide_as_it_is_long():
    body = tube()
    skeleton = circle(np.zeros_like, body)
    found, _ = ring(skeleton.branches[0].points, skeleton.branches[0].radii, Clearance(skeleton, body))
    assert (np.ptp(found.offsets, axis=(1, 2)).max(axis=1) > 0.4 * HEIGHT).all()
