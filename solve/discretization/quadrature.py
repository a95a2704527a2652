"""Tensor-product Gauss rules on the spans of a trial space, and basis functions tabulated at their points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.spline.bspline import basis_derivatives, breakpoints, gauss_points

from .space import TrialSpace


class Table(NamedTuple):
    """The basis functions of one direction at its quadrature points.

    first: (q,) index of the first function that is nonzero there.
    values: (2, q, degree + 1) values and first derivatives of the nonzero ones.
    """

    first: NDArray[np.int64]
    values: Array

    def by_spans(self, spans: int) -> SpanTable:
        """The same span by span, for a rule with as many points in each of its `spans` spans."""
        values = self.values.reshape(2, spans, -1, self.values.shape[2])
        first = self.first.reshape(spans, -1)[:, 0]
        sizes = (0,) * values.shape[2], (0,) * values.shape[3]
        return SpanTable(np.ascontiguousarray(first), np.ascontiguousarray(values.transpose(1, 2, 0, 3)), *sizes)


class SpanTable(NamedTuple):
    """The basis functions of one direction, span by span.

    first: (spans,) index of the first function that is nonzero there.
    values: (spans, points per span, 2, degree + 1) values and first derivatives of the nonzero ones.
    points, functions: zeros, one for each Gauss point of a span and one for each function that is nonzero there.
        The kernels are compiled for the lengths of these tuples.
    """

    first: NDArray[np.int64]
    values: Array
    points: tuple[int, ...]
    functions: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class GaussRule:
    """Tensor-product Gauss-Legendre rule: `points[a]` and `weights[a]`, each (q_a,), in the parametric directions."""

    points: tuple[Array, Array, Array]
    weights: tuple[Array, Array, Array]

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of points per direction."""
        q_u, q_v, q_w = (len(p) for p in self.points)
        return q_u, q_v, q_w

    @property
    def plane_shape(self) -> tuple[int, int]:
        """Shape (q_w, q_v) of the plane of points that belongs to one point of the first direction.

        Direction v runs fastest: the kernels contract w over rows of v.
        """
        return self.shape[2], self.shape[1]

    def plane_weights(self, q: int) -> Array:
        """Weights (q_w, q_v) of the plane through point `q` of the first direction."""
        w_u, w_v, w_w = self.weights
        plane: Array = w_u[q] * np.multiply.outer(w_w, w_v)
        return plane

    def tabulate(self, degrees: tuple[int, int, int], knots: tuple[Array, Array, Array]) -> tuple[Table, Table, Table]:
        """Tables of any spline basis (the trial space's or the map's) at the points of this rule."""
        u, v, w = (Table(*basis_derivatives(knots[a], degrees[a], self.points[a], derivatives=1)) for a in range(3))
        return u, v, w


def span_tables(space: TrialSpace, tables: tuple[Table, Table, Table]) -> tuple[SpanTable, SpanTable, SpanTable]:
    """Tables at a Gauss rule on the spans of `space`, span by span."""
    u, v, w = (table.by_spans(len(breakpoints(k)) - 1) for table, k in zip(tables, space.knots, strict=True))
    return u, v, w


def gauss_rule(space: TrialSpace, counts: tuple[int, int, int] | None = None) -> GaussRule:
    """Gauss rule on the spans of `space` with `counts` points per span (default: those the operator needs)."""
    rows = [gauss_points(k, n) for k, n in zip(space.knots, counts or space.gauss_points, strict=True)]
    points, weights = ([r.ravel() for r in part] for part in zip(*rows, strict=True))
    return GaussRule((points[0], points[1], points[2]), (weights[0], weights[1], weights[2]))
