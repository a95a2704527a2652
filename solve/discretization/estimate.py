"""Estimates the error of a solution from its residual (docs/solver.md)."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import csr_array

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.interface import axis_side
from parameterize.spline.rational import Orders, quotients
from parameterize.spline.volume import AXES, UNITS, BSplineVolume

from ..field import Points
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.form import strong_form
from ..forms.frame import face_geometry
from ..forms.jets import PAIRS, SYMMETRIC, Jet
from .error_norms import Errors, ratio
from .face_data import has_face
from .quadrature import gauss_rule
from .space import TrialSpace

ON_FACE = np.linspace(0.05, 0.95, 7)  # parameters a direction at which Robin's alpha is evaluated
SIGNS = tuple(product((1.0,), (1.0, -1.0), (1.0, -1.0)))  # of the waves that make up a standing one
INSIDE = (-5, -3, -1)  # the axes of blocks that run over the points of a span

FIRST = UNITS
SECOND: tuple[Orders, ...] = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))  # in order of PAIRS


def error_estimate(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    problem: BoundaryValueProblem,
    energy: float | None = None,
) -> Errors | None:
    """Return the estimated error of a solution with coefficients (c, n_u, n_v, n_w), c components.

    energy: a(u_h, u_h) for a symmetric law whose given values are zero, otherwise None. With `energy`, the work of the
    loads on the error is the square of its energy norm, and an equal share of u_h is added to the estimate: discrete
    bodies in bending are too stiff by that share. The estimate is None where the residual does not suffice: in a space
    that is only continuous somewhere, whose derivatives jump; for a law with a caveat; and where the derivatives of the
    law's coefficients are unknown.
    """
    if space.is_only_continuous or problem.not_differentiable or problem.form.caveat:
        return None
    lowest = lowest_waves(volume, problem)
    sums = np.zeros(3)  # squares of the norms of the error, its energy norm, the norm of the solution
    with space.agreed():
        for squares in _inside(volume, space, coefficients, problem, lowest):
            sums += squares
        for face in filter(partial(has_face, space), problem.dirichlet):
            sums[0] += _from_face(volume, space, coefficients, problem, lowest, face)
    square, energy_of_error, norm = space.total(sums).tolist()
    norm = math.sqrt(norm)
    soft = norm * energy_of_error / energy if energy is not None and energy > 0.0 else 0.0
    l2 = math.hypot(math.sqrt(square), soft)
    return Errors(l2, ratio(l2, norm))


def _inside(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    problem: BoundaryValueProblem,
    lowest: Sequence[float],
) -> Iterator[tuple[float, float, float]]:
    """Yield the squared norms of the error, of its energy norm and of the solution, layer by layer in u."""
    rule, counts = gauss_rule(space), space.gauss_points
    bases = [
        [[collocation(knots[a], degrees[a], rule.points[a], order) for order in range(3)] for a in range(3)]
        for degrees, knots in ((space.degrees, space.knots), (volume.degrees, volume.knots))
    ]
    net = np.moveaxis(volume.control_points if volume.weights is None else volume.homogeneous, -1, 0)
    sizes, w_u, w_v, w_w = [np.diff(breaks) for breaks in space.breaks], *rule.weights
    for span, start in enumerate(range(0, rule.shape[0], counts[0])):
        layer = slice(start, start + counts[0])
        solution = _derivatives(bases[0], coefficients, layer)
        geometry = _divided(_derivatives(bases[1], net, layer))
        x = Points.of(geometry[0, 0, 0], (rule.points[0][layer], *rule.points[1:]))
        inverse, det = _inverse([geometry[order] for order in FIRST])
        residual = problem.source_at(x) - strong_form(problem.form, _jets(geometry, solution, inverse), x)
        weights = np.abs(det) * w_u[layer, None, None] * w_v[:, None] * w_w
        spans = _Spans.of(inverse, x, counts, (sizes[0][span : span + 1], *sizes[1:]))
        error = work = 0.0
        for oscillates, part in _parts(residual, counts):
            factor = _on_points(spans.factor(problem, oscillates, lowest))
            error += float(_integrals((part / factor) ** 2, weights, counts).sum())
            work += float(_integrals(part * (part / factor), weights, counts).sum())
        yield error, work, float((weights * solution[0, 0, 0] ** 2).sum())


def _from_face(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    problem: BoundaryValueProblem,
    lowest: Sequence[float],
    face: str,
) -> float:
    """Return the squared norm of the error inside that comes from given values of u outside of the space.

    A wave on a face, whose factor in the law is S, decays like exp(-k t) along the parameter t across the face, where
    k^2 times the factor of t's own direction is S.
    """
    axis, side = axis_side(face)
    counts = [1 if a == axis else degree + 2 for a, degree in enumerate(space.degrees)]
    rule, one = gauss_rule(space, counts), np.ones(1)
    u, v, w = (float(side) * one if a == axis else rule.points[a] for a in range(3))
    w_u, w_v, w_w = (one if a == axis else rule.weights[a] for a in range(3))
    sizes = [one if a == axis else np.diff(space.breaks[a]) for a in range(3)]
    found, x = coefficients, Points.on(volume, u, v, w)
    for a, row in enumerate((u, v, w)):
        found = apply_along(collocation(space.knots[a], space.degrees[a], row), found, a + 1)
    inverse, det = _inverse([np.moveaxis(volume.grid(u, v, w, order), -1, 0) for order in FIRST])
    weights = np.abs(det) * w_u[:, None, None] * w_v[:, None] * w_w
    has_area = _blocks(det != 0.0, counts).all(axis=INSIDE)  # a face may shrink to an edge or a point
    spans = _Spans.of(inverse, x, counts, sizes)
    across = _quadratic(problem.form.tensor(spans.middle), spans.slopes[axis])
    along = [0.0 if a == axis else k for a, k in enumerate(lowest)]
    total = 0.0
    for oscillates, part in _parts(problem.boundary_at(x, face) - found, counts):
        depth = 0.5 * np.sqrt(across / spans.factor(problem, oscillates, along))
        squares = _integrals(part**2, weights, counts) * np.minimum(depth, 1.0)
        total += float(squares[has_area].sum())
    return total


def lowest_waves(volume: BSplineVolume, problem: BoundaryValueProblem) -> list[float]:
    """Return for each direction the wave number, on [0, 1], of the slowest wave that the data on its two faces admit.

    The number is pi between two faces with given values, pi / 2 where one of the faces has a given flux, and 0 where
    both have a given flux. With Robin data, du/dn = -b u on a face, waves cos(k t - s) have k = arctan(b_0 / k) +
    arctan(b_1 / k).
    """
    found = []
    for axis in range(3):
        b = [_hold(volume, problem, axis, side) for side in (0, 1)]
        found.append(brentq(lambda k, b=b: k - np.arctan2(b, k).sum(), 0.0, np.pi) if any(b) else 0.0)
    return found


def _hold(volume: BSplineVolume, problem: BoundaryValueProblem, axis: int, side: int) -> float:
    """Return b of du/dn = -b u on a face, n a parameter: infinite where u is given, 0 where its flux is given.

    With Robin data b is an average of alpha over kappa, in the length of the parameter.
    """
    face = f"{AXES[axis]}{side}"
    if face in problem.dirichlet:
        return np.inf
    x, area = face_geometry(volume, (ON_FACE,) * 3, axis, side)
    if (factor := problem.factor_on(face, x)) is None:
        return 0.0
    u, v, w = (np.array([float(side)]) if a == axis else ON_FACE for a in range(3))
    tangent = np.moveaxis(np.squeeze(volume.grid(u, v, w, FIRST[axis]), axis), -1, 0)
    det = np.abs(_dot(area, tangent))
    alpha = factor * det * np.linalg.norm(area, axis=0)
    through = float(_quadratic(problem.form.tensor(x), area).sum())
    return float(alpha.sum()) / through if through > 0.0 else 0.0


@dataclass(frozen=True)
class _Spans:
    """Hold the spans of a grid: means of the gradients of the three parameters over each span, sizes and midpoints."""

    slopes: list[Array]  # (3, s_u, s_v, s_w) each
    sizes: list[Array]  # each of a shape that fits (s_u, s_v, s_w)
    middle: Points  # (3, s_u, s_v, s_w)

    @classmethod
    def of(cls, inverse: Sequence[Array], x: Points, counts: Sequence[int], sizes: Sequence[Array]) -> "_Spans":
        """Return the spans from the rows of J^-1 (3, ...) and points x (3, ...).

        counts: the number of points a span in each direction. sizes: the sizes of the spans in each direction.
        """
        u, v, w = (slice(n // 2, None, n) for n in counts)
        rows = [np.asarray(row)[part] for row, part in zip(x.rows or (), (u, v, w), strict=True)]
        size_u, size_v, size_w = sizes
        means = [_span_means(row, counts) for row in inverse]
        return cls(means, [size_u[:, None, None], size_v[:, None], size_w], Points.of(np.asarray(x)[:, u, v, w], rows))

    def factor(self, problem: BoundaryValueProblem, oscillates: Sequence[bool], lowest: Sequence[float]) -> Array:
        """Return the factor of the law (s_u, s_v, s_w) for waves of one period a span in the oscillating directions.

        lowest: the wave numbers in the other directions.
        """
        waves = [
            slope * (2.0 * np.pi / size if is_short else low)
            for slope, size, is_short, low in zip(self.slopes, self.sizes, oscillates, lowest, strict=True)
        ]
        least: Array = np.min([problem.form.symbol(_dot(signs, waves), self.middle) for signs in SIGNS], axis=0)
        return least


def _derivatives(bases: list[list[csr_array]], coefficients: Array, layer: slice) -> dict[Orders, Array]:
    """Return all derivatives up to second order, (c, q_u, q_v, q_w) each, of splines (c, n_u, n_v, n_w) on a layer."""
    found = {}
    for i in range(3):
        along_u = apply_along(bases[0][i][layer], coefficients, 1)
        for j in range(3 - i):
            along_v = apply_along(bases[1][j], along_u, 2)
            for k in range(3 - i - j):
                found[i, j, k] = apply_along(bases[2][k], along_v, 3)
    return found


def _divided(geometry: dict[Orders, Array]) -> dict[Orders, Array]:
    """Return the derivatives of a map, (3, ...) each, from its own or from those of its homogeneous components."""
    if len(geometry[0, 0, 0]) == 3:
        return geometry
    found = quotients(lambda order: np.moveaxis(geometry[order], 0, -1), list(geometry))
    return {order: np.moveaxis(part, -1, 0) for order, part in zip(geometry, found, strict=True)}


def _inverse(tangents: Sequence[Array]) -> tuple[list[Array], Array]:
    """Return the rows of J^-1, each (3, ...), and det J (...) from the columns of J."""
    cofactors = [np.cross(tangents[a - 2], tangents[a - 1], axis=0) for a in range(3)]
    det = (tangents[0] * cofactors[0]).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):  # det J may vanish on a face
        return [row / det for row in cofactors], det


def _jets(geometry: dict[Orders, Array], spline: dict[Orders, Array], inverse: Sequence[Array]) -> list[Jet]:
    """Return a spline's components as jets in space, from derivatives in the parameters and J^-1."""
    jets = []
    for component, value in enumerate(spline[0, 0, 0]):
        gradient = _dot(inverse, [spline[order][component] for order in FIRST])
        bent = [spline[order][component] - _dot(gradient, geometry[order]) for order in SECOND]
        rows = [_dot([bent[place] for place in SYMMETRIC[a]], inverse) for a in range(3)]  # H J^-1, each (3, ...)
        hessian = (_dot([row[i] for row in inverse], [row[j] for row in rows]) for i, j in PAIRS)
        jets.append(Jet(value, tuple(gradient), tuple(hessian)))
    return jets


