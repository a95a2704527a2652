"""Computes the errors of a solution against an exact solution."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..field import Points
from . import kernels
from .error_kernels import error_squares
from .quadrature import GaussRule, gauss_rule, geometry_planes, map_rows
from .space import TrialSpace

PLANES = 16  # of points of u, in a piece of work
POINTS = 2**15  # of a plane that are evaluated at once: their arrays fit into a processor's cache


Exact = Callable[[Array], tuple[Array, Array | None]]


class Compared(NamedTuple):
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


def error_norms(parts: Sequence[Compared], threads: int = 1) -> Errors:
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


@dataclass(frozen=True, eq=False)
class _Strip:
    """Hold some rows of the points of every plane: their rule, the tables of w for the map and for u_h, and weights.

    weights: (q_w, q_v), without those of u.
    """

    rule: GaussRule
    of_map: kernels.Table
    of_space: kernels.Table
    weights: Array

    @classmethod
    def of(cls, rule: GaussRule, volume: BSplineVolume, space: TrialSpace) -> "_Strip":
        """Return the strip with the points of a rule."""
        of_map, of_space = (rule.tabulate(own.degrees, own.knots)[2] for own in (volume, space))
        return cls(rule, of_map, of_space, np.multiply.outer(rule.weights[2], rule.weights[1]))

    def points(self, lines: Array, q: int) -> Points:
        """Return the points (3, q_w, q_v) in space from the lines (3 or 4, 3, n_w, q_v) of a map in plane q."""
        first, basis, functions = self.of_map
        x = np.empty((len(lines), *self.weights.shape))
        for line, out in zip(lines, x, strict=True):
            kernels.contract(first, basis[0], functions, line[0], out)
        u, v, w = self.rule.points
        return Points.of(x if len(x) == 3 else x[:3] / x[3], (u[q : q + 1], v, w), (2, 1))


def _squares(
    volume: BSplineVolume, space: TrialSpace, coefficients: Array, exact: Exact, threads: int
) -> tuple[Array, bool]:
    """Return the integrals of (u - u_h)^2, u^2, |grad u - grad u_h|^2, |grad u|^2, and whether the last are known."""
    rule, splines = gauss_rule(space, [p + 2 for p in space.degrees]), np.ascontiguousarray(coefficients)
    strips = [_Strip.of(strip, volume, space) for strip in rule.strips(POINTS)]
    tables, sums = rule.tabulate(space.degrees, space.knots), np.zeros((rule.shape[0], 4))
    has_gradient = []

    def integrate(points: range) -> None:
        for q, net, of_map in map_rows(volume, rule, points):
            geometry, found = _lines(net, q, of_map, rule), _lines(splines, q, tables, rule)
            weight = geometry[3] if len(geometry) > 3 else None
            for strip in strips:
                values, gradients = exact(strip.points(geometry, q))
                has_gradient.append(gradients is not None)
                for c, own in enumerate(found):
                    slopes = None if gradients is None else gradients[c]
                    map_and_spline = geometry, weight, strip.of_map, own, strip.of_space
                    sums[q] += error_squares(*map_and_spline, strip.weights, values[c], slopes)

    planes = range(rule.shape[0])
    with space.agreed():
        in_parallel(integrate, [planes[start : start + PLANES] for start in planes[::PLANES]], threads)
    return rule.weights[0] @ sums, all(has_gradient)  # plane by plane: the same for any number of threads


def _lines(splines: Array, q: int, tables: kernels.Tables, rule: GaussRule) -> Array:
    """Return splines (k, n_u, n_v, n_w) contracted in u and v on plane q, (k, 3, n_w, q_v): see `evaluate_lines`."""
    found = np.empty((len(splines), 3, splines.shape[3], rule.shape[1]))
    for spline, lines in zip(splines, found, strict=True):
        kernels.evaluate_lines(spline, q, tables, lines)
    return found


def ratio(error: float, size: float) -> float | None:
    """Return the error over the size, None where the size is zero."""
    return error / size if size > 0.0 else None


def missing_mean(parts: Sequence[Compared]) -> float:
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
