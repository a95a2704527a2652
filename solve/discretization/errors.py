"""Computes the errors of a solution against an exact solution."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..forms.boundary_value_problem import BoundaryValueProblem
from . import kernels
from .quadrature import gauss_rule, geometry_planes
from .space import TrialSpace

PLANES = 16  # of points of u, in a piece of work
POINTS = 2**16  # of a plane that are evaluated at once: they take dozens of arrays


@dataclass(frozen=True)
class Errors:
    """Hold the L2 norm and the H1 seminorm of u - u_h, and their ratios to the norms of u.

    The relative errors are None where u or its gradient is zero, both H1 numbers where the gradient of u is unknown. An
    estimate is relative to u_h, and has no H1 numbers.
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

    exact: a function of points (3, ...) that returns u (c, ...) and grad u (c, 3, ...), or None in place of the
    gradient. The integrals use degree + 2 Gauss points a span and direction.
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
    with space.agreed():
        in_parallel(integrate, [planes[start : start + PLANES] for start in planes[::PLANES]], threads)
    l2, norm, seminorm, slope = np.sqrt(space.total(sums.sum(axis=0))).tolist()
    if not all(space.shared(all(has_gradient))):
        return Errors(l2, ratio(l2, norm))
    return Errors(l2, ratio(l2, norm), seminorm, ratio(seminorm, slope))


def ratio(error: float, size: float) -> float | None:
    """Return the error over the size, None where the size is zero."""
    return error / size if size > 0.0 else None


def missing_mean(volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: BoundaryValueProblem) -> float:
    """Return the constant to add to a solution (n_u, n_v, n_w) for the mean of `exact`, or mean zero without it."""
    rule = gauss_rule(space)
    tables, spline = rule.tabulate(space.degrees, space.knots), np.ascontiguousarray(coefficients)
    plane = np.empty((4, *rule.plane_shape))
    lack = size = 0.0
    with space.agreed():
        for q, _, measure, x in geometry_planes(volume, rule):
            kernels.evaluate_plane(spline, q, tables, plane)
            wanted = 0.0 if problem.exact is None else problem.exact_at(x)[0][0]
            lack += float(((wanted - plane[0]) * np.abs(measure)).sum())
            size += float(np.abs(measure).sum())
    return float(space.total(lack) / space.total(size))
