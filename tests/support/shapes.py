"""Closed surfaces by formula for the tests: evenly spread points and the triangles between them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

CORNERS = np.array([[i, j, k] for i in (0.0, 1.0) for j in (0.0, 1.0) for k in (0.0, 1.0)])
CUBE_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5],
        [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
        [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def ball(count):
    """Unit sphere: points (count, 3) and triangles wound outward."""
    k = np.arange(count)
    z = 1.0 - (2.0 * k + 1.0) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z**2)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def rounded_cube(count, power=8.0):
    """The ball of the `power`-norm around (1/2, 1/2, 1/2), as wide as the unit cube."""
    points, faces = ball(count)
    size = (np.abs(points) ** power).sum(axis=1, keepdims=True) ** (1.0 / power)
    return 0.5 + 0.5 * points / size, faces


def turned(points, angles=(0.05, -0.08, 0.06)):
    """Rotated about (1/2, 1/2, 1/2) by three angles, one an axis."""
    result = points - 0.5
    for axis, angle in enumerate(angles):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        matrix = np.eye(3)
        matrix[a, a] = matrix[b, b] = np.cos(angle)
        matrix[a, b], matrix[b, a] = -np.sin(angle), np.sin(angle)
        result = result @ matrix.T
    return 0.5 + result


def enclosed_volume(points, faces):
    a, b, c = np.moveaxis(points[faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def area(points, faces):
    a, b, c = np.moveaxis(points[faces], 1, 0)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def is_closed(faces):
    """Every edge has two triangles, which run along it in opposite directions."""
    directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    back = {(b, a) for a, b in directed.tolist()}
    return len(back) == len(directed) and back == {(a, b) for a, b in directed.tolist()}
