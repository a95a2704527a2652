"""The stiffness operator of -Laplace, matrix-free, and the load vector assembled in the same pass.

In parametric coordinates the form is the integral of grad v . G grad u with G = det J J^-1 J^-T; six numbers a Gauss
point hold it, and sum factorization applies it (Antolin, Buffa, Calabro, Martinelli, Sangalli, CMAME 2015).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.bspline import Array
from parameterize.volume import BSplineVolume

from . import kernels
from .planes import map_planes
from .quadrature import GaussRule, Table, gauss_rule
from .space import TrialSpace

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the order of the six factors
ScalarFunction = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Stiffness:
    """Symmetric positive semidefinite stiffness matrix, never formed.

    tables: the trial basis at the Gauss points. factors: (q_u, q_w, 6, q_v), weights included.
    """

    space: TrialSpace
    tables: tuple[Table, Table, Table]
    factors: Array

    def apply(self, coefficients: Array) -> Array:
        """The product with a coefficient array of shape `space.shape`, boundary rows and columns included."""
        result = np.empty(self.space.shape)
        u, v, w = self.tables
        kernels.apply_stiffness(np.ascontiguousarray(coefficients), *u, *v, *w, self.factors, result)
        return result

    def apply_inside(self, interior: Array) -> Array:
        """The product restricted to the interior: shape `space.shape` less 2 in each direction."""
        return self.apply(np.pad(interior, 1))[1:-1, 1:-1, 1:-1]

    def diagonal(self) -> Array:
        """The diagonal of the matrix, shape `space.shape`: squared basis functions in place of the basis."""
        result = np.zeros(self.space.shape)
        u, v, w = self.tables
        plane = np.empty(self.space.shape[1:])
        products = [  # per direction, (q, degree + 1): values of B B, B B' and B' B' at index sum of derivatives
            (t.values[0] ** 2, t.values[0] * t.values[1], t.values[1] ** 2) for t in self.tables
        ]
        for q, factors in enumerate(self.factors):
            window = slice(u.first[q], u.first[q] + u.values.shape[2])
            for index, pair in enumerate(PAIRS):
                in_u, in_v, in_w = (products[a][pair.count(a)] for a in range(3))
                field = np.ascontiguousarray(factors[:, index])
                kernels.integrate_plane(field, v.first, in_v, w.first, in_w, plane)
                twice = 1.0 if pair[0] == pair[1] else 2.0
                result[window] += twice * np.multiply.outer(in_u[q], plane)
        return result

    def mean_coefficients(self) -> tuple[float, float, float]:
        """The averages over the cube of G_uu, G_vv and G_ww."""
        sums = self.factors.sum(axis=(0, 1, 3))
        return float(sums[0]), float(sums[3]), float(sums[5])


@dataclass(frozen=True, eq=False)
class System:
    """Stiffness operator, load vector (n_u, n_v, n_w), and how many of the Gauss points have det J < 0."""

    stiffness: Stiffness
    load: Array
    folded: int
    points: int


def assemble(volume: BSplineVolume, space: TrialSpace, source: ScalarFunction, rule: GaussRule | None = None) -> System:
    """One pass over the Gauss points: geometry factors and load vector of -Laplace u = source on the volume.

    Where the map is folded, |det J| takes the place of det J.

    The geometry is the volume's own, evaluated exactly whatever the trial space.
    Raises ValueError where det J is zero at a Gauss point, naming it.
    """
    rule = rule or gauss_rule(space)
    tables = rule.tabulate(space.degrees, space.knots)
    u, v, w = tables
    factors = np.empty((rule.shape[0], rule.plane_shape[0], 6, rule.plane_shape[1]))
    measure, plane = np.empty(rule.plane_shape), np.empty(space.shape[1:])
    load = np.zeros(space.shape)
    folded = 0
    for q, fields in map_planes(volume, rule):
        kernels.plane_factors(fields, rule.plane_weights(q), factors[q], measure)
        turned = _count_folded(measure, rule, q)
        if turned:  # measured with |det J|, the form stays positive: an answer to show, if not to trust
            folded += turned
            factors[q] *= np.sign(measure)[:, None]
            np.abs(measure, out=measure)
        density = source(*fields[:, 0]) * measure
        kernels.integrate_plane(density, v.first, v.values[0], w.first, w.values[0], plane)
        load[u.first[q] : u.first[q] + u.values.shape[2]] += np.multiply.outer(u.values[0, q], plane)
    return System(Stiffness(space, tables, factors), load, folded, int(np.prod(rule.shape)))


def _count_folded(measure: Array, rule: GaussRule, q: int) -> int:
    """Number of points of a plane with det J < 0. Raises ValueError where it is zero."""
    if measure.min() > 0.0:
        return 0
    flat = np.argwhere(measure == 0.0)
    if flat.size:
        w, v = flat[0]
        where = tuple(float(rule.points[a][i]) for a, i in enumerate((q, v, w)))
        raise ValueError(f"volume: det J is zero at the parameters {where}; such a map has no inverse there")
    return int(np.count_nonzero(measure < 0.0))
