"""The body around a start: how far it is from a point to the surface along a ray, and which points lie inside."""

import igl
import numpy as np

from ..arrays import Array, IntArray, Mask

_ACCURACY = 2.0  # of the fast winding number
_NUDGES = 1e-5 * np.array([[0.61, -0.32, 0.72], [-0.48, 0.79, 0.38]])  # a ray through an edge or a corner meets nothing


class Body:
    """A closed surface, wound outward, that answers questions on rays and on points.

    Parameters
    ----------
    vertices : (n, 3) array
    faces : (m, 3) array of int
    """

    def __init__(self, vertices: Array, faces: IntArray) -> None:
        self._vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self._faces = np.ascontiguousarray(faces, dtype=np.int64)
        self._tree, self._winding = igl.AABB(), igl.FastWindingNumberBVH()
        self._tree.init(self._vertices, self._faces)
        self._winding.init(self._vertices, self._faces)
        self._size = float(np.linalg.norm(np.ptp(self._vertices, axis=0)))

    def rays(self, points: Array, directions: Array) -> Array:
        """Return the distances (...) from points (..., 3) to the surface along unit vectors (..., 3).

        Of a ray that meets nothing, as those of points outside may, it is the diagonal of the surface's box.
        """
        shape = np.broadcast_shapes(points.shape, directions.shape)
        origins, ways = (np.ascontiguousarray(np.broadcast_to(x, shape).reshape(-1, 3)) for x in (points, directions))
        found = np.full(len(origins), self._size)
        for nudge in _NUDGES:
            hit, distances, _ = self._tree.intersect_ray_first(self._vertices, self._faces, origins, ways + nudge)
            met = np.asarray(hit).ravel() >= 0
            found[met] = np.minimum(found, np.asarray(distances).ravel())[met]
        return found.reshape(shape[:-1])

    def depths(self, points: Array) -> Array:
        """Return the distances (n,) of points (n, 3) from the surface."""
        squares = self._tree.squared_distance(self._vertices, self._faces, np.ascontiguousarray(points))[0]
        return np.sqrt(np.asarray(squares).ravel())

    def contains(self, points: Array) -> Mask:
        """Return which points (..., 3) lie inside (...)."""
        rows = np.ascontiguousarray(points.reshape(-1, 3))
        numbers = np.asarray(self._winding.winding_number(rows, _ACCURACY)).ravel()
        return np.asarray(numbers > 0.5).reshape(points.shape[:-1])
