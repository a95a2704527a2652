"""TriangleTree: the nearest of many triangles to each of many points, found in a tree of boxes.

The triangles of a node are halved along the longest side of the box of their middles, and stand in an order in which
those of each node follow one another; nodes are numbered as in a heap. A point begins with the triangle of the point
before, which is often near, and goes only into boxes that are nearer. Of triangles equally near the first one counts,
so what comes before does not matter.
"""

from math import ceil, log2

import numpy as np

from ..arrays import Array, IntArray
from ..threads import in_parallel

_IN_LEAF = 8  # triangles, at most
_PIECE = 2048  # points that one thread looks for at once


class TriangleTree:
    """The triangles of a mesh, by their place.

    Parameters
    ----------
    vertices : (n, 3) array
    faces : (m, 3) array of int
    """

    def __init__(self, vertices: Array, faces: IntArray) -> None:
        from .triangle_tree_kernels import boxes_of, order

        corners = np.ascontiguousarray(vertices, dtype=np.float64)[faces]
        leaves = 2 ** ceil(log2(max(1.0, len(faces) / _IN_LEAF)))
        self._order = np.arange(len(faces))
        order(self._order, corners.sum(axis=1), leaves)
        self._corners = corners[self._order]
        self._boxes = boxes_of(self._corners, leaves)

    def nearest(self, points: Array) -> tuple[Array, IntArray, Array]:
        """Return the squared distances (k,) of points (k, 3), the nearest triangles (k,), and the weights (k, 3) there.

        The weights of its corners, none negative, belong to the nearest point of the triangle, and sum to 1.
        """
        from .triangle_tree_kernels import look_in

        points = np.ascontiguousarray(points, dtype=np.float64)
        count = len(points)
        squared, found, weights = np.empty(count), np.empty(count, dtype=np.int64), np.empty((count, 3))

        def look(start: int) -> None:
            rows = slice(start, start + _PIECE)
            look_in(self._boxes, self._corners, points[rows], squared[rows], found[rows], weights[rows])

        in_parallel(look, range(0, count, _PIECE))
        return squared, self._order[found], weights
