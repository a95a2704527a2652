"""PatchCertificate: a proof that det J of a spline is positive on the whole cube, or a point where it is not.

For a left-handed volume, whose det J is negative on the whole, -det J > 0 is examined.

The Bernstein coefficients of det J bound it on every span, those at its corners are values (docs/method.md, section 6;
Johnen, Remacle, Geuzaine, "Geometrical validity of curvilinear finite elements", J. Comput. Phys. 233, 2013, section
3). Of a rational volume det J times a positive polynomial takes its place (rational_determinant.py). "Positive" and
"negative" mean by more than a bound of all rounding errors (determinant.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..spline.bernstein import split
from ..spline.orientation import enclosed_volumes
from ..spline.patch_groups import PatchGroup
from ..spline.volume import BSplineVolume
from .column_ranges import bounds_by_ranges
from .determinant import CHUNK, DeterminantForm, corners_of
from .rational_determinant import RationalDeterminantForm

Verdict = Literal["certified", "folded", "undecided"]
Parameters = tuple[float, float, float]  # of a point of the cube
CLAIMS = {"right-handed": "det J > 0", "left-handed": "det J < 0"}

_NONE: IntArray = np.empty((0, 3), dtype=np.int64)
_PATCHES = 4096  # patches at a time: a bound of the memory
_PIECES = 64  # pieces at a time
_NEARLY = 1.0 - 1e-6  # a bound above this share of the least known value need not be closer: rounding parts them
_TIGHT = 0.5  # a proved bound below this share of the least known value of det J is refined


@dataclass(frozen=True)
class PatchCertificate:
    """The sign of det J on the whole cube of one patch, as far as it is known.

    Attributes
    ----------
    verdict : str
        "certified" (det J > 0 on the whole cube), "folded" (det J < 0 at `witness`), or "undecided". Of a left-handed
        volume -det J takes the place of det J.
    lower_bound : float
        Proved lower bound of det J over the cube, divided by the magnitude of its mean. Of a rational volume that of
        det J W^4, W the sum w_i N_i over the largest weight: a lower one where it is positive.
    mean_det : float
        Integral of det J over the cube, which is the signed volume, in the volume's own units; negative if left-handed.
    witness : three float or None
        The parameters of a point where det J has the wrong sign; None unless folded.
    unproved : (k, 3) array of int
        Span numbers (i, j, l) on which the sign of det J was not proved.
    flat : three float or None
        Of an undecided volume the parameters of a point where det J is zero, up to rounding, such as one where control
        points coincide; None where no such point was met.
    left_handed : bool
        Whether det J is negative on the whole: u, v, w are a left-handed system.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> iga_nn.certify(benchmark_volume(4, amplitude=0.4)).patches[0].verdict
    'folded'
    """

    verdict: Verdict
    lower_bound: float
    mean_det: float
    witness: Parameters | None
    unproved: IntArray
    left_handed: bool = False
    flat: Parameters | None = None

    @property
    def orientation(self) -> str:
        """Return "right-handed" or "left-handed": that of u, v, w in space."""
        return "left-handed" if self.left_handed else "right-handed"

    @property
    def claim(self) -> str:
        """Return the claim that the verdict decides: "det J > 0", or "det J < 0" for a left-handed volume."""
        return CLAIMS[self.orientation]


def certify_patches(patches: Sequence[BSplineVolume], group: PatchGroup, max_depth: int) -> list[PatchCertificate]:
    """Decide whether det J has one sign on the whole cube of each patch of a group, in its order.

    patches: of the body that the group belongs to. Doubtful spans are cut in eight, at most `max_depth` times.
    Raises ValueError where derivatives overflow.
    """
    found = []
    for part in group.divided(_PATCHES):
        found += _certified(part, [patches[number] for number in part.numbers], max_depth)
    return found


def _certified(group: PatchGroup, patches: Sequence[BSplineVolume], max_depth: int) -> list[PatchCertificate]:
    """Return the certificates of the patches of a group, (k,) as given."""
    form = DeterminantForm(group) if group.weights is None else RationalDeterminantForm(group)
    bounds, known, mean = _surveyed(form, group)
    left = mean < 0.0
    size = np.ldexp(mean, form.exponents)
    with np.errstate(divide="ignore", invalid="ignore"):
        lowest = bounds.min(axis=1) / np.abs(mean)
    columns = zip(lowest.tolist(), size.tolist(), left.tolist(), strict=True)
    found = [PatchCertificate("certified", low, volume, None, _NONE, turned) for low, volume, turned in columns]
    doubtful = ~(bounds > np.maximum(0.0, _TIGHT * known)[:, None])
    for row in np.flatnonzero(doubtful.any(axis=1)).tolist():
        search = _Search(form, row, float(mean[row]), max_depth, float(known[row]))
        found[row] = _searched(search, patches[row], bounds[row], doubtful[row], found[row])
    return found


def _surveyed(form: DeterminantForm, group: PatchGroup) -> tuple[Array, Array, Array]:
    """Return lower bounds (k, spans), the least known values (k,) and the means (k,) of det J, in the form's scale.

    Of a left-handed patch the bounds and the values are those of -det J. Where most spans have a bound by the ranges of
    J's columns, Bernstein coefficients are computed for those spans alone whose bound is below the least known value.
    """
    by_ranges = np.zeros((len(group), form.span_count))
    if group.weights is None and form.span_count > CHUNK:
        by_ranges = bounds_by_ranges(group, form.nets)
    if 2 * np.abs(np.sign(by_ranges).sum(axis=1)).min() < form.span_count:
        both_bounds, both_corners, means = form.survey()
        mean = (means * form.span_sizes()).sum(axis=1)
        side, rows = (mean < 0.0).astype(np.int64), np.arange(len(group))
        return both_bounds[side, rows], both_corners[side, rows].min(axis=1), mean
    mean = _means(form, group)
    bounds = np.where(mean < 0.0, -1.0, 1.0)[:, None] * by_ranges
    known, left = np.full(len(group), np.inf), np.repeat(mean < 0.0, form.span_count).astype(np.int64)
    open_, done = bounds <= np.sort(bounds, axis=1)[:, CHUNK - 1 : CHUNK], np.zeros_like(bounds, dtype=bool)
    while open_.any():
        spans = np.flatnonzero(open_)
        both_bounds, both_corners, _ = form.survey_of(spans)
        chosen = left[spans], np.arange(len(spans))
        bounds.ravel()[spans] = both_bounds[chosen]
        np.minimum.at(known, spans // form.span_count, both_corners[chosen])
        done |= open_
        open_ = ~done & (bounds <= np.maximum(0.0, _NEARLY * known)[:, None])
    return bounds, known, mean


def _means(form: DeterminantForm, group: PatchGroup) -> Array:
    """Return the means of det J over polynomial patches (k,), in the form's scale."""
    points = group.control_points
    middles = (points.min(axis=(1, 2, 3)) + points.max(axis=(1, 2, 3))) / 2.0
    near = replace(group, control_points=points - middles[:, None, None, None])
    return np.ldexp(enclosed_volumes(near, np.zeros(3)), -form.exponents)


