"""Normals, areas, quadrics and weights at the triangles and vertices of a mesh."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, IntArray


def doubled_areas(vertices: Array, faces: IntArray) -> Array:
    """Return the normals of the triangles, as long as twice their areas (m, 3)."""
    corners = vertices[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _summed(values: Array, faces: IntArray, count: int) -> Array:
    """Return the sum at each of `count` vertices of the values (m, ...) of the triangles there."""
    sums = np.zeros((count, *values.shape[1:]))
    for k in range(3):
        np.add.at(sums, faces[:, k], values)
    return sums


def vertex_normals(vertices: Array, faces: IntArray) -> Array:
    """Return the unit normals at the vertices (n, 3), from the area-weighted mean over the triangles there."""
    cross = doubled_areas(vertices, faces)
    sums = _summed(cross, faces, len(vertices))
    return sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-300)[:, None]


def vertex_quadrics(vertices: Array, faces: IntArray, tangential: float) -> Array:
    """Return the area-weighted mean of n n^T over the triangles at each vertex, plus `tangential` times I (n, 3, 3)."""
    cross = doubled_areas(vertices, faces)
    area = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(area, 1e-300)[:, None]
    share = area[:, None, None] * normal[:, :, None] * normal[:, None, :]
    sums, total = (_summed(values, faces, len(vertices)) for values in (share, area))
    return sums / np.maximum(total, 1e-300)[:, None, None] + tangential * np.eye(3)


def vertex_weights(vertices: Array, faces: IntArray, own: int) -> Array:
    """Return weights (n,) of the vertices, half by count, as the report counts, and half by area; their sum is 1.

    own: how many vertices count, the first ones; those that a subdivision added do not.
    """
    area = np.linalg.norm(doubled_areas(vertices, faces), axis=1)
    share = np.bincount(faces.ravel(), np.repeat(area / 3.0, 3), minlength=len(vertices))
    counted = np.arange(len(vertices)) < own
    return np.asarray(0.5 * counted / own + 0.5 * share / share.sum())
