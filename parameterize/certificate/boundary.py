"""Is the outer boundary of a body injective: do faces meet nowhere but where they are joined?

With det J of one sign on every patch, opposite sides at every interface and an injective boundary the whole map is
one-to-one (docs/certificate.md). The faces that are not glued are cut into Bezier pieces, and every pair of pieces is
settled by a proof (patch_proofs.py), or cut in four and looked at again. Where nothing is proved, two parameters of one
point are searched for.
"""

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numba
import numpy as np

from ..arrays import Array, IntArray, in_brackets
from ..cube.cube import VARYING_AXES
from ..spline.body import Body, BodyLike, all_control_points, as_body, parted
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume
from .patch_proofs import Pieces, as_rows, boundary_pieces, contact, halved, is_proved
from .shells import overlap

Point = tuple[float, float, float]

_MOST_PAIRS = 50_000, 10  # pairs in all, and further ones for each piece: for more no proof is tried
_TRIED = 64  # pairs at a level, from each of which a common point is searched for
_NEWTON_STEPS = 12
_DISTINCT = 1e3  # times their errors the two parameters of a meeting must differ


@dataclass(frozen=True)
class Meeting:
    """Two parameters on outer faces that the map takes to one point, in the user's units.

    patches: the numbers of the patches that they belong to; None where the body is one patch.
    """

    parameters: tuple[Point, Point]
    point: Point
    patches: tuple[int, int] | None = None

    def __str__(self) -> str:
        first, second, place = map(in_brackets, (*self.parameters, self.point))
        p, q = (f"p{k} " for k in self.patches) if self.patches else ("", "")
        return f"meets itself at {place}, parameters {p}{first} and {q}{second}"


