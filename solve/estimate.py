"""The L2 error of a solution estimated from its own residual, for problems without an exact solution.

The error of a spline Galerkin solution oscillates once an element: in one dimension it is, to leading order, a
Bernoulli polynomial of degree p + 1 there, and its second derivative, the residual, one of degree p - 1. Both are
nearly sines of period h, so the error is nearly the residual over kappa (2 pi / h)^2. In three dimensions the direction
where that factor is least is taken, which errs on the safe side where elements are stretched. What the approximation
of boundary data adds is of higher order, and left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from parameterize.bspline import Array, apply_along, breakpoints, collocation
from parameterize.volume import BSplineVolume

from .expressions import PAIRS
from .problem import SYMMETRIC, Poisson
from .quadrature import GaussRule, gauss_rule
from .space import TrialSpace

Orders = tuple[int, int, int]
UNITS: tuple[Orders, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
SECOND: tuple[Orders, ...] = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))  # in order of PAIRS


@dataclass(frozen=True)
class Estimate:
    """Estimated L2 norm of u - u_h, and the same over the norm of u_h (None where that is zero)."""

    l2: float
    l2_relative: float | None


def error_estimate(volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: Poisson) -> Estimate | None:
    """Estimate of the error of a solution with coefficients (n_u, n_v, n_w).

    None where the residual tells too little: in a space that is only continuous somewhere, whose derivatives jump, and
    with a function as kappa, whose derivatives are unknown.
    """
    if space.is_only_continuous or not problem.is_smooth_kappa:
        return None
    rule, counts = gauss_rule(space), space.gauss_points
    map_layers = _layers(np.moveaxis(volume.control_points, -1, 0), volume.degrees, volume.knots, rule, counts[0])
    own_layers = _layers(coefficients[None], space.degrees, space.knots, rule, counts[0])
    sizes = [np.repeat(np.diff(breakpoints(k)), count) for k, count in zip(space.knots, counts, strict=True)]
    w_u, w_v, w_w = rule.weights
    sums = np.zeros(2)
    for (layer, geometry), (_, spline) in zip(map_layers, own_layers, strict=True):
        spacing = (sizes[0][layer, None, None], sizes[1][:, None], sizes[2])
        error, det = _local_error(geometry, {order: field[0] for order, field in spline.items()}, problem, spacing)
        for place, values in enumerate((error, spline[0, 0, 0][0])):
            sums[place] += np.einsum("ijk,i,j,k", np.abs(det) * values**2, w_u[layer], w_v, w_w)
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
    geometry: dict[Orders, Array], spline: dict[Orders, Array], problem: Poisson, spacing: tuple[Array, ...]
) -> tuple[Array, Array]:
    """The estimated |u - u_h| and det J at the points of a layer."""
    x, y, z = geometry[0, 0, 0]
    tangents = [geometry[order] for order in UNITS]
    cofactors = [np.cross(tangents[a - 2], tangents[a - 1], axis=0) for a in range(3)]
    det = (tangents[0] * cofactors[0]).sum(axis=0)
    inverse = [row / det for row in cofactors]  # rows of J^-1, each (3, ...)
    gradient = sum(inverse[a] * spline[UNITS[a]] for a in range(3))
    hessian = _physical_hessian(geometry, spline, inverse, gradient)
    residual = problem.source_at(x, y, z) + problem.divergence_at(gradient, hessian, x, y, z)
    reaction = problem.reaction_at(x, y, z)
    residual -= reaction * spline[0, 0, 0]
    kappa = problem.kappa_at(x, y, z)
    stretch = [(2.0 * np.pi / spacing[a]) ** 2 * _quadratic(kappa, inverse[a], det.ndim) for a in range(3)]
    error: Array = np.abs(residual) / (np.min(stretch, axis=0) + reaction)
    return error, det


def _physical_hessian(
    geometry: dict[Orders, Array], spline: dict[Orders, Array], inverse: list[Array], gradient: Array
) -> Array:
    """Second derivatives (6, ...) in x, y, z: J^-T (H - sum_c du/dx_c H_c) J^-1.

    H holds the solution's second derivatives in the parameters, H_c those of the map's component c.
    """
    bent = [spline[order] - (gradient * geometry[order]).sum(axis=0) for order in SECOND]
    rows = [sum(bent[SYMMETRIC[a][b]] * inverse[b] for b in range(3)) for a in range(3)]
    return np.stack([sum(inverse[a][i] * rows[a][j] for a in range(3)) for i, j in PAIRS])


def _quadratic(kappa: Array, row: Array, dimensions: int) -> Array:
    """The form row . kappa row for a scalar kappa (...) or a tensor (6, ...)."""
    if kappa.ndim == dimensions:
        return kappa * (row * row).sum(axis=0)
    return sum(kappa[SYMMETRIC[i][j]] * row[i] * row[j] for i in range(3) for j in range(3))
