"""Polygons in the plane: their areas, corners and turns, and what lies inside of them."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Array, IntArray


def edges_of(loop: Sequence[int]) -> list[tuple[int, int]]:
    """Return the pairs of nodes that follow each other in a loop."""
    return list(zip(loop, (*loop[1:], loop[0]), strict=True))


def area_of(loop: Array) -> float:
    """Return the area of a polygon (k, 2), negative where it is clockwise."""
    x, y = (loop - loop[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def straightened(loop: Array, near: float) -> IntArray:
    """Return the numbers of a polygon's corners (k, 2): not of points that lie on a straight line between others."""
    turn = int(np.abs(turns_of(loop)).argmax())
    loop = np.roll(loop, -turn, axis=0)
    closed = np.concatenate([loop, loop[:1]])
    kept, first = [0], 0
    for last in range(2, len(closed)):
        if _off(closed[first + 1 : last], closed[first], closed[last]).max() > 0.5 * near:
            first = last - 1
            kept.append(first)
    ends = [*kept, len(loop)]
    for k in range(1, len(kept)):  # a point just beside a corner may have been taken for it
        first, last = kept[k - 1], ends[k + 1]
        off = _off(closed[first + 1 : last], closed[first], closed[last])
        kept[k] = first + 1 + int(np.round(off / near, 6).argmax())
    return (np.array(kept) + turn) % len(loop)


def _off(points: Array, start: Array, end: Array) -> Array:
    """Return the distances (k,) of points (k, 2) from a line between two points."""
    along = end - start
    share = np.clip((points - start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))


def turns_of(loop: Array) -> Array:
    """Return the angle (k,) in radians by which a polygon turns at each corner, positive to the left."""
    after = np.roll(loop, -1, axis=0) - loop
    before = np.roll(after, 1, axis=0)
    return np.arctan2(cross(before, after), np.sum(before * after, axis=-1))


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of vectors in the plane (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def inside_of(loops: Sequence[Array], points: Array) -> Array:
    """Return for each point (n, 2) whether closed polygons, (k, 2) each, have it inside: an odd number of times."""
    start = np.concatenate(loops)
    end = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    up = (start[None, :, 1] > points[:, None, 1]) != (end[None, :, 1] > points[:, None, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (points[:, None, 1] - start[None, :, 1]) / (end - start)[None, :, 1]
    x = start[None, :, 0] + share * (end - start)[None, :, 0]
    return np.asarray(np.sum(up & (x > points[:, None, 0]), axis=1) % 2 == 1)
