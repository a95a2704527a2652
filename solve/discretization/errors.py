"""Errors of a solution: against an exact one, or estimated from its own residual (docs/solver.md)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..field import Points
from ..forms.form import strong_form
from ..forms.jets import PAIRS, SYMMETRIC, Jet
from ..forms.problem import BoundaryValueProblem
from . import kernels
from .quadrature import gauss_rule, geometry_planes
from .space import TrialSpace, agreed

PLANES = 16  # of points of u, in a piece of work
POINTS = 2**16  # of a plane that are evaluated at once: they take dozens of arrays


@dataclass(frozen=True)
class Errors:
    """L2 norm and H1 seminorm of u - u_h, and the same over those of u.

    None: the relative errors where u or its gradient is zero, both of H1 where the gradient of u is unknown.
    An estimate is relative to u_h, and has no H1.
    """

    l2: float
    l2_relative: float | None
    h1_seminorm: float | None = None
    h1_relative: float | None = None


def error_norms(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    exact: Callable[[Array], tuple[Array, Array | None]],
    threads: int = 1,
) -> Errors:
    """Return error norms over the physical domain, over all components (c, n_u, n_v, n_w) together.

    exact: takes points (3, ...) and returns u (c, ...) and grad u (c, 3, ...), or None in the gradient's place.
    There are degree + 2 Gauss points a span and direction.
    """
    whole, splines = gauss_rule(space, [p + 2 for p in space.degrees]), np.ascontiguousarray(coefficients)
    strips = [(rule, rule.tabulate(space.degrees, space.knots)) for rule in whole.strips(POINTS)]
    # of (u - u_h)^2, u^2, |grad u - grad u_h|^2, |grad u|^2, plane by plane: the same for any number of threads
    sums = np.zeros((whole.shape[0], 4))
    has_gradient = []

    def integrate(points: range) -> None:
        for rule, tables in strips:
            fields = np.empty((len(splines), 4, *rule.plane_shape))
            slopes = np.empty((len(splines), 3, *rule.plane_shape))
            for q, rows, measure, x in geometry_planes(volume, rule, points):
                values, gradients = exact(x)
                scale = np.sqrt(np.abs(measure))
                for spline, field in zip(splines, fields, strict=True):
                    kernels.evaluate_plane(spline, q, tables, field)
                fields[:, 0] *= scale
                sums[q, :2] += kernels.squares(values[:, None], scale, fields[:, :1])
                has_gradient.append(gradients is not None)
                if gradients is not None:
                    kernels.turn(rows, fields[:, 1:], slopes, False)
                    sums[q, 2:] += kernels.squares(gradients, scale, slopes)

    planes = range(whole.shape[0])
    with agreed(space.comm):
        in_parallel(integrate, [planes[start : start + PLANES] for start in planes[::PLANES]], threads)
    l2, norm, seminorm, slope = np.sqrt(space.total(sums.sum(axis=0))).tolist()
    if not all(space.shared(all(has_gradient))):
        return Errors(l2, _ratio(l2, norm))
    return Errors(l2, _ratio(l2, norm), seminorm, _ratio(seminorm, slope))


def _ratio(error: float, size: float) -> float | None:
    return error / size if size > 0.0 else None


def missing_mean(volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: BoundaryValueProblem) -> float:
    """Return the constant that gives a solution (n_u, n_v, n_w) the mean of `exact`, or mean zero without one."""
    rule = gauss_rule(space)
    tables, spline = rule.tabulate(space.degrees, space.knots), np.ascontiguousarray(coefficients)
    plane = np.empty((4, *rule.plane_shape))
    lack = size = 0.0
    with agreed(space.comm):
        for q, _, measure, x in geometry_planes(volume, rule):
            kernels.evaluate_plane(spline, q, tables, plane)
            wanted = 0.0 if problem.exact is None else problem.exact_at(x)[0][0]
            lack += float(((wanted - plane[0]) * np.abs(measure)).sum())
            size += float(np.abs(measure).sum())
    return float(space.total(lack) / space.total(size))


def error_estimate(
    volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: BoundaryValueProblem
) -> Errors | None:
    """Return the estimated error of a solution with coefficients (c, n_u, n_v, n_w), c components.

    None where the residual tells too little: in a space that is only continuous somewhere, whose derivatives jump, and
    where the derivatives of the law's coefficients are unknown.
    """
    if space.is_only_continuous or problem.not_differentiable:
        return None
    rule, counts = gauss_rule(space), space.gauss_points
    bases = [
        [[collocation(knots[a], degrees[a], rule.points[a], order) for order in range(3)] for a in range(3)]
        for degrees, knots in ((space.degrees, space.knots), (volume.degrees, volume.knots))
    ]
    sizes = [np.repeat(np.diff(breaks), count) for breaks, count in zip(space.breaks, counts, strict=True)]
    w_u, w_v, w_w = rule.weights
    sums = np.zeros(2)
    with agreed(space.comm):
        for start in range(0, rule.shape[0], counts[0]):  # layer by layer of elements in u
            layer = slice(start, start + counts[0])
            spacing = (sizes[0][layer, None, None], sizes[1][:, None], sizes[2])
            solution = _derivatives(bases[0], coefficients, layer)
            geometry = _derivatives(bases[1], np.moveaxis(volume.control_points, -1, 0), layer)
            x = Points.of(geometry[0, 0, 0], (rule.points[0][layer], *rule.points[1:]))
            error, det = _local_error(geometry, solution, problem, spacing, x)
            for place, field in enumerate((error, solution[0, 0, 0])):
                sums[place] += np.einsum("ijk,i,j,k", np.abs(det) * (field**2).sum(axis=0), w_u[layer], w_v, w_w)
    l2, norm = np.sqrt(space.total(sums)).tolist()
    return Errors(l2, _ratio(l2, norm))


Orders = tuple[int, int, int]
FIRST: tuple[Orders, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
SECOND: tuple[Orders, ...] = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))  # in order of PAIRS


def _derivatives(bases: list[list[csr_array]], coefficients: Array, layer: slice) -> dict[Orders, Array]:
    """Return all derivatives up to second order, each (c, q_u, q_v, q_w), of splines (c, n_u, n_v, n_w) on a layer."""
    found = {}
    for i in range(3):
        along_u = apply_along(bases[0][i][layer], coefficients, 1)
        for j in range(3 - i):
            along_v = apply_along(bases[1][j], along_u, 2)
            for k in range(3 - i - j):
                found[i, j, k] = apply_along(bases[2][k], along_v, 3)
    return found


def _local_error(
    geometry: dict[Orders, Array],
    spline: dict[Orders, Array],
    problem: BoundaryValueProblem,
    spacing: tuple[Array, ...],
    x: Points,
) -> tuple[Array, Array]:
    """Return the estimated error (c, ...) and det J (...) at the points of a layer."""
    tangents = [geometry[order] for order in FIRST]
    cofactors = [np.cross(tangents[a - 2], tangents[a - 1], axis=0) for a in range(3)]
    det = (tangents[0] * cofactors[0]).sum(axis=0)
    inverse = [row / det for row in cofactors]  # rows of J^-1, each (3, ...)
    jets = []
    for component, value in enumerate(spline[0, 0, 0]):
        gradient = _dot(inverse, [spline[order][component] for order in FIRST])
        bent = [spline[order][component] - _dot(gradient, geometry[order]) for order in SECOND]
        rows = [_dot([bent[place] for place in SYMMETRIC[a]], inverse) for a in range(3)]  # H J^-1, each (3, ...)
        hessian = (_dot([row[i] for row in inverse], [row[j] for row in rows]) for i, j in PAIRS)
        jets.append(Jet(value, tuple(gradient), tuple(hessian)))
    symbols = [problem.form.symbol(2.0 * np.pi / spacing[a] * inverse[a], x) for a in range(3)]
    return (problem.source_at(x) - strong_form(problem.form, jets, x)) / np.min(symbols, axis=0), det


def _dot(a: Sequence[Array] | Array, b: Sequence[Array] | Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
