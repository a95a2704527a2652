"""Quadrangles in the plane with curved sides: how good their Coons patches are, and points moved for better ones."""

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from .plane_curves import SAMPLES, Curve

_STEP = 4  # samples of a side, of which the patch is looked at
_SWEEPS = 12  # over all inner points
_STEPS = (0.3, 0.1, 0.03)  # of the shortest side there: how far a point is moved
_WAYS = np.array([[np.cos(a), np.sin(a)] for a in np.arange(8) * np.pi / 4.0])
_ENDS = np.array([[0, 1], [3, 2], [0, 3], [1, 2]])  # of the sides v = 0, v = 1, u = 0 and u = 1 among four corners

Quad = tuple[int, ...]
Sides = dict[tuple[int, int], Curve]


def coons_patch(low: Array, high: Array, left: Array, right: Array, u: Array, v: Array) -> Array:
    """Return the points (n_u, n_v, d) of a Coons patch at parameters u (n_u,) and v (n_v,).

    low, high: (n_u, d), its points at v = 0 and v = 1. left, right: (n_v, d), those at u = 0 and u = 1. Of control
    points at the Greville points of knots it is the patch of the splines.
    """
    s, t = u[:, None, None], v[None, :, None]
    ruled = (1 - t) * low[:, None] + t * high[:, None] + (1 - s) * left[None] + s * right[None]
    return np.asarray(ruled - (1 - s) * ((1 - t) * low[0] + t * high[0]) - s * ((1 - t) * low[-1] + t * high[-1]))


def qualities(points: Array, quads: Sequence[Quad], sides: Sides) -> Array:
    """Return the quality of the Coons patch of each quadrangle of points (n, 2): 1 for a rectangle, below 0 for a fold.

    It is the smallest scaled Jacobian at samples, times the cube root of the smallest det J over the largest.
    """
    if not len(quads):
        return np.zeros(0)
    ends = np.asarray(quads)[:, _ENDS]  # (k, 4, 2)
    even, starts, stops = np.linspace(0.0, 1.0, SAMPLES)[:, None], points[ends[..., :1]], points[ends[..., 1:]]
    rows = (1.0 - even) * starts + even * stops  # (k, 4, SAMPLES, 2)
    of_sides = rows.reshape(-1, SAMPLES, 2)
    for number, (a, b) in enumerate(ends.reshape(-1, 2).tolist()):
        if (curve := sides.get((a, b))) is not None:
            of_sides[number] = curve.samples
    return qualities_of(rows)


def qualities_of(rows: Array) -> Array:
    """Return the qualities (k,) of Coons patches from samples (k, 4, SAMPLES, 2) of v = 0, v = 1, u = 0 and u = 1."""
    slopes = np.gradient(rows, 1.0 / (SAMPLES - 1), axis=2, edge_order=2)[:, :, ::_STEP]
    rows = rows[:, :, ::_STEP]
    s = np.linspace(0.0, 1.0, rows.shape[2])
    u, v = s[:, None, None], s[None, :, None]
    low, high, left, right = (rows[:, k] for k in range(4))
    p00, p10, p01, p11 = (x[:, None, None] for x in (low[:, 0], low[:, -1], high[:, 0], high[:, -1]))
    along_u = (1 - v) * slopes[:, 0, :, None] + v * slopes[:, 1, :, None] + (right - left)[:, None]
    along_u = along_u - ((1 - v) * (p10 - p00) + v * (p11 - p01))
    along_v = (1 - u) * slopes[:, 2, None] + u * slopes[:, 3, None] + (high - low)[:, :, None]
    along_v = along_v - ((1 - u) * (p01 - p00) + u * (p11 - p10))
    det = along_u[..., 0] * along_v[..., 1] - along_u[..., 1] * along_v[..., 0]
    scaled = det / np.maximum(np.linalg.norm(along_u, axis=-1) * np.linalg.norm(along_v, axis=-1), 1e-300)
    ratio = det.min(axis=(1, 2)) / np.maximum(np.abs(det).max(axis=(1, 2)), 1e-300)
    return np.asarray(scaled.min(axis=(1, 2)) * np.cbrt(np.abs(ratio)))


def smoothed(points: Array, quads: Sequence[Quad], sides: Sides, inner: Sequence[int]) -> Array:
    """Return points (n, 2), inner ones moved until the worst quadrangle at each is no better."""
    points = points.copy()
    at = {k: [q for q in quads if k in q] for k in inner}
    beside = {k: sorted({q[(q.index(k) + s) % 4] for q in own for s in (1, 3)}) for k, own in at.items()}
    for _ in range(_SWEEPS):
        moved = False
        for k, own in at.items():
            if not own:
                continue
            near = points[beside[k]]
            size = float(np.linalg.norm(near - points[k], axis=1).min())
            tries = np.concatenate(
                [points[k][None], near.mean(axis=0)[None], *(points[k] + h * size * _WAYS for h in _STEPS)]
            )
            best = int(_worst(points, k, tries, own, sides).argmax())
            moved |= best > 0
            points[k] = tries[best]
        if not moved:
            break
    return points


def _worst(points: Array, k: int, tries: Array, own: Sequence[Quad], sides: Sides) -> Array:
    """Return the worst quality of the quadrangles at a point for each of its tried places (t, 2)."""
    even = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    rows = np.empty((len(tries), len(own), 4, SAMPLES, 2))
    for j, (a, b, c, d) in enumerate(own):
        for i, (p, q) in enumerate(((a, b), (d, c), (a, d), (b, c))):
            curve = sides.get((p, q))
            if curve is not None:
                rows[:, j, i] = curve.samples
            else:
                start, end = (tries if x == k else np.repeat(points[x][None], len(tries), 0) for x in (p, q))
                rows[:, j, i] = (1.0 - even) * start[:, None] + even * end[:, None]
    goodness = qualities_of(rows.reshape(-1, 4, SAMPLES, 2)).reshape(len(tries), len(own))
    return np.asarray(goodness.min(axis=1) + 1e-3 * goodness.mean(axis=1))
