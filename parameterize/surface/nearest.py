"""The nearest points of a triangle mesh."""

import numpy as np

from ..arrays import Array, IntArray
from .geometry import normals_and_areas
from .triangle_tree import TriangleTree


def distance_to_mesh(points: Array, vertices: Array, faces: IntArray) -> Array:
    """Return the distance of each point (m, 3) to the nearest point of a triangle mesh: (m,)."""
    return np.sqrt(TriangleTree(vertices, faces).nearest(points)[0])


def nearest_on_mesh(points: Array, vertices: Array, faces: IntArray) -> tuple[Array, Array]:
    """Return the nearest point of a triangle mesh to each point (m, 3), and the unit normal of its triangle."""
    _, triangle, weights = closest_triangles(points, vertices, faces)
    corners = vertices[faces[triangle]]  # (m, 3, 3)
    normals, _ = normals_and_areas(vertices, faces[triangle])
    return np.einsum("mk,mka->ma", weights, corners), normals


def closest_triangles(points: Array, vertices: Array, faces: IntArray) -> tuple[Array, IntArray, Array]:
    """Return the distance (m,) of points (m, 3) to a mesh, the nearest triangles (m,), and barycentric weights (m, 3).

    The weights belong to the nearest point within its triangle.
    """
    squared, nearest, weights = TriangleTree(vertices, faces).nearest(points)
    return np.sqrt(squared), nearest, weights


def shares_of(points: Array, corners: Array) -> Array:
    """Return the barycentric weights (m, 3), none negative, of points (m, 3) in triangles, corners (m, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    edges = np.stack([b - a, c - a], axis=-1)  # (m, 3, 2)
    shares = np.einsum("mkx,mx->mk", np.linalg.pinv(edges), points - a)  # least squares: a sliver does no harm
    weights = np.clip(np.column_stack([1.0 - shares.sum(axis=1), shares]), 0.0, 1.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
