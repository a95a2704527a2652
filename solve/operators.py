"""The operator of -div(kappa grad u) + c u, matrix-free, and the load vector assembled in the same pass.

In parametric coordinates the form is the integral of grad v . G grad u with G = det J J^-1 kappa J^-T; six numbers a
Gauss point hold it, and sum factorization applies it (Antolin, Buffa, Calabro, Martinelli, Sangalli, CMAME 2015).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from parameterize.bspline import Array
from parameterize.volume import FACE_NAMES, BSplineVolume

from . import kernels
from .planes import map_planes
from .quadrature import GaussRule, Table, gauss_rule
from .space import TrialSpace

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the order of the six factors
Window = tuple[slice, slice, slice]
ScalarFunction = Callable[[Array, Array, Array], Array]


def free_window(space: TrialSpace, dirichlet: Collection[str] = FACE_NAMES) -> Window:
    """The coefficients that Dirichlet data on the named cube faces ("u0" ... "w1") leave free, a box of the array.

    Raises ValueError for a name that is no face.
    """
    unknown = sorted(set(dirichlet) - set(FACE_NAMES))
    if unknown:
        raise ValueError(f"dirichlet: {unknown[0]!r} is no face of the cube; the faces are {', '.join(FACE_NAMES)}")
    sides = [[name in dirichlet for name in FACE_NAMES[2 * a : 2 * a + 2]] for a in range(3)]
    u, v, w = (slice(int(low), n - int(high)) for (low, high), n in zip(sides, space.shape, strict=True))
    return u, v, w


@dataclass(frozen=True, eq=False)
class Operator:
    """Symmetric positive semidefinite matrix of the form, never assembled.

    tables: the trial basis at the Gauss points. factors: (q_u, q_w, 6, q_v), weights included.
    mass: (q_u, q_w, q_v), the reaction c times w det J, or None without one.
    window: the free coefficients.
    """

    space: TrialSpace
    tables: tuple[Table, Table, Table]
    factors: Array
    mass: Array | None
    window: Window

    def apply(self, coefficients: Array) -> Array:
        """The product with a coefficient array of shape `space.shape`, rows and columns that are not free included."""
        result = np.empty(self.space.shape)
        u, v, w = self.tables
        coefficients = np.ascontiguousarray(coefficients)
        kernels.apply_stiffness(coefficients, *u, *v, *w, self.factors, result)
        if self.mass is not None:
            kernels.add_mass(coefficients, *u, *v, *w, self.mass, result)
        return result

    def apply_free(self, free: Array) -> Array:
        """The product restricted to the free coefficients, an array of the window's shape."""
        full = np.zeros(self.space.shape)
        full[self.window] = free
        return self.apply(full)[self.window]

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
            terms: list[tuple[tuple[int, ...], Array]] = [(pair, factors[:, index]) for index, pair in enumerate(PAIRS)]
            if self.mass is not None:
                terms.append(((), self.mass[q]))
            for pair, field in terms:
                in_u, in_v, in_w = (products[a][pair.count(a)] for a in range(3))
                kernels.integrate_plane(np.ascontiguousarray(field), v.first, in_v, w.first, in_w, plane)
                twice = 2.0 if len(set(pair)) == 2 else 1.0
                result[window] += twice * np.multiply.outer(in_u[q], plane)
        return result

    def mean_coefficients(self) -> tuple[float, float, float]:
        """The averages over the cube of G_uu, G_vv and G_ww."""
        sums = self.factors.sum(axis=(0, 1, 3))
        return float(sums[0]), float(sums[3]), float(sums[5])

    def mean_mass(self) -> float:
        """The average over the cube of c det J."""
        return 0.0 if self.mass is None else float(self.mass.sum())


@dataclass(frozen=True, eq=False)
class System:
    """Operator, load vector (n_u, n_v, n_w), and how many of the Gauss points have det J < 0."""

    operator: Operator
    load: Array
    folded: int
    points: int


def assemble(
    volume: BSplineVolume,
    space: TrialSpace,
    source: ScalarFunction,
    rule: GaussRule | None = None,
    *,
    kappa: ScalarFunction | None = None,
    reaction: ScalarFunction | None = None,
    window: Window | None = None,
) -> System:
    """One pass over the Gauss points: operator and load vector of -div(kappa grad u) + c u = source on the volume.

    source, kappa, reaction: functions of x, y, z, called with arrays (q_w, q_v), one plane of Gauss points at a time.
    kappa: returns an array of that shape or, for a symmetric tensor, (6, q_w, q_v) in the order xx, xy, xz, yy, yz, zz;
        None for the identity. reaction: c; None for zero.
    window: the free coefficients, as `free_window` gives them (default: all but those of the six faces).

    Where the map is folded, |det J| takes the place of det J.

    The geometry is the volume's own, evaluated exactly whatever the trial space.
    Raises ValueError where det J is zero at a Gauss point, naming it.
    """
    rule = rule or gauss_rule(space)
    tables = rule.tabulate(space.degrees, space.knots)
    u, v, w = tables
    factors = np.empty((rule.shape[0], rule.plane_shape[0], 6, rule.plane_shape[1]))
    mass = None if reaction is None else np.empty((rule.shape[0], *rule.plane_shape))
    measure, plane = np.empty(rule.plane_shape), np.empty(space.shape[1:])
    load = np.zeros(space.shape)
    folded = 0
    for q, fields in map_planes(volume, rule):
        weights, where = rule.plane_weights(q), fields[:, 0]
        if kappa is None:
            kernels.plane_factors(fields, weights, factors[q], measure)
        else:
            kernels.plane_tensor_factors(fields, weights, _tensor(kappa(*where)), factors[q], measure)
        turned = _count_folded(measure, rule, q)
        if turned:  # measured with |det J|, the form stays positive: an answer to show, if not to trust
            folded += turned
            factors[q] *= np.sign(measure)[:, None]
            np.abs(measure, out=measure)
        if mass is not None and reaction is not None:
            mass[q] = reaction(*where) * measure
        kernels.integrate_plane(source(*where) * measure, v.first, v.values[0], w.first, w.values[0], plane)
        load[u.first[q] : u.first[q] + u.values.shape[2]] += np.multiply.outer(u.values[0, q], plane)
    operator = Operator(space, tables, factors, mass, window or free_window(space))
    return System(operator, load, folded, int(np.prod(rule.shape)))


def _tensor(values: Array) -> Array:
    """A symmetric tensor (6, q_w, q_v) at the points of a plane, from itself or from a scalar (q_w, q_v)."""
    if values.ndim == 3:
        return np.ascontiguousarray(values)
    tensor = np.zeros((6, *values.shape))
    tensor[[0, 3, 5]] = values
    return tensor


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
