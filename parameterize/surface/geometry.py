"""What a triangle mesh says at its triangles and vertices: normals, areas, quadrics, weights."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, IntArray


def doubled_areas(vertices: Array, faces: IntArray) -> Array:
    """Normals of the triangles, as long as twice their areas (m, 3)."""
    corners = vertices[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def vertex_normals(vertices: Array, faces: IntArray) -> Array:
    """Area-weighted mean of the normals of the triangles at each vertex, of length 1 (n, 3)."""
    cross = doubled_areas(vertices, faces)
    sums = np.zeros((len(vertices), 3))
    for k in range(3):
        np.add.at(sums, faces[:, k], cross)
    return sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-300)[:, None]


def vertex_quadrics(vertices: Array, faces: IntArray, tangential: float) -> Array:
    """Area-weighted mean of n n^T over the triangles at each vertex, plus `tangential` times the identity (n, 3, 3)."""
    cross = doubled_areas(vertices, faces)
    area = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(area, 1e-300)[:, None]
    share = area[:, None, None] * normal[:, :, None] * normal[:, None, :]
    sums, total = np.zeros((len(vertices), 3, 3)), np.zeros(len(vertices))
    for k in range(3):
        np.add.at(sums, faces[:, k], share)
        np.add.at(total, faces[:, k], area)
    return sums / np.maximum(total, 1e-300)[:, None, None] + tangential * np.eye(3)


def vertex_weights(vertices: Array, faces: IntArray, own: int) -> Array:
    """Half by count, half by area: the report counts vertices, the surface is made of area; sums to 1 (n,).

    own: how many vertices count, the first ones; those that a subdivision added do not.
    """
    area = np.linalg.norm(doubled_areas(vertices, faces), axis=1)
    share = np.bincount(faces.ravel(), np.repeat(area / 3.0, 3), minlength=len(vertices))
    counted = np.arange(len(vertices)) < own
    return np.asarray(0.5 * counted / own + 0.5 * share / share.sum())
