"""Compiled loops that cut polygons into triangles of the least area."""

import numba
import numpy as np

from ..arrays import Array, IntArray

SHAPE = 1e-10  # weight of the logarithm of a triangle's shape beside its area, over the squared size
THINNEST = 1e-12  # shape (1: equilateral, 0: flat) below which all triangles weigh the same


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cut_all(points: Array, sizes: IntArray) -> IntArray:
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
