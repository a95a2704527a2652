"""Computes the residual of a solution, span by span: inside, at interfaces, and on outer faces.

For tests v the residual is a sum of integrals, of r . v inside and of j . v over faces:

    r = f + div flux(u_h) - react(u_h),   j = -(flux . n of both sides) at interfaces,   j = g - alpha u_h - flux . n.

Patches with equal knots, law and data are a group, whose arrays are one: a `Residual`.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.interface import axis_side
from parameterize.spline.rational import Orders, quotients
from parameterize.spline.volume import UNITS, BSplineVolume

from ..field import Points
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.form import Form, strong_form
from ..forms.jets import PAIRS, SYMMETRIC, Jet
from .quadrature import gauss_rule
from .space import TrialSpace

POINTS = 2**15  # of a piece of patches: the arrays of its jets stay small
FIRST = UNITS
SECOND: tuple[Orders, ...] = ((2, 0, 0), (1, 1, 0), (1, 0, 1), (0, 2, 0), (0, 1, 1), (0, 0, 2))  # in order of PAIRS
INSIDE = (-5, -3, -1)  # the axes of blocks that run over the points of a span

Ends = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Solved:
    """Hold a solution on a patch, or on a part of one between knots at which its space is only continuous.

    coefficients: (c, n_u, n_v, n_w). regions: the names of the faces on which conditions on regions act. is_own:
    whether this process integrates over it. ends: the parameters of the patch at which a part begins and ends.
    """

    volume: BSplineVolume
    space: TrialSpace
    problem: BoundaryValueProblem
    coefficients: Array
    regions: Collection[str] = ()
    is_own: bool = True
    ends: tuple[Ends, Ends, Ends] = ((0.0, 1.0),) * 3


@dataclass(frozen=True, eq=False)
class Spans:
    """Hold the spans of k patches: means of the gradients of the three parameters over each, and their middles."""

    slopes: list[Array]  # (3, k, s_u, s_v, s_w) each
    middle: Points  # (3, k, s_u, s_v, s_w)

    @classmethod
    def of(cls, inverse: Sequence[Array], x: Points, counts: Sequence[int]) -> "Spans":
        """Return the spans from the rows of J^-1 and points x (3, k, ...), `counts` of them a span."""
        u, v, w = (slice(n // 2, None, n) for n in counts)
        means = [span_means(row, counts) for row in inverse]
        middle = np.asarray(x)[..., u, v, w]
        if x.rows is None:
            return cls(means, middle.view(Points))
        rows = [np.asarray(row)[part] for row, part in zip(x.rows, (u, v, w), strict=True)]
        return cls(means, Points.of(middle, rows))


@dataclass(frozen=True, eq=False)
class Inside:
    """Hold the residual (c, k, q_u, q_v, q_w) of a piece: some of the patches, and one layer of their spans in u.

    u: the solution, of the same shape. weights: (k, q_u, q_v, q_w), of integrals in space. places: (k,), the patches'
    places in the residual. layer: the spans.
    """

    residual: Array
    u: Array
    weights: Array
    spans: Spans
    places: IntArray
    layer: slice


@dataclass(frozen=True, eq=False)
class OnFace:
    """Hold a solution on one face of k patches; the points (q_u, q_v, q_w) are one in the direction across.

    places: (k,), the patches' places in their residual. counts: of points a span and direction. u: (c, k, ...). slopes:
    its three derivatives in the parameters. inverse: the rows of J^-1. x, normal: (3, k, ...), outward and of length 1.
    area, volume: (k, ...), the weights of integrals over the surface, and those of a layer of depth 1 in the parameter
    across. has_area: (k, s_u, s_v, s_w), whether the map does not shrink a span of the face to an edge or a point.
    """

    face: str
    places: IntArray
    counts: list[int]
    u: Array
    slopes: list[Array]
    inverse: list[Array]
    x: Points
    normal: Array
    area: Array
    volume: Array
    has_area: Mask
    spans: Spans

    @property
    def axis(self) -> int:
        """Return the direction across the face."""
        return axis_side(self.face)[0]

    def flux(self, form: Form) -> Array:
        """Return the flux (c, k, ...) out of the patches; it may be NaN where the map shrinks the face."""
        with np.errstate(invalid="ignore"):
            grad = np.stack([dot(self.inverse, [slope[c] for slope in self.slopes]) for c in range(len(self.u))])
            flux = np.asarray(form.whole_flux(self.u, grad, self.x), dtype=np.float64)
            return np.asarray((flux * self.normal).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Residual:
    """Hold the solutions on a group of k patches, from which their residual follows.

    numbers: (k,), of the patches. patches: themselves. coefficients: (c, k, n_u, n_v, n_w). net: (3 or 4, k, ...), the
    control points, homogeneous ones of rational maps.
    """

    numbers: IntArray
    patches: Sequence[Solved]
    coefficients: Array
    net: Array

    @classmethod
    def of(cls, numbers: Sequence[int], patches: Sequence[Solved]) -> "Residual":
        """Return the group of the patches with these numbers, for which `residuals_of` says what is equal."""
        own = [patches[number] for number in numbers]
        nets = [p.volume.control_points if p.volume.weights is None else p.volume.homogeneous for p in own]
        stacked = np.moveaxis(np.stack(nets), -1, 0)
        return cls(np.array(numbers), own, np.stack([p.coefficients for p in own], axis=1), stacked)

    @property
    def space(self) -> TrialSpace:
        """Return the space, which is that of each patch but for the data on its faces."""
        return self.patches[0].space

    @property
    def is_own(self) -> bool:
        """Return whether this process integrates over the patches."""
        return self.patches[0].is_own

    @property
    def problem(self) -> BoundaryValueProblem:
        """Return a problem with the law and the data in the volume of each patch."""
        return self.patches[0].problem

    def inside(self) -> Iterator[Inside]:
        """Yield the residual inside the patches, piece by piece."""
        rule, counts = gauss_rule(self.space), self.space.gauss_points
        spline, geometry = self._bases(rule.points)
        w_u, w_v, w_w = rule.weights
        size = max(1, POINTS // (counts[0] * rule.shape[1] * rule.shape[2]))
        places = np.arange(len(self.numbers))
        pieces = [slice(first, first + size) for first in range(0, len(places), size)]
        for number, start in enumerate(range(0, rule.shape[0], counts[0])):
            layer = slice(start, start + counts[0])
            rows = [rule.points[0][layer], *rule.points[1:]]
            for piece in pieces:
                solution = _derivatives(spline, self.coefficients[:, piece], layer)
                of_map = _divided(_derivatives(geometry, self.net[:, piece], layer))
                x = self._points(of_map[0, 0, 0], rows, places[piece])
                inverse, det = _inverse([of_map[order] for order in FIRST])
                problem = self.problem
                residual = problem.source_at(x) - strong_form(problem.form, _jets(of_map, solution, inverse), x)
                weights = np.abs(det) * w_u[layer, None, None] * w_v[:, None] * w_w
                spans = Spans.of(inverse, x, counts)
                yield Inside(residual, solution[0, 0, 0], weights, spans, places[piece], slice(number, number + 1))

    def on_face(self, face: str, places: IntArray) -> OnFace:
        """Return the solution on a face of the patches at some places."""
        axis, side = axis_side(face)
        counts = [1 if a == axis else degree + 2 for a, degree in enumerate(self.space.degrees)]
        rule, one = gauss_rule(self.space, counts), np.ones(1)
        rows = [float(side) * one if a == axis else rule.points[a] for a in range(3)]
        w_u, w_v, w_w = (one if a == axis else rule.weights[a] for a in range(3))
        spline, geometry = self._bases(rows)
        solution = _on_grid(spline, self.coefficients[:, places], range(3))
        shortest = sorted(range(3), key=lambda a: len(rows[a]))  # least work first
        of_map = _divided(_on_grid(geometry, self.net[:, places], shortest))
        x = self._points(of_map[0, 0, 0], rows, places)
        cofactors, det = _cofactors([of_map[order] for order in FIRST])
        inverse = _rows(cofactors, det)
        element = np.linalg.norm(cofactors[axis], axis=0)
        outward = np.sign(det) if side else -np.sign(det)
        normal = outward * cofactors[axis] / np.where(element > 0.0, element, 1.0)
        area, volume = (part * w_u[:, None, None] * w_v[:, None] * w_w for part in (element, np.abs(det)))
        has_area = np.asarray(blocks(det != 0.0, counts).all(axis=INSIDE))
        spans = Spans.of([np.where(det != 0.0, row, 1.0) for row in inverse], x, counts)
        u, slopes = solution[0, 0, 0], [solution[order] for order in FIRST]
        return OnFace(face, places, counts, u, slopes, inverse, x, normal, area, volume, has_area, spans)

    def _points(self, x: Array, rows: Sequence[Array], places: IntArray) -> Points:
        """Return points (3, k, ...), with parameters where they are those of one patch."""
        if len(places) > 1:
            return x.view(Points)
        ends = zip(rows, self.patches[places[0]].ends, strict=True)
        return Points.of(x, [low + (high - low) * row for row, (low, high) in ends])

    def _bases(self, rows: Sequence[Array]) -> list[list[list[csr_array]]]:
        """Return the values and two derivatives of the functions of the space and of the map at parameters."""
        return [
            [[collocation(knots[a], degrees[a], rows[a], order) for order in range(3)] for a in range(3)]
            for degrees, knots in (
                (self.space.degrees, self.space.knots),
                (self.patches[0].volume.degrees, self.patches[0].volume.knots),
            )
        ]


def residuals_of(patches: Sequence[Solved]) -> list[Residual]:
    """Return the residuals of the patches in groups of equal spaces, knots of the map, law and data in the volume."""
    members = defaultdict(list)
    for number, patch in enumerate(patches):
        rows = (row.tobytes() for row in (*patch.space.knots, *patch.volume.knots))
        spline = patch.space.degrees, patch.volume.degrees, *rows, patch.volume.weights is None
        members[patch.is_own, *spline, patch.problem.in_volume, patch.problem.has_fields and patch.ends].append(number)
    return [Residual.of(numbers, patches) for numbers in members.values()]


def _derivatives(bases: list[list[csr_array]], coefficients: Array, layer: slice) -> dict[Orders, Array]:
    """Return all derivatives up to second order, (c, k, q_u, q_v, q_w) each, of k splines on a layer of points in u."""
    found = {}
    for i in range(3):
        along_u = apply_along(bases[0][i][layer], coefficients, 2)
        for j in range(3 - i):
            along_v = apply_along(bases[1][j], along_u, 3)
            for k in range(3 - i - j):
                found[i, j, k] = apply_along(bases[2][k], along_v, 4)
    return found


def _on_grid(bases: list[list[csr_array]], coefficients: Array, axes: Iterable[int]) -> dict[Orders, Array]:
    """Return values and first derivatives, (c, k, q_u, q_v, q_w) each, of k splines, from one direction to the next."""
    found = {}
    for order in ((0, 0, 0), *FIRST):
        part = coefficients
        for a in axes:
            part = apply_along(bases[a][order[a]], part, a + 2)
        found[order] = part
    return found


def _divided(geometry: dict[Orders, Array]) -> dict[Orders, Array]:
    """Return the derivatives of a map, (3, ...) each, from its own or from those of its homogeneous components."""
    if len(geometry[0, 0, 0]) == 3:
        return geometry
    found = quotients(lambda order: np.moveaxis(geometry[order], 0, -1), list(geometry))
    return {order: np.moveaxis(part, -1, 0) for order, part in zip(geometry, found, strict=True)}


def _inverse(tangents: Sequence[Array]) -> tuple[list[Array], Array]:
    """Return the rows of J^-1, each (3, ...), and det J (...) from the columns of J."""
    cofactors, det = _cofactors(tangents)
    return _rows(cofactors, det), det


def _cofactors(tangents: Sequence[Array]) -> tuple[list[Array], Array]:
    """Return the rows of det J J^-1, each (3, ...), and det J (...) from the columns of J."""
    cofactors = [np.cross(tangents[a - 2], tangents[a - 1], axis=0) for a in range(3)]
    return cofactors, (tangents[0] * cofactors[0]).sum(axis=0)


def _rows(cofactors: Sequence[Array], det: Array) -> list[Array]:
    """Return the rows of J^-1, each (3, ...)."""
    with np.errstate(divide="ignore", invalid="ignore"):  # det J may vanish on a face
        return [row / det for row in cofactors]


def _jets(geometry: dict[Orders, Array], spline: dict[Orders, Array], inverse: Sequence[Array]) -> list[Jet]:
    """Return a spline's components as jets in space, from derivatives in the parameters and J^-1."""
    jets = []
    for component, value in enumerate(spline[0, 0, 0]):
        gradient = dot(inverse, [spline[order][component] for order in FIRST])
        bent = [spline[order][component] - dot(gradient, geometry[order]) for order in SECOND]
        rows = [dot([bent[place] for place in SYMMETRIC[a]], inverse) for a in range(3)]  # H J^-1, each (3, ...)
        hessian = (dot([row[i] for row in inverse], [row[j] for row in rows]) for i, j in PAIRS)
        jets.append(Jet(value, tuple(gradient), tuple(hessian)))
    return jets