def _parts(residual: Array, counts: Sequence[int]) -> Iterator[tuple[tuple[bool, ...], Array]]:
    """Yield the parts of a residual (c, q_u, q_v, q_w) that are constant on a span in some directions only.

    Each part comes with the directions in which it oscillates with mean zero. The part that is constant in all three
    directions is left out: it is almost zero for a Galerkin solution.
    """
    parts: dict[tuple[bool, ...], Array] = {(): _blocks(residual, counts)}
    for axis in INSIDE:
        means = {key: _mean(part, axis) for key, part in parts.items()}
        parts = {(*key, False): mean for key, mean in means.items()} | {
            (*key, True): part - means[key] for key, part in parts.items()
        }
    del parts[False, False, False]
    yield from parts.items()


def _blocks(field: Array, counts: Sequence[int]) -> Array:
    """Return a field (.., q_u, q_v, q_w) as (.., s_u, n_u, s_v, n_v, s_w, n_w), by spans and their points."""
    n_u, n_v, n_w = counts
    return field.reshape(*field.shape[:-3], -1, n_u, field.shape[-2] // n_v, n_v, field.shape[-1] // n_w, n_w)


def _mean(blocks: Array, axis: int) -> Array:
    """Return the mean over the Gauss points of one axis of blocks; the axis is kept with length 1."""
    return np.average(blocks, axis, np.polynomial.legendre.leggauss(blocks.shape[axis])[1], keepdims=True)


def _span_means(field: Array, counts: Sequence[int]) -> Array:
    """Return the means (.., s_u, s_v, s_w) of a field over the points of each span."""
    blocks = _blocks(field, counts)
    for axis in INSIDE:
        blocks = _mean(blocks, axis)
    return blocks.squeeze(INSIDE)


def _on_points(values: Array) -> Array:
    """Return values (s_u, s_v, s_w) of spans in the shape of blocks, with length 1 for the points."""
    return values[:, None, :, None, :, None]


def _integrals(field: Array, weights: Array, counts: Sequence[int]) -> Array:
    """Return the integrals (s_u, s_v, s_w) over spans of the sum over components of blocks (c, ...)."""
    found: Array = (_blocks(weights, counts) * field).sum(axis=(0, *INSIDE))
    return found


def _quadratic(tensor: Array, row: Array) -> Array:
    """Return row . T row (...) of a symmetric tensor's six entries (6, ...) and vectors (3, ...)."""
    return _dot(row, [_dot([tensor[place] for place in SYMMETRIC[i]], row) for i in range(3)])


def _dot(a: Sequence[Array] | Sequence[float] | Array, b: Sequence[Array] | Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
