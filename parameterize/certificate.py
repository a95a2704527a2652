"""Certificate: a proof that det J of a trivariate spline is positive on the whole cube, or a point where it is not.

On every span det J is a polynomial of degree 3 p - 1 a direction, and its Bernstein coefficients bound it. All of them
positive: proved. A corner coefficient is a value of det J: not positive there, folded. Else the span is cut into eight
and looked at again. (Johnen, Remacle, Geuzaine, "Geometrical validity of curvilinear finite elements", J. Comput. Phys.
233, 2013, section 3.) "Positive" means above a bound of all rounding errors, derived at `_roundings`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bezier import add_products, binomials, extraction, split
from .bspline import Array, breakpoints
from .volume import BSplineVolume

Indices = NDArray[np.int64]

_UNIT_ROUNDOFF = 2.0**-53
_UNDERFLOW = 1e-280  # what sums of products of numbers below 1 can lose to underflow, with room
_CHUNK = 256  # spans at a time: a few MB, near the cache
_PIECES = 64  # pieces at a time
_TIGHT = 0.5  # a proved bound below this share of the least known value of det J is refined


@dataclass(frozen=True)
class Certificate:
    """What is known about the sign of det J.

    verdict: "certified" (det J > 0 on the whole cube), "folded" (det J < 0 at `witness`), or "undecided".
    lower_bound: proved lower bound of det J over the cube, divided by the magnitude of its mean.
    mean_det: integral of det J over the cube, which is the signed volume, in the volume's own units.
    witness: the parameters of a point where det J is negative; None unless folded.
    unproved: (k, 3) span numbers (i, j, l) on which det J was not proved positive.
    """

    verdict: Literal["certified", "folded", "undecided"]
    lower_bound: float
    mean_det: float
    witness: tuple[float, float, float] | None
    unproved: Indices
    seconds: float


def certify(volume: BSplineVolume, *, max_depth: int = 6) -> Certificate:
    """Decide whether det J > 0 on the whole cube, cutting doubtful spans at most `max_depth` times in eight.

    Raises ValueError for a negative depth, or where derivatives overflow.
    """
    if max_depth < 0:
        raise ValueError(f"max_depth must be non-negative, got {max_depth}")
    start = time.perf_counter()
    form = _DeterminantForm(volume)
    bounds, corners, means = form.survey()
    search = _Search(form, max_depth, float(corners.min()))
    doubtful = np.flatnonzero(~(bounds > search.target))  # span numbers, flat
    for begin in range(0, len(doubtful), _CHUNK):
        search.examine(doubtful[begin : begin + _CHUNK])
    bounds[doubtful] = np.inf
    lowest = min(float(bounds.min()), search.lowest)
    mean = float(np.sum(means * form.span_sizes()))
    failed = np.flatnonzero(search.unproved)
    verdict: Literal["certified", "folded", "undecided"] = "undecided" if failed.size else "certified"
    if search.worst_piece is not None:
        verdict = "folded"
    return Certificate(
        verdict=verdict,
        lower_bound=lowest / abs(mean) if mean != 0.0 else -np.inf,
        mean_det=float(np.ldexp(mean, form.exponent)),
        witness=search.witness(volume),
        unproved=form.numbers(failed),
        seconds=time.perf_counter() - start,
    )


def bernstein_coefficients(volume: BSplineVolume, spans: ArrayLike) -> Array:
    """Bernstein coefficients of det J on the spans (k, 3): (k, d_u, d_v, d_w) with d = 3 * degree a direction."""
    return coefficients_and_errors(volume, spans)[0]


def coefficients_and_errors(volume: BSplineVolume, spans: ArrayLike) -> tuple[Array, Array]:
    """The same, and for every span (k,) a bound of the rounding error in its coefficients."""
    form = _DeterminantForm(volume)
    rows = np.asarray(spans, dtype=np.int64)
    if rows.ndim != 2 or rows.shape[1] != 3 or np.any(rows < 0) or np.any(rows >= np.array(form.n_spans)):
        raise ValueError(f"spans must be numbers of shape (k, 3) below {form.n_spans}")
    values, permanents = form.coefficients(rows)
    return np.ldexp(np.moveaxis(values, -1, 0), form.exponent), np.ldexp(form.errors(permanents), form.exponent)


def _roundings(degrees: tuple[int, int, int]) -> int:
    """How many rounding errors a Bernstein coefficient of det J passes through, at most.

    Write u for the unit roundoff and gamma_n = n u / (1 - n u); a chain of n roundings changes a number by a factor
    within 1 +- gamma_n (Higham, "Accuracy and Stability of Numerical Algorithms", lemma 3.1). Control points and
    knots are taken as exact. Then
    - a control point of a derivative, p (P_1 - P_0) / (t_1 - t_0): 4 roundings;
    - extraction to Bernstein form in a direction of degree q <= p: weights 5 q, binomial 1, product and sum q + 1;
    - a component of F_v x F_w: a sum of at most 2 (p_u + 1) p_v p_w products;
    - its dot product with F_u: a sum of at most 3 p_u (p_v + 1) (p_w + 1) products;
    - division by the three binomials: 6.
    Each coefficient is a sum of products of three derivative control points, with weights that are not negative and,
    over each of the six permutations in the determinant, sum to 1. So the sum of the absolute values of its terms is
    at most perm(A), A[a, b] the largest |component a| among the control points of the b-th derivative near the span,
    and the error is at most gamma_n perm(A).
    """
    u, v, w = degrees
    net = 4 + sum(6 * p + 2 for p in degrees)
    return 3 * net + (2 * (u + 1) * v * w + 1) + (3 * u * (v + 1) * (w + 1) + 1) + 6


def _gamma(n: int) -> float:
    """Higham's gamma_n, with one percent for the rounding errors of the bound itself."""
    return 1.01 * n * _UNIT_ROUNDOFF / (1.0 - n * _UNIT_ROUNDOFF)


