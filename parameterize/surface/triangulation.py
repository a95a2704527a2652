"""Polygons of a surface cut into triangles: of all ways, the one with the least area.

Triangles that fill a plane polygon have its area in all, others more: the least area neither overlaps nor leaves the
polygon, be it concave, slit to a hole (the slit's edge runs both ways) or not quite plane. Every way has n - 2
triangles, so no hole ever opens. The minimum follows from the minima of shorter chains of corners (Barequet and Sharir,
"Filling gaps in the boundary of a polyhedron", CAGD 12, 1995).
"""

from itertools import chain

import numba
import numpy as np

from ..arrays import Array, IntArray
from .errors import MeshError

MAX_CORNERS = 256  # time grows with the cube: 256 corners take some hundredths of a second
SHAPE = 1e-10  # weight of the logarithm of a triangle's shape beside its area, over the squared size
THINNEST = 1e-12  # shape (1: equilateral, 0: flat) below which all triangles weigh the same


def triangulate(vertices: Array, polygons: list[list[int]], most: int = MAX_CORNERS) -> IntArray:
    """Return triangles (m, 3) in the polygons' order, wound like them; a polygon of n corners gives n - 2.

    Vertex numbers must be in range and coordinates finite; a triangle may repeat a corner only where its polygon does.
    Raises MeshError for a polygon of more than `most` corners.
    """
    sizes = np.array([len(polygon) for polygon in polygons])
    if sizes.max() > most:
        raise MeshError(f"a face has {sizes.max()} corners, more than {most}: triangulate it")
    corners = np.fromiter(chain.from_iterable(polygons), dtype=np.int64, count=sizes.sum())
    if sizes.max() == 3:
        return corners.reshape(-1, 3)
    starts = np.cumsum(sizes) - sizes
    placed = vertices[corners] - np.repeat(vertices[corners[starts]], sizes, axis=0)
    size = np.maximum.reduceat(abs(placed).max(axis=1), starts)
    placed /= np.repeat(np.maximum(size, 1e-300), sizes)[:, None]
    return corners[_cut_all(placed, sizes)]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _cut_all(points: Array, sizes: IntArray) -> IntArray:
    """Return triangles (m, 3), as rows of `points`, of polygons that follow one another there, of sizes (p,)."""
    triangles = np.empty((len(points) - 2 * len(sizes), 3), dtype=np.int64)
    chains = np.empty((sizes.max(), 2), dtype=np.int64)  # still to be cut, each by the triangle on its closing edge
    start = end = 0
    for size in sizes:
        apex = _apices(points[start : start + size])
        chains[0, 0], chains[0, 1], left = 0, size - 1, 1
        while left:
            first, last = chains[left - 1]
            middle = apex[first, last]
            triangles[end, 0], triangles[end, 1], triangles[end, 2] = start + first, start + middle, start + last
            end, left = end + 1, left - 1
            for low, high in ((first, middle), (middle, last)):
                if high - low > 1:
                    chains[left, 0], chains[left, 1], left = low, high, left + 1
        start += size
    return triangles


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _apices(points: Array) -> IntArray:
    """Return at [i, k] the corner of the triangle on the closing edge k-i of the chain of corners i..k, (n, n)."""
    n = len(points)
    weight = np.zeros((n, n))
    apex = np.zeros((n, n), dtype=np.int64)
    for length in range(2, n):
        for first in range(n - length):
            last = first + length
            weight[first, last] = np.inf
            for middle in range(first + 1, last):
                whole = weight[first, middle] + weight[middle, last]
                if whole < weight[first, last]:
                    whole += _weight(points[first], points[middle], points[last])
                if whole < weight[first, last]:
                    weight[first, last], apex[first, last] = whole, middle
    return apex


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _weight(a: Array, b: Array, c: Array) -> float:
    """Return the area of a triangle plus a small multiple of its shape, which decides between equal areas."""
    normal_squared = edges_squared = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal_squared += ((b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j])) ** 2
        edges_squared += (b[i] - a[i]) ** 2 + (c[i] - b[i]) ** 2 + (a[i] - c[i]) ** 2
    area = 0.5 * np.sqrt(normal_squared)
    shape = 4.0 * np.sqrt(3.0) * area / max(edges_squared, 1e-300)
    return area - SHAPE * np.log(max(shape, THINNEST))
