"""Is a volume's boundary injective: do its six faces meet nowhere but where they are joined?

With det J > 0 on the whole cube, an injective boundary makes the whole map one-to-one. The faces are cut into Bezier
patches, and every pair of patches is settled by one of three proofs, or cut in four and looked at again:

- patches without a common point: a plane keeps their control points apart (found by Gilbert's algorithm, SIAM J.
  Control 4, 1966);
- patches with a common corner: a plane through the corner, with all other control points strictly beside it;
- patches with a common edge, unfolded into a rectangle, and a patch by itself: projected to a plane the derivative has
  a positive definite symmetric part, so that <x - y, F(x) - F(y)> > 0 on a convex domain.

A control net bounds its patch, and its differences bound the derivatives, so each proof looks at finitely many numbers,
with room for their rounding errors. Where nothing is proved, two parameters of one point are searched for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bezier import elevation, extraction, halving
from .boxes import Pairs, overlapping_boxes
from .bspline import Array, breakpoints
from .volume import BSplineVolume

Mask = NDArray[np.bool_]
Point = tuple[float, float, float]

_TANGENTS = np.array([[1, 2], [0, 2], [0, 1]])  # the axes that vary on a face whose constant axis is given
_CHUNK = 4096  # pairs at a time
_MOST_PAIRS = 50_000, 10  # in all, and for each patch in addition: more are not looked at
_PLANES = 64  # steps towards a separating plane
_TRIED = 64  # pairs a level from which a common point is searched for
_NEWTON_STEPS = 12


@dataclass(frozen=True)
class Meeting:
    """Two parameters on the boundary of the cube that the map takes to one point, in the user's units."""

    parameters: tuple[Point, Point]
    point: Point

    def __str__(self) -> str:
        first, second, place = ("({:.6g}, {:.6g}, {:.6g})".format(*row) for row in (*self.parameters, self.point))
        return f"meets itself at {place}, parameters {first} and {second}"


@dataclass(frozen=True)
class BoundaryCheck:
    """injective: True where proved, False where `meeting` was found (to rounding), None where neither.

    undecided: pairs of patches left without a proof.
    """

    injective: bool | None
    meeting: Meeting | None
    undecided: int

    def as_dict(self) -> dict[str, Any]:
        """Entries of the section `parameterization` of report.json."""
        meeting = self.meeting
        place = meeting and {"parameters": [list(row) for row in meeting.parameters], "point": list(meeting.point)}
        return {"boundary_injective": self.injective, "boundary_meeting": place}


def check_boundary(volume: BSplineVolume, *, max_depth: int = 12) -> BoundaryCheck:
    """Decide whether F is injective on the boundary of the cube, cutting patches at most `max_depth` times in four.

    Raises ValueError for a negative depth.
    """
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    pieces = _boundary_pieces(volume)
    error = _rounding(volume, max_depth)
    own = np.repeat(np.arange(len(pieces.nets))[:, None], 2, axis=1)
    points = _as_rows(pieces.nets)
    pairs = np.concatenate([own, overlapping_boxes(points.min(axis=1) - error, points.max(axis=1) + error)])
    most = _MOST_PAIRS[0] + _MOST_PAIRS[1] * len(own)
    for depth in range(max_depth + 1):
        hopeless = len(pairs) > most  # then only a common point is searched for
        pairs = pairs if hopeless else pairs[~_settled(pieces, pairs, error)]
        if not len(pairs):
            return BoundaryCheck(True, None, 0)
        meeting = _search(volume, pieces, pairs)
        if meeting is not None:
            return BoundaryCheck(False, meeting, len(pairs))
        if hopeless or depth == max_depth:
            break
        pieces, pairs = _halved(pieces, pairs)
    return BoundaryCheck(None, None, len(pairs))


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Parts of the six faces, all cut equally often: their edges are 2**-depth of a span's edges.

    axes: (n,) the parameter that is constant. low, high: (n, 3) corners in the cube, counted in edges of pieces.
    nets: (n, q + 1, q + 1, 3) Bezier control points, along the two other parameters in their order.
    """

    depth: int
    axes: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    nets: Array


def _boundary_pieces(volume: BSplineVolume) -> _Pieces:
    """All spans of the six faces, raised to the largest degree."""
    degree = max(volume.degrees)
    parts = [_face_pieces(volume, axis, side, degree) for axis in range(3) for side in range(2)]
    axes, low, nets = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    high = low.copy()
    np.put_along_axis(high, _TANGENTS[axes], np.take_along_axis(low, _TANGENTS[axes], axis=1) + 1, axis=1)
    return _Pieces(0, axes, low, high, nets)


def _face_pieces(
    volume: BSplineVolume, axis: int, side: int, degree: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Constant axes (n,), low corners (n, 3) and nets (n, q + 1, q + 1, 3) of one face's spans."""
    net = volume.face(axis, side)  # (n_a, n_b, 3)
    a, b = _TANGENTS[axis]
    for direction, position in ((a, 0), (b, 2)):  # (s_a, q + 1, n_b, 3), then (s_a, q + 1, s_b, q + 1, 3)
        own = volume.degrees[direction]
        first, weights = extraction(volume.knots[direction], own)
        local = np.take(net, first[:, None] + np.arange(own + 1), axis=position)
        local = np.moveaxis(local, (position, position + 1), (0, 1))
        local = np.einsum("ij,sjk,sk...->si...", elevation(own, degree), weights, local)
        net = np.moveaxis(local, (0, 1), (position, position + 1))
    counts = net.shape[0], net.shape[2]
    place = np.indices(counts).reshape(2, -1).T  # (n, 2)
    low = np.zeros((len(place), 3), dtype=np.int64)
    low[:, [a, b]] = place
    low[:, axis] = side * (len(breakpoints(volume.knots[axis])) - 1)
    nets = net.transpose(0, 2, 1, 3, 4).reshape(-1, degree + 1, degree + 1, 3)
    return np.full(len(place), axis, dtype=np.int64), low, nets