class _DeterminantForm:
    """det J of a volume, ready to be written in Bernstein form on any of its spans.

    Derivatives are scaled by powers of two to magnitude 1, which is exact: true det J = 2**exponent * computed.
    """

    def __init__(self, volume: BSplineVolume) -> None:
        self.degrees = volume.degrees
        self.breaks = [breakpoints(k) for k in volume.knots]
        self.n_spans: tuple[int, ...] = tuple(len(b) - 1 for b in self.breaks)
        self.span_count = int(np.prod(self.n_spans))
        self.roundings = _roundings(volume.degrees)
        points, self.exponent = _to_unit_magnitude(np.moveaxis(volume.control_points, -1, 0))
        self.exponent *= 3
        self.nets: list[Array] = []  # for each derivative: (3, N_0, N_1, N_2)
        self.bases: list[list[tuple[Indices, Array]]] = []  # for each derivative and direction: first, weights
        for b in range(3):
            net, exponent = _to_unit_magnitude(_differences(points, volume.knots[b], self.degrees[b], b))
            self.exponent += exponent
            self.nets.append(net)
            self.bases.append([_scaled_extraction(volume.knots[a], volume.degrees[a], a == b) for a in range(3)])
        weights = [1.0 / binomials(3 * p - 1) for p in self.degrees]
        self.unscale = np.einsum("i,j,k->ijk", *weights)[..., None]  # (d_u, d_v, d_w, 1)

    def numbers(self, flat: Indices) -> Indices:
        """Flat span numbers (k,) as rows (i, j, l): (k, 3)."""
        return np.stack(np.unravel_index(flat, self.n_spans), axis=-1).astype(np.int64)

    def span_sizes(self) -> Array:
        """Parametric volume of every span, (n_spans in all,)."""
        u, v, w = (np.diff(b) for b in self.breaks)
        sizes: Array = np.einsum("i,j,k->ijk", u, v, w).ravel()
        return sizes

    def survey(self) -> tuple[Array, Array, Array]:
        """For all spans: lower bound of det J, least value at the 8 corners, mean; (n_spans in all,) each."""
        total = self.span_count
        bounds, corners, means = np.empty(total), np.empty(total), np.empty(total)
        for start in range(0, total, _CHUNK):
            chunk = np.arange(start, min(start + _CHUNK, total))
            values, permanents = self.coefficients(self.numbers(chunk))
            bounds[chunk] = values.min(axis=(0, 1, 2)) - self.errors(permanents)
            corners[chunk] = _corners(values).min(axis=(0, 1, 2))
            means[chunk] = values.mean(axis=(0, 1, 2))
        return bounds, corners, means

    def coefficients(self, spans: Indices) -> tuple[Array, Array]:
        """Bernstein coefficients on spans (k, 3): (d_u, d_v, d_w, k); and the permanents (k,) that bound them."""
        local, sizes = zip(*(self._derivative(b, spans) for b in range(3)), strict=True)
        f_u, f_v, f_w = local  # (3, n_0, n_1, n_2, k) each, scaled Bernstein form
        k = len(spans)
        u, v, w = self.degrees
        cross = np.zeros((3, 2 * u + 1, 2 * v, 2 * w, k))
        determinant = np.zeros((3 * u, 3 * v, 3 * w, k))
        for a in range(3):
            a1, a2 = (a + 1) % 3, (a + 2) % 3
            add_products(f_v[a1], f_w[a2], 1.0, cross[a])
            add_products(f_v[a2], f_w[a1], -1.0, cross[a])
            add_products(f_u[a], cross[a], 1.0, determinant)
        determinant *= self.unscale
        return determinant, _permanent(np.stack(sizes, axis=1))

    def errors(self, permanents: Array, depth: int = 0) -> Array:
        """Bound of the rounding error in the coefficients, `depth` halvings included: (k,).

        A halving is one product with weights that sum to 1 a direction: as many roundings as it has terms.
        """
        return _gamma(self.roundings + depth * sum(3 * p for p in self.degrees)) * permanents + _UNDERFLOW

    def _derivative(self, b: int, spans: Indices) -> tuple[Array, Array]:
        """The b-th derivative on spans (k, 3): scaled Bernstein form (3, n_0, n_1, n_2, k), magnitudes (3, k)."""
        (first_u, to_u), (first_v, to_v), (first_w, to_w) = self.bases[b]
        row, column, layer = spans.T
        rows = (first_u[row] + np.arange(to_u.shape[1])[:, None])[:, None, None]  # (n_0, 1, 1, k)
        columns = (first_v[column] + np.arange(to_v.shape[1])[:, None])[None, :, None]
        layers = (first_w[layer] + np.arange(to_w.shape[1])[:, None])[None, None]
        net = self.nets[b][:, rows, columns, layers]  # (3, n_0, n_1, n_2, k)
        magnitudes = np.abs(net).max(axis=(1, 2, 3))
        net = np.einsum("xik,cijlk->cxjlk", np.ascontiguousarray(np.moveaxis(to_u[row], 0, -1)), net)
        net = np.einsum("yjk,cxjlk->cxylk", np.ascontiguousarray(np.moveaxis(to_v[column], 0, -1)), net)
        net = np.einsum("zlk,cxylk->cxyzk", np.ascontiguousarray(np.moveaxis(to_w[layer], 0, -1)), net)
        return net, magnitudes


