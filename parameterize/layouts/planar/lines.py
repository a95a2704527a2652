"""Lays the profiles of all slabs on each other: the lines between them, cut wherever two meet."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray
from ...surface.geometry import connected
from .polygons import cross, straightened

MOST_LINES = 3000  # of all profiles: finer outlines are not worth their time


def lines_of(profiles: Sequence[Sequence[Array]], near: float) -> tuple[Array, IntArray] | None:
    """Return points (n, 2) and the lines between them (m, 2) that all profiles consist of; None for too many.

    Lines meet at common points alone. profiles: of each slab polygons (k, 2). near: nearer points are one.
    """
    loops = [loop[straightened(loop, near)] for loops in profiles for loop in loops]
    if any(len(loop) < 3 for loop in loops) or sum(map(len, loops)) > MOST_LINES:
        return None
    points = np.concatenate(loops)
    starts = np.cumsum([0, *map(len, loops)])
    lines = np.concatenate([start + _cycle(len(loop)) for start, loop in zip(starts, loops, strict=False)])
    points, lines = _welded(points, lines, near)
    points, lines = _crossed(points, lines, near)
    points, lines = _welded(points, lines, near)
    return _welded(*_touched(points, lines, near), near)


def _cycle(count: int) -> IntArray:
    numbers = np.arange(count)
    return np.stack([numbers, np.roll(numbers, -1)], axis=1)


def _welded(points: Array, lines: IntArray, near: float) -> tuple[Array, IntArray]:
    """Return points, those near to each other made one, and the different lines between them."""
    pairs = cKDTree(points).query_pairs(2.0 * near, output_type="ndarray")
    label = np.unique(connected(pairs, len(points)), return_inverse=True)[1]
    counts = np.bincount(label).astype(np.float64)
    means = np.stack([np.bincount(label, column) for column in points.T], axis=1) / counts[:, None]
    pairs = np.sort(label[lines], axis=1)
    return means, np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def _crossed(points: Array, lines: IntArray, near: float) -> tuple[Array, IntArray]:
    """Return the points, with one wherever two lines cross, for lines to be cut at."""
    start, along = points[lines[:, 0]], points[lines[:, 1]] - points[lines[:, 0]]
    boxes = np.sort(points[lines], axis=1)
    meet = np.all(boxes[:, None, 0] <= boxes[None, :, 1] + near, axis=2)
    one, other = np.nonzero(np.triu(meet & meet.T, 1))
    det = cross(along[one], along[other])
    gap = start[other] - start[one]
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = cross(gap, along[other]) / det, cross(gap, along[one]) / det
    inside = (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0) & (np.abs(det) > 0.0)
    return np.concatenate([points, start[one[inside]] + s[inside, None] * along[one[inside]]]), lines


def _touched(points: Array, lines: IntArray, near: float) -> tuple[Array, IntArray]:
    """Return lines cut at the points that lie on them."""
    pieces = []
    for a, b in lines.tolist():
        along = points[b] - points[a]
        length = float(np.linalg.norm(along))
        place = (points - points[a]) @ along / length
        off = np.abs(cross(points - points[a], along)) / length
        on = np.flatnonzero((off <= 2.0 * near) & (place > near) & (place < length - near))
        chain = [a, *on[np.argsort(place[on])].tolist(), b]
        pieces += list(zip(chain, chain[1:], strict=False))
    return points, np.array(pieces, dtype=np.int64)
