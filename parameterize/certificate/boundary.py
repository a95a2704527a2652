"""Is a volume's boundary injective: do its six faces meet nowhere but where they are joined?

With det J > 0 on the whole cube, an injective boundary makes the whole map one-to-one. The faces are cut into Bezier
patches, and every pair of patches is settled by a proof (patch_proofs.py), or cut in four and looked at again. Where
nothing is proved, two parameters of one point are searched for.
"""

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from ..arrays import Array, IntArray, in_brackets
from ..cube.cube import VARYING_AXES
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume
from .patch_proofs import Pieces, as_rows, boundary_pieces, contact, halved, is_proved

Point = tuple[float, float, float]

_MOST_PAIRS = 50_000, 10  # pairs in all, and further ones for each patch: for more no proof is tried
_TRIED = 64  # pairs at a level, from each of which a common point is searched for
_NEWTON_STEPS = 12
_DISTINCT = 1e3  # times their errors the two parameters of a meeting must differ


@dataclass(frozen=True)
class Meeting:
    """Two parameters on the boundary of the cube that the map takes to one point, in the user's units."""

    parameters: tuple[Point, Point]
    point: Point

    def __str__(self) -> str:
        first, second, place = map(in_brackets, (*self.parameters, self.point))
        return f"meets itself at {place}, parameters {first} and {second}"


@dataclass(frozen=True)
class BoundaryCheck:
    """Whether a boundary is injective, and a point where it is not.

    injective: True where proved, False where `meeting` was found (up to rounding), None where neither succeeded.
    undecided: the number of pairs of patches left without a proof.
    """

    injective: bool | None
    meeting: Meeting | None
    undecided: int

    def as_dict(self) -> dict[str, Any]:
        """Return entries of the section `parameterization` of report.json."""
        meeting = self.meeting
        place = meeting and {"parameters": [list(row) for row in meeting.parameters], "point": list(meeting.point)}
        return {"boundary_injective": self.injective, "boundary_meeting": place}


def check_boundary(volume: BSplineVolume, *, max_depth: int = 24) -> BoundaryCheck:
    """Decide whether F is injective on the boundary of the cube, cutting patches at most `max_depth` times in four.

    Of a rational volume nothing is proved: the differences of its control points do not bound its derivatives.
    """
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    if volume.weights is not None:
        return BoundaryCheck(None, None, len(boundary_pieces(volume).nets))
    local = _local(volume)
    pieces = boundary_pieces(local)
    error = _rounding(local, max_depth)
    own = np.repeat(np.arange(len(pieces.nets))[:, None], 2, axis=1)
    points = as_rows(pieces.nets)
    pairs = np.concatenate([own, overlapping_boxes(points.min(axis=1) - error, points.max(axis=1) + error)])
    most = _MOST_PAIRS[0] + _MOST_PAIRS[1] * len(own)
    for depth in range(max_depth + 1):
        hopeless = len(pairs) > most  # only a common point is searched for then
        pairs = pairs if hopeless else pairs[~is_proved(pieces, pairs, error)]
        if not len(pairs):
            return BoundaryCheck(True, None, 0)
        met = _search(local, pieces, pairs, error)
        if met is not None:
            p, q, point = (tuple(row.tolist()) for row in (*met, volume(met[0])[0]))
            return BoundaryCheck(False, Meeting((p, q), point), len(pairs))
        if hopeless or depth == max_depth:
            break
        pieces, pairs = halved(pieces, pairs)
    return BoundaryCheck(None, None, len(pairs))


def _local(volume: BSplineVolume) -> BSplineVolume:
    """Return the volume with its middle moved to the origin, and scaled by a power of two to magnitude 1.

    Each coordinate is rounded once, relative to its difference from the middle, however far away the middle is.
    """
    points = volume.control_points
    moved = points - (points.min(axis=(0, 1, 2)) + points.max(axis=(0, 1, 2))) / 2.0
    exponent = int(np.frexp(np.abs(moved).max())[1])
    return BSplineVolume(volume.degrees, volume.knots, np.ldexp(moved, -exponent))


def _rounding(local: BSplineVolume, max_depth: int) -> float:
    """Return a bound of the rounding error of a Bezier control point's coordinate.

    No weight is negative and all sum to 1, so that each rounding changes a sum by at most the unit roundoff times the
    largest coordinate: 6 p + 2 a direction for the extraction (bernstein.py), 2 p + 2 for the elevation, p + 1 a
    halving, and 1 for the move to the origin. All that underflows is below 2**-1000, and the largest coordinate at
    least 1/2.
    """
    degree = max(local.degrees)
    roundings = 2 * (8 * degree + 4 + max_depth * (degree + 1)) + 8 + 1
    return 1.01 * roundings * 2.0**-53 * float(np.abs(local.control_points).max())


