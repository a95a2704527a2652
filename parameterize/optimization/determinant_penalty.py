"""Penalises the Bernstein coefficients of det J over chosen spans, the same numbers that the certificate tests.

A penalty on sampled determinants leaves folds between the samples, above all along the 12 edges of a block: there the
surface is smooth, so the three tangents of an exact fit lie in one plane and det J vanishes. Here the fit gives way: in
the first spans next to an edge F keeps a small crease, as large as the floor on the coefficients demands.

Few coefficients lie below the floor. A coefficient is linear in each of the three derivatives of F, so its own
derivative is computed from the product of the other two: one row of 3 (p + 1)^3 numbers in the span's Bezier points.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from ..arrays import Array, Floats, IntArray, Knots
from ..spline.bernstein import binomials, extraction
from ..spline.bspline import breakpoints
from ..spline.spline_map import ControlNets
from ..threads import in_parallel
from .determinant_rows import add_windows, combined, diagonal_blocks, short_rows, squared
from .operators import PiecewiseOperator, no_blocks
from .spans import numbers, with_neighbours
from .term import Blockwise, RoundWeights

MIN_COEFFICIENT = 0.1  # a Bernstein coefficient of det J below this is penalised on active spans; mean det J is 1
_BLOCK = 32  # spans at a time: their arrays fit into the cache
_EVALUATIONS = 2  # that are kept for the curvature: the last one may be of a guess that was not taken
_MOST_KEPT = 300e6  # bytes of rows that are kept from product to product; those of further spans are made anew


_Windows = tuple[IntArray, Floats]  # first control points (k, 3), and values (k, ...) of the points from each on


@dataclass(frozen=True, eq=False)
class _PenaltySpans:
    """Hold k spans: their first control points (k, 3), parametric volumes (k,), floors (k,), and shares (k,).

    shares: the factors of the squared shortfalls in the energy. weights: (k, 3, p + 1, p + 1), the matrices from
    control points to Bezier points in each direction. back: the transposes of these matrices.
    """

    first: IntArray
    volumes: Array
    floors: Array
    shares: Array
    weights: Array
    back: Array

    def some(self, chosen: IntArray) -> "_PenaltySpans":
        """Return the spans with the numbers `chosen` (m,)."""
        return _PenaltySpans(*(getattr(self, field.name)[chosen] for field in fields(self)))


@dataclass(frozen=True, eq=False)
class _Rows:
    """Hold the r coefficients below the floor, span by span, of the k spans that have such coefficients.

    shortfall: (r,), the floor minus the coefficient. rows: (r, 3, p + 1, p + 1, p + 1), the derivatives of the
    coefficients in the span's Bezier points. shares: (r,), the factors of the squared shortfalls. starts: (k + 1,), the
    first row of each span.
    """

    spans: _PenaltySpans
    shortfall: Array
    shares: Floats
    rows: Floats
    starts: IntArray

    def in_control_points(self) -> "_Rows":
        """Return the derivatives in the control points that act on each span, in single precision.

        They take the place of the derivatives in its Bezier points.
        """
        n = self.rows.shape[2]
        u, v, w = np.moveaxis(self.spans.weights.astype(np.float32), 1, 0)
        across = (u[:, :, None, :, None] * v[:, None, :, None, :]).reshape(-1, n**2, n**2)
        to_bezier = (across[:, :, None, :, None] * w[:, None, :, None, :]).reshape(-1, n**3, n**3)
        single = self.rows.astype(np.float32)
        rows = np.empty_like(single)
        for matrix, begin, end in zip(to_bezier, self.starts, self.starts[1:], strict=False):
            np.matmul(single[begin:end].reshape(-1, n**3), matrix, out=rows[begin:end].reshape(-1, n**3))
        return replace(self, rows=rows, shares=self.shares.astype(np.float32))

    def squared(self, x: Floats) -> _Windows:
        """Return the windows of `in_control_points`: the transposed rows times their shares, times the rows of x."""
        return self.spans.first, squared(x, self.spans.first, self.rows, self.starts, 2.0 * self.shares)


class BlockDeterminants:
    """Compute a block's part of the mean over all spans of weight * (floor - coefficient)_+^2.

    knots: the knots of three directions with the same degree p, in units in which the mean of det J is near 1. count:
    the number of spans of all blocks. floor: in units of det J.
    """

    def __init__(self, knots: Knots, degree: int, count: int, floor: float) -> None:
        self.floor = floor
        self._extractions = [extraction(k, degree) for k in knots]
        self._widths = [np.diff(breakpoints(k)) for k in knots]
        self._whole = whole = binomials(degree)
        lowered = degree * binomials(degree - 1)
        self._scales = tuple(  # from differences of Bezier points to derivatives in scaled Bernstein form
            np.einsum("i,j,k->ijk", *(lowered if d == axis else whole for d in range(3))) for axis in range(3)
        )
        self._unscale = np.einsum("i,j,k->ijk", *(1.0 / binomials(3 * degree - 1),) * 3)
        self._share = 1.0 / (self._unscale.size * count)
        self._pieces: list[_PenaltySpans] = []
        self._kept = deque[tuple[Array, list[_Rows]]](maxlen=_EVALUATIONS)

    def weigh(self, weights: Array, lowered_floors: Array) -> None:
        """Set the weights of all spans, and the shares to which their floors are lowered, (n_u, n_v, n_w) each."""
        active = np.argwhere(weights > 0.0)
        first = np.stack([e[0][s] for e, s in zip(self._extractions, active.T, strict=True)], axis=1)
        bezier = np.stack([e[1][s] for e, s in zip(self._extractions, active.T, strict=True)], axis=1)
        volumes = np.prod([w[s] for w, s in zip(self._widths, active.T, strict=True)], axis=0)
        lowered = lowered_floors[tuple(active.T)]
        floors, shares = self.floor * lowered, self._share * weights[tuple(active.T)] / lowered**2
        blocks = [slice(start, start + _BLOCK) for start in range(0, len(first), _BLOCK)]
        back = np.ascontiguousarray(np.swapaxes(bezier, 2, 3))
        self._pieces = [_PenaltySpans(first[b], volumes[b], floors[b], shares[b], bezier[b], back[b]) for b in blocks]
        self._kept.clear()

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the penalties on folds in a round."""
        return weights.penalty

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the penalty at control points (3, n_u, n_v, n_w), and its gradient of the same shape."""

        def part(spans: _PenaltySpans) -> tuple[_Rows, float, _Windows]:
            found = self._short_rows(control, spans)
            pull = found.shares * found.shortfall
            pushed = combined(found.rows, found.starts, -2.0 * pull, found.spans.back)
            return found, float(pull @ found.shortfall), (found.spans.first, pushed)

        rows, energies, pushed = zip(*in_parallel(part, self._pieces), strict=True) if self._pieces else ((), (), ())
        if _EVALUATIONS * sum(found.rows.nbytes for found in rows) < _MOST_KEPT:
            self._kept.append((control.copy(), list(rows)))
        return sum(energies), _collected(list(pushed), control)

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the Gauss-Newton part of the second derivative at `control`, as an operator in single precision.

        Where the penalty was evaluated lately, its rows are known. The rows of the operator are kept in memory while
        they take less than `_MOST_KEPT`, because the rows of a map that folds nearly everywhere would take gigabytes.
        Otherwise they are computed again for each product, with the same result.
        """
        known = next((rows for place, rows in self._kept if np.array_equal(place, control)), None)
        taken = 0.0

        def rows_of(number: int) -> _Rows:
            found = self._short_rows(control, self._pieces[number]) if known is None else known[number]
            return found.in_control_points()

        def piece(number: int) -> tuple[Callable[[Floats], _Windows], _Windows] | None:
            nonlocal taken
            found = rows_of(number)
            if not len(found.rows):
                return None
            own = found.spans.first, diagonal_blocks(found.rows, found.starts, 2.0 * found.shares)
            taken += found.rows.nbytes
            if taken <= _MOST_KEPT:
                return found.squared, own
            return lambda x: rows_of(number).squared(x), own

        found = [one for one in in_parallel(piece, range(len(self._pieces))) if one is not None]
        blocks = [own for _, own in found]
        return PiecewiseOperator(
            [product for product, _ in found], _collected, lambda like: _collected(blocks, no_blocks(like))
        )

    def _short_rows(self, control: Array, spans: _PenaltySpans) -> _Rows:
        """Return the rows of the coefficients that lie below the floor on some spans."""
        of_spans = spans.first, spans.weights, spans.volumes, spans.floors
        chosen, shortfall, rows, starts = short_rows(control, *of_spans, self._whole, self._scales, self._unscale)
        spans = spans.some(chosen)
        return _Rows(spans, shortfall, spans.shares.repeat(np.diff(starts)), rows, starts)


