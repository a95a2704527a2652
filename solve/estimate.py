"""The L2 error of a solution estimated from its own residual, for problems without an exact solution.

The error of a spline Galerkin solution oscillates once an element: in one dimension it is, to leading order, a
Bernoulli polynomial of degree p + 1 there, and its second derivative, the residual, one of degree p - 1. Both are
nearly sines of period h, so the error is nearly the residual over kappa (2 pi / h)^2. In three dimensions the direction
where that factor is least is taken, which errs on the safe side where elements are stretched. What the approximation
of boundary data adds is of higher order, and left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, breakpoints, collocation
from parameterize.spline.volume import BSplineVolume

from .discretization.quadrature import GaussRule, gauss_rule
from .discretization.space import TrialSpace
from .field import Points
from .forms.jets import PAIRS, SYMMETRIC, jets_of
from .forms.problem import BoundaryValueProblem

Orders = tuple[int, int, int]
UNITS: tuple[Orders, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
SECOND: tuple[Orders, ...] = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))  # in order of PAIRS


@dataclass(frozen=True)
class Estimate:
    """Estimated L2 norm of u - u_h, and the same over the norm of u_h (None where that is zero)."""

    l2: float
    l2_relative: float | None


def error_estimate(
    volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: BoundaryValueProblem
) -> Estimate | None:
    """Return the estimated error of a solution with coefficients (c, n_u, n_v, n_w), c components.

    None where the residual tells too little: in a space that is only continuous somewhere, whose derivatives jump, and
    where the derivatives of the law's coefficients are unknown.
    """
    if space.is_only_continuous or problem.not_differentiable:
        return None
    rule, counts = gauss_rule(space), space.gauss_points
    map_layers = _layers(np.moveaxis(volume.control_points, -1, 0), volume.degrees, volume.knots, rule, counts[0])
    own_layers = _layers(coefficients, space.degrees, space.knots, rule, counts[0])
    sizes = [np.repeat(np.diff(breakpoints(k)), count) for k, count in zip(space.knots, counts, strict=True)]
    w_u, w_v, w_w = rule.weights
    sums = np.zeros(2)
    for (layer, geometry), (_, spline) in zip(map_layers, own_layers, strict=True):
        spacing = (sizes[0][layer, None, None], sizes[1][:, None], sizes[2])
        x = Points.of(geometry[0, 0, 0], (rule.points[0][layer], *rule.points[1:]))
        error, det = _local_error(geometry, spline, problem, spacing, x)
        for place, field in enumerate((error, spline[0, 0, 0])):
            sums[place] += np.einsum("ijk,i,j,k", np.abs(det) * (field**2).sum(axis=0), w_u[layer], w_v, w_w)
    l2, norm = np.sqrt(sums).tolist()
    return Estimate(l2, l2 / norm if norm > 0.0 else None)


def _layers(
    coefficients: Array, degrees: Orders, knots: tuple[Array, ...], rule: GaussRule, count: int
) -> Iterator[tuple[slice, dict[Orders, Array]]]:
    """Layer by layer of elements in u: its points, and all derivatives up to second order of c splines.

    coefficients: (c, n_u, n_v, n_w). Each derivative is (c, q_u, q_v, q_w) with `count` points of u in a layer.
    """
    rows = [[collocation(knots[a], degrees[a], rule.points[a], order) for order in range(3)] for a in range(3)]
    for start in range(0, rule.shape[0], count):
        layer = slice(start, start + count)
        along_u = [apply_along(matrix[layer], coefficients, 1) for matrix in rows[0]]
        found = {}
        for i in range(3):
            for j in range(3 - i):
                along_v = apply_along(rows[1][j], along_u[i], 2)
                for k in range(3 - i - j):
                    found[i, j, k] = apply_along(rows[2][k], along_v, 3)
        yield layer, found


def _local_error(
    geometry: dict[Orders, Array],
    spline: dict[Orders, Array],
    problem: BoundaryValueProblem,
    spacing: tuple[Array, ...],
    x: Points,
) -> tuple[Array, Array]:
    """The estimated error (c, ...) and det J (...) at the points of a layer."""
    tangents = [geometry[order] for order in UNITS]
    cofactors = [np.cross(tangents[a - 2], tangents[a - 1], axis=0) for a in range(3)]
    det = (tangents[0] * cofactors[0]).sum(axis=0)
    inverse = [row / det for row in cofactors]  # rows of J^-1, each (3, ...)
    gradients, hessians = [], []
    for component in range(len(spline[0, 0, 0])):
        gradient = _dot(inverse, [spline[order][component] for order in UNITS])
        bent = [spline[order][component] - _dot(gradient, geometry[order]) for order in SECOND]
        gradients.append(gradient)
        hessians.append(_physical_hessian(bent, inverse))
    residual = problem.residual_at(jets_of(spline[0, 0, 0], np.stack(gradients), np.stack(hessians)), x)
    symbols = [problem.form.symbol(2.0 * np.pi / spacing[a] * inverse[a], x) for a in range(3)]
    return residual / np.min(symbols, axis=0), det


def _physical_hessian(bent: list[Array], inverse: list[Array]) -> Array:
    """J^-T H J^-1 (6, ...) from the six entries of H, second derivatives in the parameters, and the rows of J^-1."""
    rows = [_dot([bent[place] for place in SYMMETRIC[a]], inverse) for a in range(3)]  # H J^-1, each (3, ...)
    columns = list(zip(*inverse, strict=True)), list(zip(*rows, strict=True))
    return np.stack([_dot(columns[0][i], columns[1][j]) for i, j in PAIRS])


def _dot(a: Sequence[Array] | Array, b: Sequence[Array] | Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