def _corners(values: Array, first: int = 0) -> Array:
    """Those coefficients that are values at corners, (..., 2, 2, 2, ...); directions: three axes from `first` on."""
    steps = (slice(None, None, n - 1) for n in values.shape[first : first + 3])
    picked: Array = values[(slice(None),) * first + tuple(steps)]
    return picked


def _to_unit_magnitude(values: Array) -> tuple[Array, int]:
    """Values / 2**e with the largest magnitude in [1/2, 1), and e; exact."""
    largest = float(np.abs(values).max())
    if not np.isfinite(largest):
        raise ValueError("the derivatives of the volume overflow; scale its control points or widen its knot spans")
    exponent = int(np.frexp(largest)[1])
    return np.ldexp(values, -exponent), exponent


def _differences(points: Array, knots: Array, degree: int, axis: int) -> Array:
    """Control points (3, ...) of the derivative along a parametric axis (The NURBS Book, eq. 3.7)."""
    n = points.shape[axis + 1]
    width = knots[degree + 1 : degree + n] - knots[1:n]
    shape = [1, 1, 1, 1]
    shape[axis + 1] = n - 1
    with np.errstate(over="ignore"):
        net: Array = np.diff(points, axis=axis + 1) * (degree / width).reshape(shape)
    return net


def _scaled_extraction(knots: Array, degree: int, derivative: bool) -> tuple[Indices, Array]:
    """Extraction to scaled Bernstein form for the basis, or for the basis of its derivative."""
    lowered = int(derivative)
    first, weights = extraction(knots[lowered : len(knots) - lowered], degree - lowered)
    return first, weights * binomials(degree - lowered)[:, None]


def _permanent(sizes: Array) -> Array:
    """Permanents of matrices (3, 3, k): (k,)."""
    (a, b, c), (d, e, f), (g, h, i) = sizes
    permanents: Array = a * (e * i + f * h) + b * (d * i + f * g) + c * (d * h + e * g)
    return permanents


