"""Defines SplineStack: splines of equal degrees and knots as one array, which are evaluated at once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray, Knots
from .bspline import basis_derivatives, evaluate_grid
from .patch_groups import PatchGroup
from .rational import Orders, homogeneous, quotients
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

    @classmethod
    def of_maps(cls, group: PatchGroup) -> "SplineStack":
        """Return the maps of a group of patches."""
        if group.weights is None:
            return cls(group.degrees, group.knots, group.control_points)
        return cls(group.degrees, group.knots, homogeneous(group.control_points, group.weights), is_rational=True)

    def __len__(self) -> int:
        return len(self.coefficients)

    def take(self, rows: IntArray | slice) -> "SplineStack":
        """Return some of the splines. rows: their places in the stack."""
        return replace(self, coefficients=self.coefficients[rows])

    def grid(self, u: Array, v: Array, w: Array) -> Array:
        """Return the values (k, len(u), len(v), len(w), c) of each spline on a tensor grid of parameters."""
        return self._on_grid((u, v, w), (VALUE,))[0]

    def grid_slopes(self, u: Array, v: Array, w: Array) -> Array:
        """Return the first derivatives (k, len(u), len(v), len(w), c, 3), the last index the parametric direction."""
        return np.stack(self._on_grid((u, v, w), UNITS), axis=-1)

    def at(self, owners: IntArray, points: Array) -> tuple[Array, Array]:
        """Return values (m, c) and first derivatives (m, c, 3) at parameters (m, 3) of the splines `owners` (m,)."""
        bases = [basis_derivatives(*part, 1) for part in zip(self.knots, self.degrees, points.T, strict=True)]
        i, j, k = (first[:, None] + np.arange(values.shape[2]) for first, values in bases)
        owned = owners[:, None, None, None]
        near = self.coefficients[owned, i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]
        (_, u), (_, v), (_, w) = bases

        @cache
        def along_w(n: int) -> Array:
            return np.asarray(np.einsum("mk,mijkc->mijc", w[n], near))

        @cache
        def along_vw(order: tuple[int, int]) -> Array:
            return np.asarray(np.einsum("mj,mijc->mic", v[order[0]], along_w(order[1])))

        def derivative(order: Orders) -> Array:
            return np.asarray(np.einsum("mi,mic->mc", u[order[0]], along_vw(order[1:])))

        value, *slopes = self._derivatives(derivative, (VALUE, *UNITS))
        return value, np.stack(slopes, axis=-1)

    def _on_grid(self, rows: Sequence[ArrayLike], orders: Sequence[Orders]) -> list[Array]:
        net = np.moveaxis(self.coefficients, 0, 3)  # what is evaluated has its three directions first
        evaluate = partial(evaluate_grid, self.degrees, self.knots, net, rows)
        return [np.moveaxis(found, 3, 0) for found in self._derivatives(evaluate, orders)]

    def _derivatives(self, evaluate: Callable[[Orders], Array], orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives of the splines. evaluate: returns those of the coefficients."""
        return quotients(evaluate, orders) if self.is_rational else [evaluate(order) for order in orders]