def blocks(field: Array, counts: Sequence[int]) -> Array:
    """Return a field (.., q_u, q_v, q_w) as (.., s_u, n_u, s_v, n_v, s_w, n_w), by spans and their points."""
    n_u, n_v, n_w = counts
    return field.reshape(*field.shape[:-3], -1, n_u, field.shape[-2] // n_v, n_v, field.shape[-1] // n_w, n_w)


def mean(blocks: Array, axis: int) -> Array:
    """Return the mean over the Gauss points of one axis of blocks; the axis is kept with length 1."""
    return np.average(blocks, axis, np.polynomial.legendre.leggauss(blocks.shape[axis])[1], keepdims=True)


def span_means(field: Array, counts: Sequence[int]) -> Array:
    """Return the means (.., s_u, s_v, s_w) of a field over the points of each span."""
    found = blocks(field, counts)
    for axis in INSIDE:
        found = mean(found, axis)
    return found.squeeze(INSIDE)


def dot(a: Sequence[Array] | Sequence[float] | Array, b: Sequence[Array] | Array) -> Array:
    """Return the sum of three products of arrays."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def quadratic(tensor: Array, row: Array) -> Array:
    """Return row . T row (...) of a symmetric tensor's six entries (6, ...) and vectors (3, ...)."""
    return dot(row, [dot([tensor[place] for place in SYMMETRIC[i]], row) for i in range(3)])
