"""How sharp edges are kept."""

import numpy as np
import pytest
from plane_bodies import arrays
from shapes import ball

from parameterize.polyhedra.layout import exact_layout
from parameterize.quality.sharpness import distance_to_edges, sharpness_of
from parameterize.spline.multipatch import MultiPatch
from parameterize.spline.volume import BSplineVolume

CUBE = BSplineVolume.uniform([[[[i, j, k] for k in (0, 1)] for j in (0, 1)] for i in (0, 1)], degree=1)


def test_points_have_their_distance_from_the_nearest_edge():
    points = np.array([[0.3, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.1, 1.2], [1.0, 1.0, 3.0]])
    assert distance_to_edges(points, CUBE) == pytest.approx([0.0, 0.5, np.hypot(0.1, 0.2), 2.0])


def test_exact_blocks_keep_all_edges():
    vertices, faces = arrays("L")
    layout = exact_layout(vertices, faces, 6)
    body = MultiPatch(tuple(block.spline for block in layout.blocks), layout.interfaces)
    found = sharpness_of(body, vertices, faces)
    assert (found.edges, found.corners) == (18, 12) and found.length == pytest.approx(36.0)
    assert found.distance.max < 1e-12 and found.normals.max < 1e-5


def test_a_turned_cube_loses_edges_and_normals():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    faces = np.array(
        [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6]]
        + [[3, 0, 4], [3, 4, 7]]
    )
    angle = np.radians(10.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    found = sharpness_of(CUBE, (vertices - 0.5) @ turn.T + 0.5, faces)
    moved = 2.0 * np.sin(angle / 2.0) * np.sqrt(0.5) / np.sqrt(3.0)
    assert found.distance.max <= moved and found.distance.max > 0.5 * moved
    assert found.normals.mean > 10.0 * 4.0 / 6.0  # of four faces, and at turned edges the nearest face is another one
    assert 70.0 < found.normals.max < 100.0


def test_a_ball_has_no_edges():
    found = sharpness_of(CUBE, *ball(500))
    assert (found.edges, found.corners, found.length, found.distance) == (0, 0, 0.0, None)
