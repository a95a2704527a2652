"""The error of a solution, estimated from its residual (docs/solver.md)."""

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import csr_array

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.volume import AXES, BSplineVolume

from ..field import Points
from ..forms.form import strong_form
from ..forms.frame import face_geometry
from ..forms.jets import PAIRS, SYMMETRIC, Jet
from ..forms.problem import BoundaryValueProblem
from .errors import Errors, ratio
from .quadrature import gauss_rule
from .space import TrialSpace, agreed

ON_FACE = np.linspace(0.05, 0.95, 7)  # parameters a direction at which Robin's alpha is looked at
SIGNS = tuple(product((1.0,), (1.0, -1.0), (1.0, -1.0)))  # of the waves that make up a standing one
INSIDE = (-5, -3, -1)  # the axes of blocks that run over the points of a span

Orders = tuple[int, int, int]
FIRST: tuple[Orders, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
SECOND: tuple[Orders, ...] = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))  # in order of PAIRS


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
    sizes, lowest = [np.diff(breaks) for breaks in space.breaks], lowest_waves(volume, problem)
    w_u, w_v, w_w = rule.weights
    sums = np.zeros(2)
    with agreed(space.comm):
        for span, start in enumerate(range(0, rule.shape[0], counts[0])):  # layer by layer of spans in u
            layer = slice(start, start + counts[0])
            solution = _derivatives(bases[0], coefficients, layer)
            geometry = _derivatives(bases[1], np.moveaxis(volume.control_points, -1, 0), layer)
            x = Points.of(geometry[0, 0, 0], (rule.points[0][layer], *rule.points[1:]))
            residual, inverse, det = _residual(geometry, solution, problem, x)
            weights = np.abs(det) * w_u[layer, None, None] * w_v[:, None] * w_w
            sums[1] += (weights * solution[0, 0, 0] ** 2).sum()
            slopes = [_span_means(row, counts) for row in inverse]  # each (3, 1, s_v, s_w)
            spacing = sizes[0][span], sizes[1][:, None], sizes[2]
            middle = _middle(x, counts)
            for oscillates, part in _parts(residual, counts):
                waves = [slopes[a] * (2.0 * np.pi / spacing[a] if oscillates[a] else lowest[a]) for a in range(3)]
                factor = np.min([problem.form.symbol(_dot(signs, waves), middle) for signs in SIGNS], axis=0)
                squares = (_blocks(weights, counts) * part**2).sum(axis=(0, *INSIDE))
                sums[0] += (squares / factor**2).sum()
    l2, norm = np.sqrt(space.total(sums)).tolist()
    return Errors(l2, ratio(l2, norm))


def lowest_waves(volume: BSplineVolume, problem: BoundaryValueProblem) -> list[float]:
    """Return for each direction the wave number, on [0, 1], of the slowest wave that the data on its two faces admit.

    Between two faces with given values that is pi; pi / 2 where one of them has a given flux, 0 where both have. With
    Robin's data, du/dn = -b u on a face, waves cos(k t - s) have k = arctan(b_0 / k) + arctan(b_1 / k).
    """
    found = []
    for axis in range(3):
        b = [_hold(volume, problem, axis, side) for side in (0, 1)]
        found.append(brentq(lambda k, b=b: k - np.arctan2(b, k).sum(), 0.0, np.pi) if any(b) else 0.0)
    return found


def _hold(volume: BSplineVolume, problem: BoundaryValueProblem, axis: int, side: int) -> float:
    """Return b of du/dn = -b u on a face, n a parameter: infinite where u is given, 0 where its flux is.

    With Robin's data it is an average of alpha over kappa, in the length of the parameter.
    """
    face = f"{AXES[axis]}{side}"
    if face in problem.dirichlet:
        return np.inf
    if (role := f"robin {face}: alpha") not in problem.data:
        return 0.0
    x, area = face_geometry(volume, (ON_FACE,) * 3, axis, side)
    order: Orders = FIRST[axis]
    u, v, w = (np.array([float(side)]) if a == axis else ON_FACE for a in range(3))
    tangent = np.moveaxis(np.squeeze(volume.grid(u, v, w, order), axis), -1, 0)
    tensor = problem.form.tensor(x)
    through = sum(area[i] * area[j] * tensor[SYMMETRIC[i][j]] for i in range(3) for j in range(3))
    det = np.abs(_dot(area, tangent))
    return float((problem.data[role](x)[0] * det * np.linalg.norm(area, axis=0)).sum() / np.sum(through))


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


def _residual(
    geometry: dict[Orders, Array], spline: dict[Orders, Array], problem: BoundaryValueProblem, x: Points
) -> tuple[Array, list[Array], Array]:
    """Return source less law (c, ...), the rows of J^-1, each (3, ...), and det J (...) at the points of a layer."""
    tangents = [geometry[order] for order in FIRST]
    cofactors = [np.cross(tangents[a - 2], tangents[a - 1], axis=0) for a in range(3)]
    det = (tangents[0] * cofactors[0]).sum(axis=0)
    inverse = [row / det for row in cofactors]
    jets = []
    for component, value in enumerate(spline[0, 0, 0]):
        gradient = _dot(inverse, [spline[order][component] for order in FIRST])
        bent = [spline[order][component] - _dot(gradient, geometry[order]) for order in SECOND]
        rows = [_dot([bent[place] for place in SYMMETRIC[a]], inverse) for a in range(3)]  # H J^-1, each (3, ...)
        hessian = (_dot([row[i] for row in inverse], [row[j] for row in rows]) for i, j in PAIRS)
        jets.append(Jet(value, tuple(gradient), tuple(hessian)))
    return problem.source_at(x) - strong_form(problem.form, jets, x), inverse, det


def _parts(residual: Array, counts: Sequence[int]) -> Iterator[tuple[tuple[bool, ...], Array]]:
    """Yield the parts of a residual (c, q_u, q_v, q_w) that are constant on a span in some directions only.

    With each comes in which directions it oscillates, its mean there being zero. What is constant in all three is left
    out: a Galerkin solution has hardly any of it.
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
    """Return (.., s_u, n_u, s_v, n_v, s_w, n_w), spans and their points, of a field (.., q_u, q_v, q_w)."""
    n_u, n_v, n_w = counts
    return field.reshape(*field.shape[:-3], -1, n_u, field.shape[-2] // n_v, n_v, field.shape[-1] // n_w, n_w)


def _mean(blocks: Array, axis: int) -> Array:
    """Return the mean over the Gauss points of an axis of blocks, which stays."""
    return np.average(blocks, axis, np.polynomial.legendre.leggauss(blocks.shape[axis])[1], keepdims=True)


def _span_means(field: Array, counts: Sequence[int]) -> Array:
    """Return the means (.., s_u, s_v, s_w) over the points of each span."""
    blocks = _blocks(field, counts)
    for axis in INSIDE:
        blocks = _mean(blocks, axis)
    return blocks.squeeze(INSIDE)


def _middle(x: Points, counts: Sequence[int]) -> Points:
    """Return a point in the middle of each span: (3, s_u, s_v, s_w)."""
    u, v, w = (slice(n // 2, None, n) for n in counts)
    rows = x.rows or ()
    return Points.of(np.asarray(x)[:, u, v, w], [row[part] for row, part in zip(rows, (u, v, w), strict=True)])


def _dot(a: Sequence[Array] | Array, b: Sequence[Array] | Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