def _rounding(volume: BSplineVolume, max_depth: int) -> float:
    """Bound of the rounding error of a Bezier control point's coordinate.

    No weight is negative and all sum to 1, so that each rounding changes a sum by at most the unit roundoff times the
    largest coordinate: 6 p + 2 a direction for the extraction (bezier.py), 2 p + 2 for the elevation, p + 1 a halving.
    """
    degree = max(volume.degrees)
    roundings = 2 * (8 * degree + 4 + max_depth * (degree + 1)) + 8
    return 1.01 * roundings * 2.0**-53 * float(np.abs(volume.control_points).max())


def _halved(pieces: _Pieces, pairs: Pairs) -> tuple[_Pieces, Pairs]:
    """The pieces that are left as four each, and the pairs of those."""
    used, compact = np.unique(pairs, return_inverse=True)
    q = pieces.nets.shape[1] - 1
    halves = halving(q)
    nets = np.einsum("gij,hkl,njlc->nghikc", halves, halves, pieces.nets[used], optimize=True)
    axes = np.repeat(pieces.axes[used], 4)
    low = np.repeat(2 * pieces.low[used], 4, axis=0)
    tangents = _TANGENTS[axes]
    corner = np.tile([[0, 0], [0, 1], [1, 0], [1, 1]], (len(used), 1))
    np.put_along_axis(low, tangents, np.take_along_axis(low, tangents, axis=1) + corner, axis=1)
    high = low.copy()
    np.put_along_axis(high, tangents, np.take_along_axis(low, tangents, axis=1) + 1, axis=1)
    finer = _Pieces(pieces.depth + 1, axes, low, high, nets.reshape(-1, q + 1, q + 1, 3))
    compact = compact.reshape(-1, 2)
    alone = compact[:, 0] == compact[:, 1]
    return finer, np.concatenate(
        [
            _children(compact[alone], np.argwhere(np.tri(4, dtype=bool))),
            _children(compact[~alone], np.argwhere(np.ones((4, 4), dtype=bool))),
        ]
    )


def _children(pairs: Pairs, places: NDArray[np.int64]) -> Pairs:
    """Pairs (k, 2) of pieces, and which of the four of each: (k * len(places), 2)."""
    return (4 * pairs[:, None] + places).reshape(-1, 2)


