"""Computes the errors of a solution against an exact solution."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..field import Points
from . import group_kernels, kernels
from .error_kernels import error_squares
from .processes import Processes
from .quadrature import GaussRule, gauss_rule, map_rows
from .space import TrialSpace
from .stack import PatchStack, Piece, Stacked, stacks_of

PLANES = 16  # of points of u, in a piece of work
POINTS = 2**16  # of a plane that are evaluated at once: with fewer, threads wait for each other too often


Exact = Callable[[Array], tuple[Array, Array | None]]


class Compared(NamedTuple):
    """Hold a solution on one patch: coefficients (c, n_u, n_v, n_w) in a space, and the exact values.

    exact: a function of points (3, ...) that returns u (c, ...) and grad u (c, 3, ...), or None in place of the
    gradient. same: equal for patches on which `exact` is the same function of the points; by default it is its own.
    """

    volume: BSplineVolume
    space: TrialSpace
    coefficients: Array
    exact: Exact
    same: Hashable = None


@dataclass(frozen=True)
class Errors:
    """Hold the L2 norm and the H1 seminorm of u - u_h, and their ratios to the norms of u.

    The relative errors are None where u or its gradient is zero, both H1 numbers where the gradient of u is unknown. An
    estimate is relative to u_h, and has no H1 numbers. energy_relative: the energy norm of an estimated error over that
    of u_h; None where the law has no energy.
    """

    l2: float
    l2_relative: float | None
    h1_seminorm: float | None = None
    h1_relative: float | None = None
    energy_relative: float | None = None


def error_norms(parts: Sequence[Compared], threads: int = 1, processes: Processes | None = None) -> Errors:
    """Return error norms over the physical domain, over all patches and components together.

    The integrals use degree + 2 Gauss points a span and direction. processes: those that share the body; by default
    those of the first patch.
    """
    sums, has_gradient, processes = np.zeros(4), True, processes or parts[0].space
    rules: dict[Any, GaussRule] = {}
    stacked = [_stacked(part, rules, [degree + 2 for degree in part.space.degrees]) for part in parts]
    for numbers, stack in stacks_of(stacked, threads):
        own = [parts[number] for number in numbers]
        squares, known = _squares(*own[0][:4], threads) if len(own) == 1 else _squares_of_stack(stack, own)
        sums += squares
        has_gradient &= known
    l2, norm, seminorm, slope = np.sqrt(processes.total(sums)).tolist()
    has_gradient = all(processes.shared(has_gradient))
    if not has_gradient:
        return Errors(l2, ratio(l2, norm))
    return Errors(l2, ratio(l2, norm), seminorm, ratio(seminorm, slope))


def _stacked(part: Compared, rules: dict[Any, GaussRule], counts: Sequence[int] | None = None) -> Stacked:
    """Return a patch with the Gauss rule of `gauss_rule`, which is the same object for equal knots."""
    space = part.space
    key = tuple(row.tobytes() for row in (*space.whole.knots, *space.breaks)), space.degrees
    if key not in rules:
        rules[key] = gauss_rule(space, counts)
    return Stacked(part.volume, space, rules[key], part.exact if part.same is None else part.same)


def _squares_of_stack(stack: PatchStack, parts: Sequence[Compared]) -> tuple[Array, bool]:
    """Return the sums of `_squares` over several patches of one shape."""
    coefficients = np.stack([part.coefficients for part in parts])
    sums, has_gradient = np.zeros((len(parts), stack.shape[0], 4)), []

    def integrate(piece: Piece) -> None:
        patches, _ = piece
        shape = (len(patches), len(coefficients[0]))
        fields, slopes = np.empty((*shape, 4, *stack.plane_shape)), np.empty((*shape, 3, *stack.plane_shape))
        for q, rows, measure, x in stack.geometry(piece):
            group_kernels.evaluate_splines(coefficients, patches, stack.kinds[patches], q, stack.tables, fields)
            group_kernels.turn_fields(rows, fields[:, :, 1:], slopes, False)  # times the root of the measure
            values, gradients = parts[patches[0]].exact(x)
            size = np.abs(measure)[:, None]
            exact = np.moveaxis(values.reshape(shape[1], -1, *stack.plane_shape), 1, 0)
            found = [size * (exact - fields[:, :, 0]) ** 2, size * exact**2]
            if gradients is not None:
                grad = np.moveaxis(gradients.reshape(shape[1], 3, -1, *stack.plane_shape), 2, 0)
                grad = grad * np.sqrt(size)[:, None]
                found += [(grad - slopes) ** 2, grad**2]
            has_gradient.append(gradients is not None)
            for i, squares in enumerate(found):
                sums[patches, q, i] = squares.reshape(len(patches), -1).sum(axis=1)

    stack.on_pieces(integrate)
    return sums.sum(axis=(0, 1)), all(has_gradient)


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


def missing_mean(parts: Sequence[Compared], processes: Processes) -> float:
    """Return the constant to add to a solution of one component for the mean of the exact values.

    processes: those that share the body.
    """
    lack = size = 0.0
    rules: dict[Any, GaussRule] = {}
    for numbers, stack in stacks_of([_stacked(part, rules) for part in parts], 1):
        own = [parts[number] for number in numbers]
        splines = np.stack([part.coefficients[:1] for part in own])
        here, of_one = np.zeros((2, len(own), stack.shape[0]))

        def integrate(piece: Piece) -> None:
            patches, _ = piece
            plane = np.empty((len(patches), 1, 4, *stack.plane_shape))  # noqa: B023  # called in this turn of the loop
            for q, _, measure, x in stack.geometry(piece):  # noqa: B023
                kinds, tables = stack.kinds[patches], stack.tables  # noqa: B023
                group_kernels.evaluate_splines(splines, patches, kinds, q, tables, plane)  # noqa: B023
                values = own[patches[0]].exact(x)[0][0].reshape(measure.shape)  # noqa: B023
                weights = np.abs(measure)
                here[patches, q] = ((values - plane[:, 0, 0]) * weights).sum(axis=(1, 2))  # noqa: B023
                of_one[patches, q] = weights.sum(axis=(1, 2))  # noqa: B023

        with stack.space.agreed():
            stack.on_pieces(integrate)
        lack, size = lack + float(here.sum()), size + float(of_one.sum())
    return float(processes.total(lack) / processes.total(size))
