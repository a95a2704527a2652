"""Three proofs that two Bezier patches meet only where they are joined.

- Patches without a common point: a plane keeps their control points apart (found by Gilbert's algorithm, SIAM J.
  Control 4, 1966).
- Patches with a common corner: a plane through the corner, with all other control points strictly beside it.
- Patches with a common edge, unfolded into a rectangle, and a patch by itself: projected to a plane the derivative has
  a positive definite symmetric part, so that <x - y, F(x) - F(y)> > 0 on a convex domain.

A control net bounds its patch, and its differences bound the derivatives, so each proof looks at finitely many numbers,
with room for their rounding errors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, IntArray
from ..cube.cube import VARYING_AXES
from .bezier_patches import Mask, Pieces, as_rows, contact

_CHUNK = 4096  # pairs at a time
_PLANES = 64  # steps towards a separating plane


def settled(pieces: Pieces, pairs: IntArray, error: float) -> Mask:
    """For each pair (k, 2): is it proved that the two meet only where they are joined."""
    done = np.zeros(len(pairs), dtype=bool)
    for start in range(0, len(pairs), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        first, second = pairs[chunk].T
        touching, shared = contact(pieces, first, second)
        for kind, proof in enumerate((_corner_proof, _edge_proof, _own_proof)):  # what is shared: a point, an edge, all
            rows = np.flatnonzero(touching & (shared == kind))
            done[start + rows] = proof(pieces, first[rows], second[rows], error)
        rows = np.flatnonzero(~touching)
        a, b = (as_rows(pieces.nets[part[rows]]) for part in (first, second))
        done[start + rows] = _apart(a, b, error)
    return done


def _own_proof(pieces: Pieces, piece: NDArray[np.int64], _: NDArray[np.int64], error: float) -> Mask:
    nets = pieces.nets[piece]
    return _monotone(_differences(nets, 1), _differences(nets, 2), error, error)


def _edge_proof(pieces: Pieces, first: NDArray[np.int64], second: NDArray[np.int64], error: float) -> Mask:
    """Return where two pieces with a common edge, unfolded side by side into one rectangle, are monotone together.

    Axis 1 of the nets leads from the first over the edge into the second, axis 2 along the edge.
    """
    edge = np.maximum(pieces.low[first], pieces.low[second])  # its lower end
    along = np.argmax(edge < np.minimum(pieces.high[first], pieces.high[second]), axis=1)
    nets = [
        _turned(pieces, first, along, edge, edge_last=True),
        _turned(pieces, second, along, edge, edge_last=False),
    ]
    by_edge = np.concatenate([_differences(net, 2) for net in nets], axis=1)
    # Each side may have a parameter of its own, the unfolded pair stays a rectangle: with equal widths the mean over
    # both sides points out of the solid where the edge is as sharp as a knife's.
    sides = [_differences(net, 1) for net in nets]
    widths = np.stack([_width(side.mean(axis=1), by_edge.mean(axis=1)) for side in sides], axis=1)  # (n, 2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = np.concatenate([side / widths[:, i, None, None] for i, side in enumerate(sides)], axis=1)
        return _monotone(across, by_edge, error / widths.min(axis=1), error)


def _width(vectors: Array, directions: Array) -> Array:
    """Lengths (n,) of the components of vectors (n, 3) across directions (n, 3)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(np.cross(vectors, directions), axis=1) / np.linalg.norm(directions, axis=1))


def _turned(
    pieces: Pieces, rows: NDArray[np.int64], along: NDArray[np.int64], edge: NDArray[np.int64], *, edge_last: bool
) -> Array:
    """Nets whose axis 2 runs `along` the shared edge, and which have it last, or first, on axis 1."""
    nets, tangents = pieces.nets[rows], VARYING_AXES[pieces.axes[rows]]
    swap = tangents[:, 0] == along
    nets = np.where(swap[:, None, None, None], nets.swapaxes(1, 2), nets)
    across = np.where(swap, tangents[:, 1], tangents[:, 0])[:, None]
    at_high = np.take_along_axis(pieces.high[rows] == edge, across, axis=1)[:, 0]
    return np.where((at_high == edge_last)[:, None, None, None], nets, nets[:, ::-1])