def _search(local: BSplineVolume, pieces: Pieces, pairs: IntArray, error: float) -> tuple[Array, Array] | None:
    """Return two parameters of a common point of pieces that do not touch in the cube.

    Newton's method starts from the middle of some pairs. Beside an edge of the cube it tends to two equal parameters:
    so the gap must be rounding, and the parameters farther apart than their errors, gap / (least slope), can explain.
    """
    some = pairs[:: 1 + len(pairs) // _MOST_PAIRS[0]]
    touching, _ = contact(pieces, some[:, 0], some[:, 1])
    open_pairs = some[~touching]
    if not len(open_pairs):
        return None
    chosen = open_pairs[np.unique(np.linspace(0, len(open_pairs) - 1, _TRIED).astype(np.int64))]
    rows = np.arange(len(chosen))[:, None]
    tangents = [VARYING_AXES[pieces.axes[part]] for part in chosen.T]
    where = [_middles(local, pieces, part) for part in chosen.T]  # two (k, 3)
    for _ in range(_NEWTON_STEPS):
        gap = local(where[0]) - local(where[1])
        slopes = _slopes(local, where, tangents)
        step = np.einsum("kab,kb->ka", np.linalg.pinv(slopes, rcond=1e-9), gap)  # (k, 4)
        for side in range(2):
            where[side][rows, tangents[side]] -= step[:, 2 * side : 2 * side + 2]
            np.clip(where[side], 0.0, 1.0, out=where[side])
    gap = np.linalg.norm(local(where[0]) - local(where[1]), axis=1)
    singular = np.linalg.svd(_slopes(local, where, tangents), compute_uv=False)
    met = (gap < error) & (singular[:, 2] > 1e-4 * singular[:, 0])  # the surfaces cross, they do not just touch
    distance = np.abs(where[0] - where[1]).max(axis=1)
    met &= (distance > 1e-6) & (distance * singular[:, 2] > _DISTINCT * (gap + error))
    if not met.any():
        return None
    best = int(np.flatnonzero(met)[0])
    return where[0][best], where[1][best]


def _slopes(volume: BSplineVolume, where: list[Array], tangents: list[IntArray]) -> Array:
    """Return the derivative (k, 3, 4) of F(p) - F(q) in the two free parameters of each."""
    of_p, of_q = (np.take_along_axis(volume.jacobian(where[k]), tangents[k][:, None], axis=2) for k in range(2))
    return np.concatenate([of_p, -of_q], axis=2)


def _middles(volume: BSplineVolume, pieces: Pieces, rows: IntArray) -> Array:
    """Return the parameters (k, 3) of the middle of pieces."""
    middle = (pieces.low[rows] + pieces.high[rows]) / 2.0 ** (pieces.depth + 1)
    breaks = [breakpoints(knots) for knots in volume.knots]
    return np.stack([np.interp(middle[:, a], np.arange(len(breaks[a])), breaks[a]) for a in range(3)], axis=1)


def overlapping_boxes(low: Array, high: Array) -> IntArray:
    """Return all pairs (k, 2) of closed boxes low, high (n, 3) that share a point; i != j, each pair once."""
    if len(low) == 0:
        return np.empty((0, 2), dtype=np.int64)
    spread = (high.max(axis=0) - low.min(axis=0)) / np.maximum((high - low).mean(axis=0), np.finfo(np.float64).tiny)
    first = int(spread.argmax())  # the axis along which the boxes are shortest, compared with all of them
    axes = [first, (first + 1) % 3, (first + 2) % 3]
    order = np.argsort(low[:, first], kind="stable")
    sorted_low, sorted_high = (np.ascontiguousarray(side[order][:, axes]) for side in (low, high))
    found = np.empty((_sweep(sorted_low, sorted_high, np.empty((0, 2), dtype=np.int64)), 2), dtype=np.int64)
    _sweep(sorted_low, sorted_high, found)
    return order[found]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _sweep(low: Array, high: Array, out: IntArray) -> int:
    """Write overlapping pairs, `low` sorted by its first column, into `out` as far as it reaches; return how many."""
    count = 0
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, 0] > high[i, 0]:
                break
            apart = low[j, 1] > high[i, 1] or low[i, 1] > high[j, 1] or low[j, 2] > high[i, 2] or low[i, 2] > high[j, 2]
            if not apart:
                if count < len(out):
                    out[count, 0], out[count, 1] = i, j
                count += 1
    return count