class DeterminantPenalty(Blockwise[BlockDeterminants]):
    """Compute the mean over all spans of weight * (floor - coefficient)_+^2, for the Bernstein coefficients of det J.

    weights: (m,), the weights of all spans, 0 at first; a span of positive weight is active. knots: of each block, in
    units in which the mean of det J is near 1. floor: in units of det J. Where the floor is lowered by a share, the
    weight grows by the inverse of the squared share.
    """

    def __init__(self, nets: ControlNets, knots: tuple[Knots, ...], floor: float = MIN_COEFFICIENT) -> None:
        self.floor, count = floor, int(nets.first_spans[-1])
        super().__init__(nets, [BlockDeterminants(rows, nets.degree, count, floor) for rows in knots])
        self._lowered = np.ones(count)
        self.weigh(np.zeros(count))

    def activate(self, spans: IntArray) -> None:
        """Raise the weights of spans (k, 4) to at least 1."""
        weights, chosen = self.weights.copy(), numbers(spans, self.nets)
        weights[chosen] = np.maximum(weights[chosen], 1.0)
        self.weigh(weights)

    def stiffen(self, spans: IntArray, factor: float, most: float) -> None:
        """Multiply the weights of spans (k, 4) and of their neighbours by a factor, from 1 on and at most to `most`.

        The neighbours are included because otherwise a fold would move into the next span.
        """
        grown = np.minimum(factor * np.maximum(self.weights, 1.0), most)
        self.weigh(np.where(with_neighbours(spans, self.nets), np.maximum(grown, self.weights), self.weights))

    def lower_floors(self, shares: Array) -> None:
        """Lower the floors of all spans to shares (m,) of the usual floor."""
        self._lowered = shares
        self.weigh(self.weights)

    def weigh(self, weights: Array) -> None:
        """Set the weights of all spans, (m,)."""
        self.weights = weights
        for block, (term, spans) in enumerate(zip(self.terms, self.nets.spans, strict=True)):
            own = slice(self.nets.first_spans[block], self.nets.first_spans[block + 1])
            term.weigh(weights[own].reshape(spans), self._lowered[own].reshape(spans))


def _collected(parts: list[_Windows], like: Floats) -> Floats:
    """Add windows (k, ..., p + 1, p + 1, p + 1) of control points in order; each starts at its first point (k, 3)."""
    total = np.zeros_like(like)
    for first, windows in parts:
        add_windows(windows, first, total)
    return total