def _corner_proof(pieces: Pieces, first: NDArray[np.int64], second: NDArray[np.int64], error: float) -> Mask:
    """All vectors from the first to the corner, and from the corner into the second, have a direction in common."""
    corner = np.maximum(pieces.low[first], pieces.low[second])
    before = _corner_last(pieces, first, corner)
    behind = _corner_last(pieces, second, corner)
    vectors = np.concatenate([before[:, -1:] - before[:, :-1], behind[:, :-1] - behind[:, -1:]], axis=1)
    return _apart(np.zeros((len(vectors), 1, 3)), vectors, error)


def _corner_last(pieces: Pieces, rows: NDArray[np.int64], corner: NDArray[np.int64]) -> Array:
    """Control points (n, (q + 1)^2, 3), the one at the shared corner last."""
    nets = pieces.nets[rows]
    at_high = np.take_along_axis(pieces.high[rows] == corner, VARYING_AXES[pieces.axes[rows]], axis=1)
    nets = np.where(at_high[:, 0, None, None, None], nets, nets[:, ::-1])
    nets = np.where(at_high[:, 1, None, None, None], nets, nets[:, :, ::-1])
    return as_rows(nets)


def _differences(nets: Array, axis: int) -> Array:
    """Control vectors (n, k, 3) of the derivative, up to the degree as a factor."""
    return as_rows(np.diff(nets, axis=axis))


def _monotone(across: Array, along: Array, across_error: Array | float, along_error: float) -> Mask:
    """Return whether a plane with coordinates is found in which [F_s F_t] has a positive definite symmetric part: (n,).

    across, along (n, k, 3): vectors whose convex hulls hold F_s and F_t. The coordinates are those in which their means
    are the unit vectors. The entries then lie in [[>= a, <= d], [<= c, >= b]] in magnitude, and with a, b > 0 and
    a b > c d, one coordinate, in the domain and in the plane, can be scaled so that the symmetric part is definite.
    The errors are those of the control points that the vectors are differences of.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        dual_s, dual_t = _dual_basis(across.mean(axis=1), along.mean(axis=1))
        a, c = _entry_bounds(across, dual_s, dual_t, across_error)
        b, d = _entry_bounds(along, dual_t, dual_s, along_error)
    proved: Mask = (a > 0.0) & (b > 0.0) & (a * b > 1.0001 * c * d)
    return proved


def _dual_basis(s: Array, t: Array) -> tuple[Array, Array]:
    """Return the vectors (n, 3) in the plane of s and t whose products with s and t are 1, 0 and 0, 1."""
    ss, st, tt = (np.sum(a * b, axis=1, keepdims=True) for a, b in ((s, s), (s, t), (t, t)))
    return (tt * s - st * t) / (ss * tt - st**2), (ss * t - st * s) / (ss * tt - st**2)


def _entry_bounds(vectors: Array, own: Array, other: Array, error: Array | float) -> tuple[Array, Array]:
    """Return the least product of vectors (n, k, 3) with `own`, and the largest with `other` in magnitude: (n,)."""
    slack_own, slack_other = (8.0 * np.abs(dual).sum(axis=1) for dual in (own, other))
    least = _along(vectors, own).min(axis=1) - error * slack_own
    return least, np.abs(_along(vectors, other)).max(axis=1) + error * slack_other


def _along(vectors: Array, direction: Array) -> Array:
    """Products (n, k) of vectors (n, k, 3) with a direction (n, 3) each."""
    return np.asarray(np.einsum("nkc,nc->nk", vectors, direction))


def _apart(a: Array, b: Array, error: float) -> Mask:
    """Whether a plane is found with the points a (n, k, 3) on one side and b (n, l, 3) on the other: (n,).

    Gilbert's algorithm: x moves towards the point of the differences' hull that is nearest to the origin.
    """
    done = np.zeros(len(a), dtype=bool)
    active = np.arange(len(a))
    x = b.mean(axis=1) - a.mean(axis=1)
    for _ in range(_PLANES):
        over_a, over_b = _along(a[active], x), _along(b[active], x)
        last, first = over_a.argmax(axis=1), over_b.argmin(axis=1)
        rows = np.arange(len(active))
        gap = over_b[rows, first] - over_a[rows, last]
        proved = gap > 4.0 * error * np.abs(x).sum(axis=1)
        done[active[proved]] = True
        support = (b[active, first] - a[active, last])[~proved]
        active, x = active[~proved], x[~proved]
        if not active.size:
            break
        step = x - support
        length = np.maximum(np.sum(step**2, axis=1), np.finfo(np.float64).tiny)
        x = x - np.clip(np.sum(x * step, axis=1) / length, 0.0, 1.0)[:, None] * step
    return done
