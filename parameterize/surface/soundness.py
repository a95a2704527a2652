"""Whether a surface is closed and sound, in one compiled pass: most surfaces are, and need none of the repairs."""

import numba
import numpy as np

from ..arrays import IntArray

_LEAST_FACES = 3  # around a vertex: two lie on each other


def is_sound(faces: IntArray) -> bool:
    """Return whether every edge has two faces, which run along it in opposite directions, and every vertex one fan.

    No two of such faces have the same three corners, and no face has a corner twice.
    """
    if not len(faces) or faces.min() < 0:
        return False
    ends = np.concatenate([[0], np.cumsum(np.bincount(faces.ravel()))])
    return bool(_has_fans(np.ascontiguousarray(faces), ends))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _has_fans(faces: IntArray, ends: IntArray) -> bool:
    """Return whether faces are sound; ends: the number of corners at all vertices before each one, and of all."""
    corners, filled = np.empty(3 * len(faces), dtype=np.int64), ends.copy()  # corners are 3 i + k
    for corner in range(3 * len(faces)):
        vertex = faces[corner // 3, corner % 3]
        corners[filled[vertex]] = corner
        filled[vertex] += 1
    seen_from = np.full(len(ends) - 1, -1, dtype=np.int64)  # the last vertex that has an edge to this one,
    corner_of = np.empty(len(ends) - 1, dtype=np.int64)  # and the corner from which that edge goes out
    for vertex in range(len(ends) - 1):
        around = corners[ends[vertex] : ends[vertex + 1]]
        for corner in around:
            after = faces[corner // 3, (corner + 1) % 3]
            if after == vertex or seen_from[after] == vertex:
                return False
            seen_from[after], corner_of[after] = vertex, corner
        if len(around) and not _is_fan(faces, vertex, around, seen_from, corner_of):
            return False
    return True


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _is_fan(faces: IntArray, vertex: int, around: IntArray, seen_from: IntArray, corner_of: IntArray) -> bool:
    """Return whether the faces at the corners around a vertex follow one another, edge by edge, all round."""
    corner = around[0]
    for step in range(1, len(around) + 1):
        before = faces[corner // 3, (corner + 2) % 3]
        if seen_from[before] != vertex:
            return False
        corner = corner_of[before]
        if corner == around[0]:
            return step == len(around) and step >= _LEAST_FACES
    return False