def _settled(pieces: _Pieces, pairs: Pairs, error: float) -> Mask:
    """For each pair (k, 2): is it proved that the two meet only where they are joined."""
    done = np.zeros(len(pairs), dtype=bool)
    for start in range(0, len(pairs), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        first, second = pairs[chunk].T
        touching, shared = _contact(pieces, first, second)
        for kind, proof in enumerate((_corner_proof, _edge_proof, _own_proof)):  # what is shared: a point, an edge, all
            rows = np.flatnonzero(touching & (shared == kind))
            done[start + rows] = proof(pieces, first[rows], second[rows], error)
        rows = np.flatnonzero(~touching)
        a, b = (_as_rows(pieces.nets[part[rows]]) for part in (first, second))
        done[start + rows] = _apart(a, b, error)
    return done


def _contact(pieces: _Pieces, first: NDArray[np.int64], second: NDArray[np.int64]) -> tuple[Mask, NDArray[np.int64]]:
    """Whether pieces touch in the cube, and the dimension of what they share."""
    low = np.maximum(pieces.low[first], pieces.low[second])
    high = np.minimum(pieces.high[first], pieces.high[second])
    return np.all(low <= high, axis=1), np.sum(low < high, axis=1)


def _own_proof(pieces: _Pieces, piece: NDArray[np.int64], _: NDArray[np.int64], error: float) -> Mask:
    nets = pieces.nets[piece]
    return _monotone(_differences(nets, 1), _differences(nets, 2), error, error)


def _edge_proof(pieces: _Pieces, first: NDArray[np.int64], second: NDArray[np.int64], error: float) -> Mask:
    """The two side by side: axis 1 of the nets leads from the first over the edge into the second, axis 2 along it."""
    low = np.maximum(pieces.low[first], pieces.low[second])
    along = np.argmax(low < np.minimum(pieces.high[first], pieces.high[second]), axis=1)
    before = _turned(pieces, first, along, low, edge_last=True)
    behind = _turned(pieces, second, along, low, edge_last=False)
    along_edge = np.concatenate([_differences(before, 2), _differences(behind, 2)], axis=1)
    # Each side may have a parameter of its own, the unfolded pair stays a rectangle: with equal widths the mean over
    # both sides points out of the solid where the edge is as sharp as a knife's.
    parts = [_differences(net, 1) for net in (before, behind)]
    widths = np.stack([_width(part.mean(axis=1), along_edge.mean(axis=1)) for part in parts], axis=1)  # (n, 2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = np.concatenate([part / widths[:, i, None, None] for i, part in enumerate(parts)], axis=1)
        return _monotone(across, along_edge, error / widths.min(axis=1), error)


def _width(vectors: Array, directions: Array) -> Array:
    """Lengths (n,) of the components of vectors (n, 3) across directions (n, 3)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(np.cross(vectors, directions), axis=1) / np.linalg.norm(directions, axis=1))


def _turned(
    pieces: _Pieces, rows: NDArray[np.int64], along: NDArray[np.int64], edge: NDArray[np.int64], *, edge_last: bool
) -> Array:
    """Nets whose axis 2 runs `along` the shared edge, and which have it last, or first, on axis 1."""
    nets, tangents = pieces.nets[rows], _TANGENTS[pieces.axes[rows]]
    swap = tangents[:, 0] == along
    nets = np.where(swap[:, None, None, None], nets.swapaxes(1, 2), nets)
    across = np.where(swap, tangents[:, 1], tangents[:, 0])[:, None]
    at_high = np.take_along_axis(pieces.high[rows] == edge, across, axis=1)[:, 0]
    return np.where((at_high == edge_last)[:, None, None, None], nets, nets[:, ::-1])


def _corner_proof(pieces: _Pieces, first: NDArray[np.int64], second: NDArray[np.int64], error: float) -> Mask:
    """All vectors from the first to the corner, and from the corner into the second, have a direction in common."""
    corner = np.maximum(pieces.low[first], pieces.low[second])
    before = _corner_last(pieces, first, corner)
    behind = _corner_last(pieces, second, corner)
    vectors = np.concatenate([before[:, -1:] - before[:, :-1], behind[:, :-1] - behind[:, -1:]], axis=1)
    return _apart(np.zeros((len(vectors), 1, 3)), vectors, error)


def _corner_last(pieces: _Pieces, rows: NDArray[np.int64], corner: NDArray[np.int64]) -> Array:
    """Control points (n, (q + 1)^2, 3), the one at the shared corner last."""
    nets = pieces.nets[rows]
    at_high = np.take_along_axis(pieces.high[rows] == corner, _TANGENTS[pieces.axes[rows]], axis=1)
    nets = np.where(at_high[:, 0, None, None, None], nets, nets[:, ::-1])
    nets = np.where(at_high[:, 1, None, None, None], nets, nets[:, :, ::-1])
    return _as_rows(nets)


def _as_rows(nets: Array) -> Array:
    """(n, i, j, 3) -> (n, i * j, 3)."""
    return nets.reshape(len(nets), nets.shape[1] * nets.shape[2], 3)


def _differences(nets: Array, axis: int) -> Array:
    """Control vectors (n, k, 3) of the derivative, up to the degree as a factor."""
    return _as_rows(np.diff(nets, axis=axis))


def _monotone(across: Array, along: Array, across_error: Array | float, along_error: float) -> Mask:
    """Whether a plane and coordinates in it are found in which [F_s F_t] has a positive definite symmetric part: (n,).

    across, along (n, k, 3): vectors whose convex hulls hold F_s and F_t. The coordinates are those in which their means
    are the unit vectors. The entries then lie in [[>= a, <= d], [<= c, >= b]] in magnitude, and with a, b > 0 and
    a b > c d, one coordinate, in the domain and in the plane, can be scaled so that the symmetric part is definite.
    The errors are those of the control points that the vectors are differences of.
    """
    s, t = across.mean(axis=1), along.mean(axis=1)  # (n, 3)
    ss, st, tt = (np.sum(a * b, axis=1, keepdims=True) for a, b in ((s, s), (s, t), (t, t)))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        dual_s, dual_t = ((tt * s - st * t) / (ss * tt - st**2), (ss * t - st * s) / (ss * tt - st**2))
        slack_s, slack_t = (8.0 * np.abs(dual).sum(axis=1) for dual in (dual_s, dual_t))
        a = _along(across, dual_s).min(axis=1) - across_error * slack_s
        b = _along(along, dual_t).min(axis=1) - along_error * slack_t
        c = np.abs(_along(across, dual_t)).max(axis=1) + across_error * slack_t
        d = np.abs(_along(along, dual_s)).max(axis=1) + along_error * slack_s
    proved: Mask = (a > 0.0) & (b > 0.0) & (a * b > 1.0001 * c * d)
    return proved


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


def _search(volume: BSplineVolume, pieces: _Pieces, pairs: Pairs) -> Meeting | None:
    """A common point of two pieces that do not touch in the cube, by Newton's method from the middle of some pairs."""
    some = pairs[:: 1 + len(pairs) // _MOST_PAIRS[0]]
    touching, _ = _contact(pieces, some[:, 0], some[:, 1])
    open_pairs = some[~touching]
    if not len(open_pairs):
        return None
    chosen = open_pairs[np.unique(np.linspace(0, len(open_pairs) - 1, _TRIED).astype(np.int64))]
    rows = np.arange(len(chosen))[:, None]
    tangents = [_TANGENTS[pieces.axes[part]] for part in chosen.T]
    where = [_middles(volume, pieces, part) for part in chosen.T]  # two (k, 3)
    for _ in range(_NEWTON_STEPS):
        gap = volume(where[0]) - volume(where[1])
        slopes = _slopes(volume, where, tangents)
        step = np.einsum("kab,kb->ka", np.linalg.pinv(slopes, rcond=1e-9), gap)  # (k, 4)
        for side in range(2):
            where[side][rows, tangents[side]] -= step[:, 2 * side : 2 * side + 2]
            np.clip(where[side], 0.0, 1.0, out=where[side])
    gap = np.linalg.norm(volume(where[0]) - volume(where[1]), axis=1)
    singular = np.linalg.svd(_slopes(volume, where, tangents), compute_uv=False)
    size = float(np.abs(volume.control_points).max())
    met = (gap < 1e-11 * size) & (singular[:, 2] > 1e-4 * singular[:, 0])  # the surfaces cross, they do not just touch
    met &= np.abs(where[0] - where[1]).max(axis=1) > 1e-6
    if not met.any():
        return None
    best = int(np.flatnonzero(met)[0])
    first, second = (_as_point(side[best]) for side in where)
    return Meeting((first, second), _as_point(volume(where[0][best])[0]))


def _slopes(volume: BSplineVolume, where: list[Array], tangents: list[NDArray[np.int64]]) -> Array:
    """Derivative (k, 3, 4) of F(p) - F(q) in the two free parameters of each."""
    parts = [
        np.take_along_axis(volume.jacobian(points), axes[:, None, :], axis=2)
        for points, axes in zip(where, tangents, strict=True)
    ]
    return np.concatenate([parts[0], -parts[1]], axis=2)


def _middles(volume: BSplineVolume, pieces: _Pieces, rows: NDArray[np.int64]) -> Array:
    """Parameters (k, 3) of the middle of pieces."""
    middle = (pieces.low[rows] + pieces.high[rows]) / 2.0 ** (pieces.depth + 1)
    breaks = [breakpoints(knots) for knots in volume.knots]
    return np.stack([np.interp(middle[:, a], np.arange(len(breaks[a])), breaks[a]) for a in range(3)], axis=1)


def _as_point(row: Array) -> Point:
    x, y, z = row.tolist()
    return x, y, z
