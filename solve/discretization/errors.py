"""Computes the errors of a solution against an exact solution."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from . import kernels
from .quadrature import gauss_rule, geometry_planes
from .space import TrialSpace

PLANES = 16  # of points of u, in a piece of work
POINTS = 2**16  # of a plane that are evaluated at once: they take dozens of arrays


Exact = Callable[[Array], tuple[Array, Array | None]]


class Part(NamedTuple):
    """Hold a solution on one patch: coefficients (c, n_u, n_v, n_w) in a space, and the exact values.

    exact: a function of points (3, ...) that returns u (c, ...) and grad u (c, 3, ...), or None in place of the
    gradient.
    """

    volume: BSplineVolume
    space: TrialSpace
    coefficients: Array
    exact: Exact


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


def error_norms(parts: Sequence[Part], threads: int = 1) -> Errors:
    """Return error norms over the physical domain, over all patches and components together.

    The integrals use degree + 2 Gauss points a span and direction.
    """
    sums, has_gradient = np.zeros(4), True
    for part in parts:
        squares, known = _squares(*part, threads)
        sums += part.space.total(squares)
        has_gradient &= all(part.space.shared(known))
    l2, norm, seminorm, slope = np.sqrt(sums).tolist()
    if not has_gradient:
        return Errors(l2, ratio(l2, norm))
    return Errors(l2, ratio(l2, norm), seminorm, ratio(seminorm, slope))


def _squares(
    volume: BSplineVolume, space: TrialSpace, coefficients: Array, exact: Exact, threads: int
) -> tuple[Array, bool]:
    """Return the integrals of (u - u_h)^2, u^2, |grad u - grad u_h|^2, |grad u|^2, and whether the last are known."""
    whole, splines = gauss_rule(space, [p + 2 for p in space.degrees]), np.ascontiguousarray(coefficients)
    strips = [(rule, rule.tabulate(space.degrees, space.knots)) for rule in whole.strips(POINTS)]
    sums = np.zeros((whole.shape[0], 4))  # plane by plane: the same for any number of threads
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
    return sums.sum(axis=0), all(has_gradient)


def ratio(error: float, size: float) -> float | None:
    """Return the error over the size, None where the size is zero."""
    return error / size if size > 0.0 else None


def missing_mean(parts: Sequence[Part]) -> float:
    """Return the constant to add to a solution of one component for the mean of the exact values."""
    lack = size = 0.0
    for volume, space, coefficients, exact in parts:
        rule = gauss_rule(space)
        tables, spline = rule.tabulate(space.degrees, space.knots), np.ascontiguousarray(coefficients[0])
        plane = np.empty((4, *rule.plane_shape))
        here = of_one = 0.0
        with space.agreed():
            for q, _, measure, x in geometry_planes(volume, rule):
                kernels.evaluate_plane(spline, q, tables, plane)
                here += float(((exact(x)[0][0] - plane[0]) * np.abs(measure)).sum())
                of_one += float(np.abs(measure).sum())
        lack, size = lack + space.total(here), size + space.total(of_one)
    return float(lack / size)
