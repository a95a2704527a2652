"""The nearest points of a triangle mesh."""

import igl
import numpy as np

from ..arrays import Array, IntArray
from .geometry import normals_and_areas
from .solid import Solid


def distance_to_mesh(points: Array, vertices: Array, faces: IntArray) -> Array:
    """Return the distance of each point (m, 3) to the nearest point of a triangle mesh: (m,)."""
    return Solid(vertices, faces).depths(points)


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
    target = np.ascontiguousarray(vertices, dtype=np.float64)
    triangles = np.ascontiguousarray(faces, dtype=np.int64)
    squared, index, foot = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points, dtype=np.float64), target, triangles
    )
    nearest = np.asarray(index, dtype=np.int64).ravel()
    weights = shares_of(foot, target[triangles[nearest]])
    return np.sqrt(np.asarray(squared).ravel()), nearest, weights


def shares_of(points: Array, corners: Array) -> Array:
    """Return the barycentric weights (m, 3), none negative, of points (m, 3) in triangles, corners (m, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    edges = np.stack([b - a, c - a], axis=-1)  # (m, 3, 2)
    shares = np.einsum("mkx,mx->mk", np.linalg.pinv(edges), points - a)  # least squares: a sliver does no harm
    weights = np.clip(np.column_stack([1.0 - shares.sum(axis=1), shares]), 0.0, 1.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
