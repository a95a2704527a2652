"""How sharp edges are kept."""

import numpy as np
import pytest
from plane_bodies import arrays, blocks_of
from shapes import ball

from parameterize.quality.sharpness import distance_to_edges, sharpness_of
from parameterize.spline.volume import BSplineVolume

CUBE = BSplineVolume.uniform([[[[i, j, k] for k in (0, 1)] for j in (0, 1)] for i in (0, 1)], degree=1)


def test_points_have_their_distance_from_the_nearest_edge():
    points = np.array([[0.3, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.1, 1.2], [1.0, 1.0, 3.0]])
    assert distance_to_edges(points, CUBE) == pytest.approx([0.0, 0.5, np.hypot(0.1, 0.2), 2.0])


def test_exact_blocks_keep_all_edges():
    vertices, faces = arrays("L")
    found = sharpness_of(blocks_of(vertices, faces).body, vertices, faces)
    assert (found.edges, found.corners) == (18, 12) and found.length == pytest.approx(36.0)
    assert found.distance.max < 1e-12 and found.normals.max < 1e-5


def box(along):
    """The unit cube with vertices at some x on its four edges along x, each of its ends a fan."""
    row = np.array(along)
    outline = np.concatenate([np.stack([row, 0.0 * row], 1), np.stack([row, 1.0 + 0.0 * row], 1)[::-1]])
    count = len(outline)
    rings = [np.column_stack([outline, np.full(count, z)]) for z in (0.0, 1.0)]
    vertices = np.concatenate([*rings, [[0.5, 0.5, 0.0], [0.5, 0.5, 1.0]]])
    a, b = np.arange(count), np.roll(np.arange(count), -1)
    ends = [np.stack([b, a, np.full(count, 2 * count)], 1), np.stack([a, b, np.full(count, count + 1)], 1)]
    sides = [np.stack([a, b, b + count], 1), np.stack([a, b + count, a + count], 1)]
    return vertices, np.concatenate([ends[0], ends[1] + count, *sides])


def turned(vertices, degrees):
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return (vertices - 0.5) @ turn.T + 0.5


def test_the_mean_is_over_length_however_fine_the_edges_are():
    """Most vertices of the second box lie near one of its ends, where a turned cube's edges are farthest away."""
    plain, crowded = (
        sharpness_of(CUBE, turned(vertices, 10.0), faces)
        for vertices, faces in (box([0.0, 1.0]), box(np.linspace(0.0, 1.0, 400) ** 6))
    )
    assert plain.edges == crowded.edges == 12
    assert crowded.distance.mean == pytest.approx(plain.distance.mean, rel=1e-3)
    assert crowded.distance.max == pytest.approx(plain.distance.max, rel=1e-6)


def test_a_turned_cube_loses_edges_and_normals():
    vertices, faces = box([0.0, 1.0])
    found = sharpness_of(CUBE, turned(vertices, 10.0), faces)
    moved = 2.0 * np.sin(np.radians(5.0)) * np.sqrt(0.5) / np.sqrt(3.0)
    assert found.distance.max <= moved and found.distance.max > 0.5 * moved
    assert found.normals.mean > 10.0 * 4.0 / 6.0  # of four faces, and at turned edges the nearest face is another one
    assert 70.0 < found.normals.max < 100.0


def test_a_ball_has_no_edges():
    found = sharpness_of(CUBE, *ball(500))
    assert (found.edges, found.corners, found.length, found.distance) == (0, 0, 0.0, None)