@dataclass(frozen=True)
class _Pieces:
    """Parts of spans, all cut equally often: their edges are 2**-depth of their spans' edges."""

    depth: int
    spans: Indices  # (k,) flat span numbers
    origins: Indices  # (k, 3) place inside the span, in edges of the piece
    values: Array  # (k, d_u, d_v, d_w)
    permanents: Array  # (k,)

    def subset(self, rows: NDArray[np.bool_] | slice) -> _Pieces:
        """The pieces that a mask or a slice picks."""
        return _Pieces(self.depth, self.spans[rows], self.origins[rows], self.values[rows], self.permanents[rows])

    def halved(self) -> _Pieces:
        """Each piece as eight."""
        values = split(self.values)
        origins = 2 * self.origins[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T  # (k, 8, 3)
        return _Pieces(
            self.depth + 1,
            np.repeat(self.spans, 8),
            origins.reshape(-1, 3),
            values.reshape(-1, *values.shape[4:]),
            np.repeat(self.permanents, 8),
        )


class _Search:
    """Depth-first subdivision of doubtful spans, each until it is proved, or folded, or a part of it is given up.

    Depth-first bounds the memory, at most 9 * _PIECES pieces a level, and the time that a hopeless span takes.
    """

    def __init__(self, form: _DeterminantForm, max_depth: int, known: float) -> None:
        self.form = form
        self.max_depth = max_depth
        self.known = known  # least value of det J seen
        self.lowest = np.inf  # least bound of det J over the pieces done with
        self.unproved = np.zeros(form.span_count, dtype=bool)
        self.closed = np.zeros(form.span_count, dtype=bool)  # folded or given up: not to be looked at further
        self.deepest = 0.0  # det J at the worst fold
        self.worst_piece: tuple[int, int, Indices, Indices] | None = None  # depth, span, origin (3,), corner (3,)

    def examine(self, spans: Indices) -> None:
        """Look at whole spans (k,), flat numbers, until each is proved, folded or given up."""
        values, permanents = self.form.coefficients(self.form.numbers(spans))
        whole = np.ascontiguousarray(np.moveaxis(values, -1, 0))
        stack = [_Pieces(0, spans, np.zeros((len(spans), 3), dtype=np.int64), whole, permanents)]
        while stack:
            top = stack.pop()
            if len(top.spans) > _PIECES:
                stack.append(top.subset(slice(_PIECES, None)))
                top = top.subset(slice(_PIECES))
            doubtful = self._settle(top)
            if len(doubtful.spans):
                stack.append(doubtful.halved())

    @property
    def target(self) -> float:
        """A bound of det J above this is good enough."""
        return max(0.0, _TIGHT * self.known)

    def _settle(self, pieces: _Pieces) -> _Pieces:
        """Draw the conclusions that can be drawn; return the pieces to be cut."""
        errors = self.form.errors(pieces.permanents, pieces.depth)
        least = pieces.values.min(axis=(1, 2, 3))
        bounds = least - errors
        corners = _corners(pieces.values, first=1).reshape(-1, 8)
        lowest_corner = corners.min(axis=1)
        self.known = min(self.known, float(lowest_corner.min()))
        self._record_folds(pieces, corners, lowest_corner < -errors)
        if pieces.depth == self.max_depth:
            self.closed[pieces.spans[~(bounds > 0.0)]] = True
        hopeless = (lowest_corner <= errors) & (least >= -errors)  # det J is 0 at a corner, and no fold can show
        done = (bounds > self.target) | hopeless | self.closed[pieces.spans] | (pieces.depth == self.max_depth)
        self.unproved[pieces.spans[done & ~(bounds > 0.0)]] = True
        self.lowest = min(self.lowest, float(bounds[done].min(initial=np.inf)))
        return pieces.subset(~done)

    def _record_folds(self, pieces: _Pieces, corners: Array, folded: NDArray[np.bool_]) -> None:
        self.closed[pieces.spans[folded]] = True
        row, corner = np.unravel_index(int(corners.argmin()), corners.shape)
        if folded[row] and corners[row, corner] < self.deepest:
            self.deepest = float(corners[row, corner])
            place = np.array(np.unravel_index(int(corner), (2, 2, 2)), dtype=np.int64)
            self.worst_piece = (pieces.depth, int(pieces.spans[row]), pieces.origins[row], place)

    def witness(self, volume: BSplineVolume) -> tuple[float, float, float] | None:
        """Parameters of the worst fold found.

        Derivatives may jump between spans, and parameters are rounded: where det J as evaluated there is positive, a
        point a little inside the piece, where det J is negative by continuity, is returned.
        """
        if self.worst_piece is None:
            return None
        depth, span, origin, place = self.worst_piece
        number = self.form.numbers(np.array([span]))[0]
        edges = np.array([b[[i, i + 1]] for b, i in zip(self.form.breaks, number, strict=True)])  # (3, 2)
        for inward in (0.0, 1e-12, 1e-9, 1e-6, 1e-3):
            local = (origin + place + inward * (0.5 - place)) / 2.0**depth
            point = (1.0 - local) * edges[:, 0] + local * edges[:, 1]
            if np.linalg.det(volume.jacobian(point)[0]) <= 0.0:
                break
        u, v, w = point.tolist()
        return u, v, w