@dataclass(frozen=True)
class BoundaryCheck:
    """Whether a boundary is injective, and a point where it is not.

    injective: True where proved, False where a `meeting` or an `overlap` was found (up to rounding), None where neither
    succeeded.
    undecided: the number of pairs of pieces left without a proof; undecided_patches: the patches that they belong to.
    overlap: whether the body encloses a place twice although its boundary meets nowhere, such as a body inside another
    one; None where that is not known, or the boundary not proved to meet nowhere.
    """

    injective: bool | None
    meeting: Meeting | None
    undecided: int
    overlap: bool | None = None
    undecided_patches: tuple[int, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return entries of the section `parameterization` of report.json."""
        meeting = self.meeting
        place = meeting and {"parameters": [list(row) for row in meeting.parameters], "point": list(meeting.point)}
        if place and meeting and meeting.patches:
            place["patches"] = list(meeting.patches)
        return {"boundary_injective": self.injective, "boundary_meeting": place}


def check_boundary(body: BodyLike, *, max_depth: int = 24) -> BoundaryCheck:
    """Decide whether the map is injective on the outer boundary, where points that interfaces make one are one.

    A volume is a body of one patch. Pieces are cut at most `max_depth` times in four. Of several shells, the outer
    boundary's connected parts, those that face outward are also found not to enclose each other.
    Raises ValueError for a negative depth and for a body without a face that is not glued.
    """
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    body = as_body(body)
    local = _local(body)
    rest = settle(_Patches(local), boundary_pieces(local), _rounding(local, max_depth), max_depth)
    if rest.met is not None:
        return BoundaryCheck(False, _meeting(body, *rest.met), len(rest.pairs))
    if len(rest.pairs):
        left = np.unique(rest.pieces.patches[rest.pairs]).tolist()
        return BoundaryCheck(None, None, len(rest.pairs), undecided_patches=tuple(left))
    found = overlap(local)
    return BoundaryCheck(None if found is None else not found, None, 0, found)


class SearchedFaces(Protocol):
    """The faces that pieces are parts of, as a search for a common point needs them: by number, with parameters."""

    def points(self, faces: IntArray, where: Array) -> Array:
        """Return points (k, 3) at parameters (k, 3) of faces (k,)."""

    def jacobian(self, faces: IntArray, where: Array) -> Array:
        """Return the derivatives (k, 3, 3) there, the last index that of the parameter."""

    def middles(self, pieces: Pieces, rows: IntArray) -> Array:
        """Return the parameters (k, 3) of the middle of pieces."""

    def distance(self, faces: list[IntArray], where: list[Array]) -> Array:
        """Return a lower bound (k,) of the distance of two parameters of each pair of faces; at most 1."""


@dataclass(frozen=True, eq=False)
class Rest:
    """What is left of all pairs of pieces: pairs (k, 2) without a proof, and two parameters of a common point.

    met: the numbers (2,) of the faces and a parameter (3,) of each; None where no common point was found.
    """

    pieces: Pieces
    pairs: IntArray
    met: tuple[IntArray, tuple[Array, Array]] | None = None


def settle(surface: SearchedFaces, pieces: Pieces, error: float, max_depth: int) -> Rest:
    """Prove that pieces meet only where they are joined, cutting them at most `max_depth` times in four.

    error: a bound of the rounding error of a control point's coordinate.
    """
    own = np.repeat(np.arange(len(pieces.nets))[:, None], 2, axis=1)
    points = as_rows(pieces.nets)
    pairs = np.concatenate([own, overlapping_boxes(points.min(axis=1) - error, points.max(axis=1) + error)])
    most = _MOST_PAIRS[0] + _MOST_PAIRS[1] * len(own)
    for depth in range(max_depth + 1):
        hopeless = len(pairs) > most  # only a common point is searched for then
        pairs = pairs if hopeless else pairs[~is_proved(pieces, pairs, error)]
        if not len(pairs):
            break
        met = _search(surface, pieces, pairs, error)
        if met is not None or hopeless or depth == max_depth:
            return Rest(pieces, pairs, met)
        pieces, pairs = halved(pieces, pairs)
    return Rest(pieces, pairs)


def _local(body: Body) -> Body:
    """Return the body with its middle moved to the origin, and scaled by a power of two to magnitude 1.

    Each coordinate is rounded once, relative to its difference from the middle, however far away the middle is.
    """
    points = all_control_points(body)
    moved = points - (points.min(axis=0) + points.max(axis=0)) / 2.0
    exponent = int(np.frexp(np.abs(moved).max())[1])
    nets = parted(np.ldexp(moved, -exponent), [patch.shape for patch in body])
    patches = (replace(patch, control_points=net) for patch, net in zip(body, nets, strict=True))
    return Body(tuple(patches), body.interfaces)


def _rounding(local: Body, max_depth: int) -> float:
    """Return a bound of the rounding error of a Bezier control point's coordinate.

    No weight is negative and all sum to 1, so that each rounding changes a sum by at most the unit roundoff times the
    largest coordinate: 6 p + 2 a direction for the extraction (bernstein.py), 2 p + 2 for the elevation, p + 1 a
    halving, and 1 for the move to the origin. All that underflows is below 2**-1000, and the largest coordinate at
    least 1/2.

    Homogeneous components begin with one rounding more, and their quotient has the errors of both, and one more. The
    vectors that bound the derivatives of a rational piece, products with weights of at most 1, are off by 10 times as
    much where a difference is off by 2: five times the bound leaves them the room that differences have.
    """
    degree = max(max(group.degrees) for group in local.groups)
    roundings = 2 * (8 * degree + 4 + max_depth * (degree + 1)) + 8 + 1
    if any(group.weights is not None for group in local.groups):
        roundings = 5 * (2 * (roundings + 1) + 1)
    return 1.01 * roundings * 2.0**-53 * max(float(np.abs(group.control_points).max()) for group in local.groups)


def _meeting(body: Body, patches: IntArray, where: tuple[Array, Array]) -> Meeting:
    """Return the meeting of two parameters, (3,) each, of patches (2,)."""
    p, q = (tuple(row.tolist()) for row in where)
    point = tuple(body.patches[patches[0]](where[0])[0].tolist())
    return Meeting((p, q), point, (int(patches[0]), int(patches[1])) if len(body) > 1 else None)


def _search(
    surface: SearchedFaces, pieces: Pieces, pairs: IntArray, error: float
) -> tuple[IntArray, tuple[Array, Array]] | None:
    """Return two parameters of a common point of pieces that do not touch, and the numbers (2,) of their faces.

    Newton's method starts from the middle of some pairs. Beside an edge of a face it tends to two equal parameters:
    so the gap must be rounding, and the parameters farther apart than their errors, gap / (least slope), can explain.
    """
    some = pairs[:: 1 + len(pairs) // _MOST_PAIRS[0]]
    open_pairs = some[contact(pieces, some[:, 0], some[:, 1]) < 0]
    if not len(open_pairs):
        return None
    chosen = open_pairs[np.unique(np.linspace(0, len(open_pairs) - 1, _TRIED).astype(np.int64))]
    rows = np.arange(len(chosen))[:, None]
    tangents = [VARYING_AXES[pieces.axes[part]] for part in chosen.T]
    faces = [pieces.patches[part] for part in chosen.T]
    where = [surface.middles(pieces, part) for part in chosen.T]  # two (k, 3)
    for _ in range(_NEWTON_STEPS):
        gap = surface.points(faces[0], where[0]) - surface.points(faces[1], where[1])
        slopes = _slopes(surface, faces, where, tangents)
        step = np.einsum("kab,kb->ka", np.linalg.pinv(slopes, rcond=1e-9), gap)  # (k, 4)
        for side in range(2):
            where[side][rows, tangents[side]] -= step[:, 2 * side : 2 * side + 2]
            np.clip(where[side], 0.0, 1.0, out=where[side])
    gap = np.linalg.norm(surface.points(faces[0], where[0]) - surface.points(faces[1], where[1]), axis=1)
    singular = np.linalg.svd(_slopes(surface, faces, where, tangents), compute_uv=False)
    met = (gap < error) & (singular[:, 2] > 1e-4 * singular[:, 0])  # the surfaces cross, they do not just touch
    distance = surface.distance(faces, where)
    met &= (distance > 1e-6) & (distance * singular[:, 2] > _DISTINCT * (gap + error))
    if not met.any():
        return None
    best = int(np.flatnonzero(met)[0])
    return np.array([faces[0][best], faces[1][best]]), (where[0][best], where[1][best])


def _slopes(surface: SearchedFaces, faces: list[IntArray], where: list[Array], tangents: list[IntArray]) -> Array:
    """Return the derivative (k, 3, 4) of F(p) - F(q) in the two free parameters of each."""
    of_p, of_q = (
        np.take_along_axis(surface.jacobian(faces[k], where[k]), tangents[k][:, None], axis=2) for k in range(2)
    )
    return np.concatenate([of_p, -of_q], axis=2)


class _Patches:
    """The outer faces of a body, by the numbers of their patches."""

    def __init__(self, body: Body) -> None:
        self.points, self.jacobian = body.points, body.jacobian
        self._body = body

    def distance(self, patches: list[IntArray], where: list[Array]) -> Array:
        """Return a lower bound (k,) of the distance of two parameters, in one patch or through glued faces."""
        direct = np.where(patches[0] == patches[1], np.abs(where[0] - where[1]).max(axis=1), 1.0)
        count = len(self._body)
        glued = self._body.glued.reshape(count, 3, 2).swapaxes(1, 2)  # faces where a parameter is 0, then 1
        to_glued = (
            np.where(glued[own], np.stack([place, 1.0 - place], axis=1), 1.0).min(axis=(1, 2))
            for own, place in zip(patches, where, strict=True)
        )
        return np.minimum(direct, sum(to_glued))

    def middles(self, pieces: Pieces, rows: IntArray) -> Array:
        """Return the parameters (k, 3) of the middle of pieces."""
        middle = (pieces.low[rows] + pieces.high[rows]) / 2.0 ** (pieces.depth + 1)
        patches = (self._body.patches[number] for number in pieces.patches[rows])
        return np.stack([_parameters(patch, place) for patch, place in zip(patches, middle, strict=True)])


def _parameters(volume: BSplineVolume, place: Array) -> Array:
    """Return the parameters (3,) of a place (3,) that is counted in spans."""
    breaks = map(breakpoints, volume.knots)
    return np.array([np.interp(x, np.arange(len(row)), row) for x, row in zip(place, breaks, strict=True)])


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
