"""Compiled loops over the triangles of a part's surface, for points near it."""

import numba
import numpy as np

from ..arrays import Array, IntArray

AGREES = 1e-6  # a triangle is preferred where its cosine is larger by more than this


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def best_aligned(
    points: Array,
    given: Array,
    reach: Array,
    found: IntArray,
    vertices: Array,
    faces: IntArray,
    normals: Array,
    starts: IntArray,
    around: IntArray,
) -> IntArray:
    """Return the best aligned triangles (k,) within `reach` (k,) among the triangles at the corners of `found` (k,)."""
    best = found.copy()
    for i in range(len(points)):
        agreement = np.dot(normals[found[i]], given[i])
        for corner in faces[found[i]]:
            for t in around[starts[corner] : starts[corner + 1]]:
                other = np.dot(normals[t], given[i])
                if other > agreement + AGREES and distance(points[i], vertices, faces[t]) <= reach[i]:
                    best[i], agreement = t, other
    return best


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def nearest_in_triangles(points: Array, vertices: Array, faces: IntArray) -> Array:
    """Return the point (k, 3) of each triangle that is nearest to each point (k, 3): in its inside, or on a side."""
    found = np.empty_like(points)
    for i in range(len(points)):
        corners = vertices[faces[i]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        size, inside, nearest, least = np.dot(normal, normal), True, corners[0], np.inf
        for k in range(3):
            start, along = corners[k], corners[(k + 1) % 3] - corners[k]
            away = points[i] - start
            inside = inside and np.dot(np.cross(along, away), normal) >= 0.0
            share = min(max(np.dot(away, along) / max(np.dot(along, along), 1e-300), 0.0), 1.0)
            foot = start + share * along
            squared = np.dot(points[i] - foot, points[i] - foot)
            if squared < least:
                nearest, least = foot, squared
        if inside and size > 0.0:
            nearest = points[i] - (np.dot(points[i] - corners[0], normal) / size) * normal
        for d in range(3):
            found[i, d] = nearest[d]
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def distance(point: Array, vertices: Array, face: IntArray) -> float:
    """Return the distance of a point (3,) to a triangle: to its inside, or to the nearest of its sides."""
    normal = np.cross(vertices[face[1]] - vertices[face[0]], vertices[face[2]] - vertices[face[0]])
    inside, nearest = True, np.inf
    for k in range(3):
        start, end = vertices[face[k]], vertices[face[(k + 1) % 3]]
        along, away = end - start, point - start
        inside = inside and np.dot(np.cross(along, away), normal) >= 0.0
        share = np.dot(away, along) / max(np.dot(along, along), 1e-300)
        nearest = min(nearest, float(np.linalg.norm(away - min(max(share, 0.0), 1.0) * along)))
    size = float(np.linalg.norm(normal))
    return float(abs(np.dot(point - vertices[face[0]], normal))) / size if inside and size > 0.0 else nearest
