"""Defines SplineStack: splines of equal degrees and knots as one array, which are evaluated at once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray, Knots
from .bspline import evaluate_each, evaluate_grid
from .rational import Orders, quotients
from .volume import UNITS

VALUE: Orders = (0, 0, 0)


@dataclass(frozen=True, eq=False)
class SplineStack:
    """Evaluate k trivariate splines of equal degrees and knots.

    Parameters
    ----------
    degrees : three int
        Of the three directions.
    knots : three arrays
        Open knot vectors on [0, 1].
    coefficients : (k, n_u, n_v, n_w, c) array
        Of rational splines homogeneous ones, the weighted coefficients and last the weight.
    is_rational : bool
        Whether the values are quotients.
    """

    degrees: tuple[int, int, int]
    knots: Knots
    coefficients: Array
    is_rational: bool = False

    def __len__(self) -> int:
        return len(self.coefficients)

    def take(self, rows: IntArray | slice) -> "SplineStack":
        """Return some of the splines. rows: their places in the stack."""
        return replace(self, coefficients=self.coefficients[rows])

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the values (k, len(u), len(v), len(w), c) of each spline on a tensor grid of parameters."""
        return self.on_grid((u, v, w), (VALUE,))[0]

    def grid_slopes(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the first derivatives (k, len(u), len(v), len(w), c, 3), the last index the parametric direction."""
        return np.stack(self.on_grid((u, v, w), UNITS), axis=-1)

    def at(self, owners: IntArray, points: ArrayLike) -> Array:
        """Return the values (m, c) at parameters (m, 3) of the splines `owners` (m,)."""
        return self.derivatives_at(owners, points, (VALUE,))[0]

    def slopes_at(self, owners: IntArray, points: ArrayLike) -> Array:
        """Return the first derivatives (m, c, 3) at parameters (m, 3) of the splines `owners` (m,)."""
        return np.stack(self.derivatives_at(owners, points, UNITS), axis=-1)

    def derivatives_at(self, owners: IntArray, points: ArrayLike, orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives (m, c) at parameters (m, 3) of the splines `owners` (m,)."""
        evaluate = partial(evaluate_each, self.degrees, self.knots, self.coefficients, owners, points)
        return self._derivatives(evaluate, orders)

    def on_grid(self, rows: Sequence[ArrayLike], orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives (k, len(u), len(v), len(w), c) on a tensor grid of parameters."""
        net = np.moveaxis(self.coefficients, 0, 3)  # what is evaluated has its three directions first
        evaluate = partial(evaluate_grid, self.degrees, self.knots, net, rows)
        return [np.moveaxis(found, 3, 0) for found in self._derivatives(evaluate, orders)]

    def _derivatives(self, evaluate: Callable[[Orders], Array], orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives of the splines. evaluate: returns those of the coefficients."""
        return quotients(evaluate, orders) if self.is_rational else [evaluate(order) for order in orders]