def _searched(
    search: "_Search", volume: BSplineVolume, bounds: Array, doubtful: Mask, at_first: PatchCertificate
) -> PatchCertificate:
    """Return the certificate of a patch with doubtful spans (spans,), each examined by a search.

    bounds: (spans,) lower bounds of the whole spans. at_first: what these alone say.
    """
    numbers = np.flatnonzero(doubtful)
    for begin in range(0, len(numbers), CHUNK):
        search.examine(numbers[begin : begin + CHUNK])
    lowest = min(float(bounds[~doubtful].min(initial=np.inf)), search.lowest)
    verdict: Verdict = "undecided" if search.unproved.any() else "certified"
    if search.worst_piece is not None:
        verdict = "folded"
    return replace(
        at_first,
        verdict=verdict,
        lower_bound=lowest / abs(search.mean) if search.mean != 0.0 else -np.inf,
        witness=search.witness(volume),
        unproved=search.rows(np.flatnonzero(search.unproved))[:, 1:],
        flat=search.parameters(search.flat_piece) if search.flat_piece and verdict == "undecided" else None,
    )


@dataclass(frozen=True)
class _Pieces:
    """Parts of spans, all cut equally often: their edges are 2**-depth of their spans' edges."""

    depth: int
    spans: IntArray  # (k,) flat span numbers
    origins: IntArray  # (k, 3) place inside the span, in edges of the piece
    values: Array  # (k, d_u, d_v, d_w)
    permanents: Array  # (k,)

    def subset(self, rows: Mask | slice) -> "_Pieces":
        """Return the pieces that a mask or a slice picks."""
        return _Pieces(self.depth, self.spans[rows], self.origins[rows], self.values[rows], self.permanents[rows])

    def halved(self) -> "_Pieces":
        """Return each piece as eight."""
        values = split(self.values)
        origins = 2 * self.origins[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T  # (k, 8, 3)
        return _Pieces(
            self.depth + 1,
            np.repeat(self.spans, 8),
            origins.reshape(-1, 3),
            values.reshape(-1, *values.shape[4:]),
            np.repeat(self.permanents, 8),
        )


_Corner = tuple[int, int, IntArray, IntArray]  # a piece's depth, span and origin (3,), and the corner (3,)


class _Search:
    """Depth-first subdivision of doubtful spans, each until it is proved, or folded, or a part of it is given up.

    The order, depth first, bounds the memory, at most 9 * _PIECES pieces a level, and the time that a hopeless span
    takes.
    """

    def __init__(self, form: DeterminantForm, patch: int, mean: float, max_depth: int, known: float) -> None:
        self.form = form
        self.patch = patch  # its place in the form's group
        self.mean = mean  # of det J over the patch
        self.sign = -1.0 if mean < 0.0 else 1.0  # of a left-handed patch -det J takes the place of det J
        self.max_depth = max_depth
        self.known = known  # least value of det J seen
        self.lowest = np.inf  # least bound of det J over the finished pieces
        self.unproved = np.zeros(form.span_count, dtype=bool)
        self.closed = np.zeros(form.span_count, dtype=bool)  # folded or given up: not examined further
        self.deepest = 0.0  # det J at the worst fold
        self.worst_piece: _Corner | None = None
        self.flat_piece: _Corner | None = None  # where det J is zero up to rounding

    def examine(self, spans: IntArray) -> None:
        """Examine whole spans (k,), flat numbers, until each is proved, folded or given up."""
        values, permanents = self.form.coefficients(self.rows(spans))
        whole = self.sign * np.ascontiguousarray(np.moveaxis(values, -1, 0))
        stack = [_Pieces(0, spans, np.zeros((len(spans), 3), dtype=np.int64), whole, permanents)]
        while stack:
            top = stack.pop()
            if len(top.spans) > _PIECES:
                stack.append(top.subset(slice(_PIECES, None)))
                top = top.subset(slice(_PIECES))
            doubtful = self._conclude(top)
            if len(doubtful.spans):
                stack.append(doubtful.halved())

    def rows(self, spans: IntArray) -> IntArray:
        """Return flat numbers (k,) of spans of the patch as rows (patch, i, j, l): (k, 4)."""
        return self.form.numbers(self.patch * self.form.span_count + spans)

    @property
    def target(self) -> float:
        """Return the bound of det J above which a proof is tight enough."""
        return max(0.0, _TIGHT * self.known)

    def _conclude(self, pieces: _Pieces) -> _Pieces:
        """Record which pieces are proved, folded or given up; return the doubtful ones, which are cut next."""
        errors = self.form.errors(pieces.permanents, pieces.depth)
        least = pieces.values.min(axis=(1, 2, 3))
        bounds = least - errors
        corners = corners_of(pieces.values, first=1).reshape(-1, 8)
        lowest_corner = corners.min(axis=1)
        self.known = min(self.known, float(lowest_corner.min()))
        self._record_folds(pieces, corners, lowest_corner < -errors)
        if pieces.depth == self.max_depth:
            self.closed[pieces.spans[~(bounds > 0.0)]] = True
        hopeless = (lowest_corner <= errors) & (least >= -errors)  # det J is 0 at a corner, and no fold can show
        if self.flat_piece is None and hopeless.any():
            row = int(np.flatnonzero(hopeless)[0])
            self.flat_piece = _corner(pieces, row, int(corners[row].argmin()))
        done = (bounds > self.target) | hopeless | self.closed[pieces.spans] | (pieces.depth == self.max_depth)
        self.unproved[pieces.spans[done & ~(bounds > 0.0)]] = True
        self.lowest = min(self.lowest, float(bounds[done].min(initial=np.inf)))
        return pieces.subset(~done)

    def _record_folds(self, pieces: _Pieces, corners: Array, folded: Mask) -> None:
        self.closed[pieces.spans[folded]] = True
        row, corner = np.unravel_index(int(corners.argmin()), corners.shape)
        if folded[row] and corners[row, corner] < self.deepest:
            self.deepest = float(corners[row, corner])
            self.worst_piece = _corner(pieces, int(row), int(corner))

    def parameters(self, corner: _Corner, inward: float = 0.0) -> Parameters:
        """Return the parameters of a corner of a piece, or of a point a share of the way towards its middle."""
        depth, span, origin, place = corner
        number = self.rows(np.array([span]))[0, 1:]
        edges = np.array([b[[i, i + 1]] for b, i in zip(self.form.breaks, number, strict=True)])  # (3, 2)
        local = (origin + place + inward * (0.5 - place)) / 2.0**depth
        u, v, w = ((1.0 - local) * edges[:, 0] + local * edges[:, 1]).tolist()
        return u, v, w

    def witness(self, volume: BSplineVolume) -> Parameters | None:
        """Return the parameters of the worst fold found.

        Derivatives may jump between spans, and parameters are rounded: where det J as evaluated there is positive, a
        point a little inside the piece, where det J is negative by continuity, is returned.
        """
        if self.worst_piece is None:
            return None
        for inward in (0.0, 1e-12, 1e-9, 1e-6, 1e-3):
            point = self.parameters(self.worst_piece, inward)
            if self.sign * np.linalg.det(volume.jacobian(point)[0]) <= 0.0:
                break
        return point


def _corner(pieces: _Pieces, row: int, corner: int) -> _Corner:
    """Return a corner, numbered 0 to 7, of one of the pieces."""
    place = np.array(np.unravel_index(corner, (2, 2, 2)), dtype=np.int64)
    return pieces.depth, int(pieces.spans[row]), pieces.origins[row], place
