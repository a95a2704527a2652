"""Rays from points to a surface."""

import numpy as np
from shapes import CORNERS, CUBE_FACES

from parameterize.blocks.inside import Body


def test_rays_reach_the_surface_through_faces_edges_and_corners():
    body = Body(CORNERS, CUBE_FACES)
    ways = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.8, 0.0], [1.0, 1.0, 1.0], [1.0, -1.0, 0.0]])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    expected = [0.5, 0.5, 0.5 / 0.8, 0.5 * np.sqrt(3.0), 0.5 * np.sqrt(2.0)]
    assert np.allclose(body.rays(np.full(3, 0.5), ways), expected, rtol=1e-4)


def test_rays_that_meet_nothing_are_as_long_as_the_diagonal():
    assert np.isclose(Body(CORNERS, CUBE_FACES).rays(np.array([2.0, 0.5, 0.5]), np.eye(3)[0]), np.sqrt(3.0))


def test_points_inside():
    points = np.array([[[0.5, 0.5, 0.5], [1.1, 0.5, 0.5]]])
    assert Body(CORNERS, CUBE_FACES).contains(points).tolist() == [[True, False]]
