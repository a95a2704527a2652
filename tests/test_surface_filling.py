from __future__ import annotations

import numpy as np
import pytest
from mesh_files import ball

from parameterize.surface.filling import fill
from parameterize.surface.geometry import edge_table, normals_and_areas
from parameterize.surface.holes import boundary_loops


def filled(vertices, faces):
    """The closed mesh after the filling of its only hole, and the number of new triangles."""
    (loop,) = boundary_loops(vertices, faces)
    added, patch = fill(vertices, faces, loop)
    return np.concatenate([vertices, added]), np.concatenate([faces, patch]), len(patch)


def window(subdivisions, width=0.6):
    vertices, faces = ball(subdivisions=subdivisions)
    middle = vertices[faces].mean(axis=1)
    return vertices, faces[np.linalg.norm(middle - [1.0, 0.0, 0.0], axis=1) > width]


@pytest.mark.parametrize("subdivisions", [2, 3, 4])
def test_a_hole_in_a_ball_is_closed_near_the_ball(subdivisions):
    vertices, faces = window(subdivisions)
    points, closed, _ = filled(vertices, faces)
    assert np.all(edge_table(closed)[1] == 2)
    deep = 0.6**2 / 2.0  # depth of a plane lid below the ball
    assert abs(np.linalg.norm(points[len(vertices) :], axis=1) - 1.0).max() < 0.12 * deep


def test_the_triangles_are_as_large_as_those_around():
    vertices, faces = window(4)
    points, closed, count = filled(vertices, faces)
    _, areas = normals_and_areas(points, closed)
    mean = areas[:-count].mean()
    assert 0.5 * mean < areas[-count:].mean() < 2.0 * mean and areas[-count:].max() < 5.0 * mean


def disc(n):
    """A square plate of n x n x n cells without its top, whose loop is plane, its walls across."""
    line = np.linspace(0.0, 1.0, n + 1)
    grid = np.array([[i, j] for i in range(n) for j in range(n)])
    floor = np.array([[x, y, 0.0] for x in line for y in line])
    number = grid[:, 0] * (n + 1) + grid[:, 1]
    quads = np.stack([number, number + 1, number + n + 2, number + n + 1], axis=1)
    return floor, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def test_a_plane_loop_gets_a_plane_patch():
    vertices, faces = disc(6)
    points, closed, count = filled(vertices, faces)
    assert np.all(points[:, 2] == 0.0)
    assert normals_and_areas(points, closed[-count:])[1].sum() == pytest.approx(1.0, rel=1e-12)


def test_no_edge_of_the_mesh_is_used_twice():
    """The loop 0-1-2-3 of a folded strip: the mesh has both its diagonals, of which the patch may use none."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0.0], [0.5, 0.5, -1.0], [0.5, 0.5, -2.0]], float)
    faces = np.array([[0, 1, 4], [1, 2, 5], [2, 3, 4], [3, 0, 5], [0, 2, 4], [2, 0, 5], [1, 3, 4], [3, 1, 5]])
    loop = np.array([0, 1, 2, 3])
    added, patch = fill(points, faces, loop)
    assert len(added) >= 1
    used = {tuple(edge) for edge in np.sort(patch[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).tolist()}
    assert not used & {(0, 2), (1, 3)}
