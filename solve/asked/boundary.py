"""Evaluates a solution and its adjoint, and the data of the problem, at Gauss points all over a body's boundary."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body
from parameterize.spline.bspline import breakpoints, gauss_points
from parameterize.spline.orientation import FACES
from parameterize.spline.volume import FACE_NAMES

from ..discretization.on_regions import Acting, codes_on
from ..field import BodyField, Points
from ..field_groups import FieldGroup, groups_of
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.conditions import Pressure
from ..forms.form import Quantity, reaction
from ..quantities import at_places
from ..solution import Solution

STEP = 1e-5  # of the body's size: the difference of data by which their slope is found
MOST = 2**15  # points at once
FLAT = 0.3  # sine of the angle between a face and the parameter line across: below it normal derivatives are poor


@dataclass(frozen=True, eq=False)
class Values:
    """Hold a function at m points: values and reaction (c, m), gradient and flux (c, 3, m), a pressure (m,) if any."""

    u: Array
    grad: Array
    flux: Array
    reaction: Array
    pressure: Array | None


@dataclass(frozen=True, eq=False)
class Given:
    """Hold the data at m points of the boundary, and how they change along the outward normal.

    projector: (c, c, m), onto the directions along which u is given. value_slope: (c, m), of the values there. loads,
    load_slope: (c, m), the flux into a body with u = 0, outside of the projector. factor, factor_slope: (c, c, m), of u
    in an exchange. pressure: (m,), which acts along the normal. pressure_slope: (3, m), its gradient.
    """

    projector: Array
    value_slope: Array
    loads: Array
    load_slope: Array
    factor: Array
    factor_slope: Array
    pressure: Array
    pressure_slope: Array


@dataclass(frozen=True, eq=False)
class BoundaryPiece:
    """Hold m Gauss points of outer faces of one name, of patches with equal knots, law and data.

    group: the patches, with the solution. rows: (m,), the patch of each point in it.
    places: (m, 3), parameters. x, normal: (3, m), points and outward unit normals. weights: (m,), of
    integrals over the surface. curvature: (m,), the sum of the principal ones, positive on a sphere. elements: (m,),
    numbers of the spans, from 0. u: a solution. z: adjoints. source: (c, m).
    """

    group: FieldGroup
    rows: IntArray
    places: Array
    x: Points
    normal: Array
    weights: Array
    curvature: Array
    elements: IntArray
    u: Values
    z: tuple[Values, ...]
    source: Array
    given: Given

    def of_solution(self, quantity: Quantity) -> Array:
        """Return a quantity (..., m) of the solution."""
        x = Points.at(np.ascontiguousarray(self.x), self.places)
        x.pressure = self.u.pressure
        return np.asarray(quantity(self.u.u, self.u.grad, x), dtype=np.float64)


def pieces_of(solution: Solution, adjoints: Sequence[BodyField]) -> Iterator[BoundaryPiece]:
    """Yield the points of the whole boundary, with degree + 2 Gauss points a span and direction."""
    body, problems = solution.body, [patch.problem for patch in solution.patches]
    for group, *of_z in zip(*(groups_of(field, body, problems) for field in (solution, *adjoints)), strict=True):
        for face in range(len(FACES)):
            outer = np.flatnonzero(~body.glued[group.numbers, face])
            for places in _alike(outer, [problems[number] for number in group.numbers], FACE_NAMES[face]):
                grid = _FaceGrid.of(group, face)
                step = max(1, MOST // len(grid.weights))
                for start in range(0, len(places), step):
                    yield _piece(body, problems, group, of_z, grid, places[start : start + step])


def _alike(places: IntArray, problems: Sequence[BoundaryValueProblem], name: str) -> Iterator[IntArray]:
    """Yield the places of patches with the same data on the face of a name."""
    found: dict[Hashable, list[int]] = defaultdict(list)
    for place in places.tolist():
        problem = problems[place]
        found[problem.on_regions, problem.in_volume, None if problem.conditions else problem.key_on(name)].append(place)
    yield from map(np.array, found.values())


@dataclass(frozen=True, eq=False)
class _FaceGrid:
    """Hold the Gauss points of a face: parameters (q, 3), weights (q,) there and the numbers (q,) of their spans."""

    face: int
    parameters: Array
    weights: Array
    spans: IntArray

    @classmethod
    def of(cls, group: FieldGroup, face: int) -> "_FaceGrid":
        """Return the points of a face, one of FACES."""
        axis, side = FACES[face]
        (t, of_t), (s, of_s) = (
            gauss_points(group.values.knots[a], group.values.degrees[a] + 2) for a in range(3) if a != axis
        )
        across = np.stack(np.meshgrid(t.ravel(), s.ravel(), indexing="ij"), axis=-1).reshape(-1, 2)
        rows, columns = (np.repeat(np.arange(len(one)), one.shape[1]) for one in (t, s))
        spans = rows[:, None] * len(s) + columns
        weights = np.multiply.outer(of_t.ravel(), of_s.ravel()).ravel()
        return cls(face, np.insert(across, axis, float(side), axis=1), weights, spans.ravel())


def _piece(
    body: Body,
    problems: Sequence[BoundaryValueProblem],
    group: FieldGroup,
    of_z: Sequence[FieldGroup],
    grid: _FaceGrid,
    chosen: IntArray,
) -> BoundaryPiece:
    """Return the points on the faces of the chosen patches of a group."""
    owners, where = np.repeat(chosen, len(grid.weights)), np.tile(grid.parameters, (len(chosen), 1))
    axis, side = FACES[grid.face]
    jacobian = group.maps.slopes_at(owners, where)
    own, each = group.numbers[chosen], np.repeat(np.arange(len(chosen)), len(grid.weights))
    normal, size = _normals(jacobian, axis, side, each)
    x = Points.at(np.ascontiguousarray(group.maps.at(owners, where).T), where)
    weights = np.tile(grid.weights, len(chosen)) * size
    problem = problems[own[0]]
    names = [problems[number].prefix + FACE_NAMES[grid.face] for number in own]
    nets = [np.take(body.patches[number].control_points, -side, axis=axis).reshape(-1, 3) for number in own]
    data = _GivenData(problem, FACE_NAMES[grid.face], x, normal, weights, STEP * body.size)
    given = data.given(np.stack(nets), names, each)
    across = jacobian[:, :, axis].T
    flat = np.abs((across * normal).sum(axis=0)) < FLAT * np.linalg.norm(across, axis=0)
    initial = np.zeros((problem.form.components, 3, len(owners)))
    if problem.form.has_initial_flux:
        initial += problem.form.initial_flux(x)
    at = _Traces(problem, grid.face, owners, where, normal, given, flat)
    return BoundaryPiece(
        group=group,
        rows=owners,
        places=where,
        x=x,
        normal=normal,
        weights=weights,
        curvature=curvature(group, owners, where, axis, jacobian, normal),
        elements=each * (1 + int(grid.spans.max())) + np.tile(grid.spans, len(chosen)),
        u=at.values(group, given.loads, np.ones(len(where), dtype=bool), initial),
        z=tuple(at.values(one, np.zeros_like(given.loads), flat, np.zeros_like(initial)) for one in of_z),
        source=np.asarray(problem.source_at(x)),
        given=given,
    )


def _normals(jacobian: Array, axis: int, side: int, owners: IntArray) -> tuple[Array, Array]:
    """Return outward unit normals (3, m) and surface elements (m,), from the derivatives (m, 3, 3) of patches (m,)."""
    area = np.cross(jacobian[:, :, (axis + 1) % 3], jacobian[:, :, (axis + 2) % 3])
    hands = np.sign(np.bincount(owners, np.linalg.det(jacobian)))[owners]
    size = np.linalg.norm(area, axis=1)
    outward = (hands if side else -hands)[:, None] * area / np.where(size > 0.0, size, 1.0)[:, None]
    return np.ascontiguousarray(outward.T), size


@dataclass(frozen=True, eq=False)
class _Traces:
    """Evaluate functions at points of a face, with normal derivatives from the data where the spline's are poor.

    A cube's map of a smooth body is flat at the cube's edges: there the parameter across a face runs along it, and the
    normal derivative of a spline is a quotient of small numbers. The tangential ones are good all over.

    flat: (m,), the mask of such points.
    """

    problem: BoundaryValueProblem
    face: int
    owners: IntArray
    where: Array
    normal: Array
    given: Given
    flat: Mask

    def values(self, group: FieldGroup, loads: Array, known: Mask, initial: Array) -> Values:
        """Return a function with a given flux; its free normal derivatives follow from the flux at points `known`.

        initial: (c, 3, m), what is added to the flux of the function: the law's initial flux of a solution.
        """
        form, c, m = self.problem.form, self.problem.form.components, len(self.where)
        steep = self._steep(group)

        def every(u: Array, grad: Array, x: Array) -> Array:
            along = grad - np.einsum("cam,am,bm->cbm", grad, self.normal, self.normal)
            held = np.einsum("cdm,dm->cm", self.given.projector, steep)
            pull = loads - np.einsum("cdm,dm->cm", self.given.factor, u) - (initial * self.normal).sum(axis=1)
            slope = np.where(known, self._slope(u, along + held[:, None] * self.normal, x, pull) + held, steep)
            found = along + slope[:, None] * self.normal
            flux = np.asarray(form.flux(u, found, x), dtype=np.float64) + initial
            pressure = getattr(x, "pressure", None)
            parts = [u, found.reshape(3 * c, m), flux.reshape(3 * c, m), reaction(form, u, found, x)]
            return np.concatenate([*parts, *([] if pressure is None else [pressure[None]])])

        rows = at_places(group, every, self.owners, self.where)
        u, grad, flux, react, rest = np.split(rows, [c, 4 * c, 7 * c, 8 * c])
        pressure = rest[0] if len(rest) else None
        return Values(u, grad.reshape(c, 3, m), flux.reshape(c, 3, m), react, pressure)

    def _steep(self, group: FieldGroup) -> Array:
        """Return the normal derivatives (c, m) of the spline; at flat points those half a span inside."""
        found = self._normal_slope(group, self.where, np.arange(len(self.where)))
        here = np.flatnonzero(self.flat)
        if len(here):
            axis, side = FACES[self.face]
            breaks = breakpoints(group.values.knots[axis])
            inside = self.where[here]
            inside[:, axis] = 0.5 * (breaks[-1] + breaks[-2] if side else breaks[0] + breaks[1])
            found[:, here] = self._normal_slope(group, inside, here)
        return found

    def _normal_slope(self, group: FieldGroup, where: Array, points: IntArray) -> Array:
        normal = self.normal[:, points]
        return at_places(group, lambda u, grad, x: np.einsum("cam,am->cm", grad, normal), self.owners[points], where)

    def _slope(self, u: Array, grad: Array, x: Array, pull: Array) -> Array:
        """Return what a gradient lacks along the normal (c, m) so that the flux in the free directions is `pull`."""
        form, unit = self.problem.form, np.eye(len(u))[:, :, None]
        free = unit - self.given.projector
        flux = np.asarray(form.flux(u, grad, x), dtype=np.float64)
        rest = np.einsum("cdm,dm->cm", free, pull - (flux * self.normal).sum(axis=1))
        columns = []
        for direction in unit:
            more = np.asarray(form.flux(u, grad + (direction * np.ones(len(self.where)))[:, None] * self.normal, x))
            columns.append(((more - flux) * self.normal).sum(axis=1))
        law = np.einsum("cdm,dem,efm->mcf", free, np.stack(columns, axis=1), free)
        law += np.moveaxis(self.given.projector, -1, 0)
        return np.asarray(np.linalg.solve(law, rest.T[:, :, None])[:, :, 0].T)


def curvature(group: FieldGroup, owners: IntArray, where: Array, axis: int, jacobian: Array, normal: Array) -> Array:
    """Return the sum (m,) of the principal curvatures of faces across a direction: the divergence of the normal."""
    a, b = (d for d in range(3) if d != axis)
    orders = [tuple(int(d == one) + int(d == other) for d in range(3)) for one, other in ((a, a), (a, b), (b, b))]
    bent = [-(part * normal.T).sum(axis=1) for part in group.maps.derivatives_at(owners, where, orders)]  # type: ignore[arg-type]
    first, second = jacobian[:, :, a], jacobian[:, :, b]
    of_a, of_ab, of_b = (
        (one * other).sum(axis=1) for one, other in ((first, first), (first, second), (second, second))
    )
    return np.asarray((of_b * bent[0] - 2.0 * of_ab * bent[1] + of_a * bent[2]) / (of_a * of_b - of_ab**2))


@dataclass(frozen=True, eq=False)
class _GivenData:
    """Evaluate the data of a face at its points, and beside them. step: a length."""

    problem: BoundaryValueProblem
    name: str
    x: Points
    normal: Array
    weights: Array
    step: float

    def given(self, nets: Array, names: Sequence[str], owners: IntArray) -> Given:
        """Return the data. nets, names, owners: as of `codes_on`."""
        pressure, pressure_slope = np.zeros(len(self.weights)), np.zeros((3, len(self.weights)))
        codes = np.zeros(0, dtype=np.int64)
        if self.problem.conditions:
            codes = codes_on(self.problem, nets, names)(self.x, self.normal, owners)
            acting = Acting(self.problem, self.x, self.normal, self.weights, codes)
            for i, condition in enumerate(self.problem.conditions):
                if isinstance(condition, Pressure) and condition.datum is not None:
                    here = acting.holding(i)
                    pressure += np.where(here, condition.datum(self.x)[0], 0.0)
                    slopes = [self._slope(condition.datum, axis) for axis in np.eye(3)]
                    pressure_slope += np.where(here, np.stack(slopes)[:, 0], 0.0)

        def at(x: Points) -> tuple[Array, ...]:
            return self._on_regions(x, codes) if self.problem.conditions else self._on_face(x)

        projector, _, loads, factor = at(self.x)
        ahead, behind = (at(self._moved(way * self.normal))[1:] for way in (1.0, -1.0))
        slopes_of_data = [(one - other) / (2.0 * self.step) for one, other in zip(ahead, behind, strict=True)]
        value_slope, load_slope, factor_slope = slopes_of_data
        return Given(projector, value_slope, loads, load_slope, factor, factor_slope, pressure, pressure_slope)

    def _slope(self, data: Callable[[Points], Array], axis: Array) -> Array:
        """Return the derivative of a datum along an axis (3,)."""
        ahead, behind = (data(self._moved(way * axis[:, None])) for way in (1.0, -1.0))
        return np.asarray(ahead - behind) / (2.0 * self.step)

    def _moved(self, direction: Array) -> Points:
        """Return the points moved by a step in a direction, (3, 1) or (3, m), with the parameters that they have."""
        assert self.x.places is not None
        return Points.at(np.asarray(self.x) + self.step * direction, self.x.places)

    def _on_regions(self, x: Points, codes: IntArray) -> tuple[Array, ...]:
        """Return projector, values, loads and factor of conditions on regions."""
        acting = Acting(self.problem, x, self.normal, self.weights, codes)
        projector, values = acting.held()
        return projector, values, *acting.natural(projector)

    def _on_face(self, x: Points) -> tuple[Array, ...]:
        """Return projector, values, loads and factor of the data of a whole face."""
        c, m = self.problem.form.components, x.shape[1]
        if self.name in self.problem.dirichlet:
            unit = np.eye(c)[:, :, None] * np.ones(m)
            return unit, self.problem.boundary_at(x, self.name), np.zeros((c, m)), np.zeros((c, c, m))
        alpha, loads = self.problem.on_face(self.name, x, self.normal)
        nothing = np.zeros((c, c, m)), np.zeros((c, m))
        factor = np.eye(c)[:, :, None] * (np.zeros(m) if alpha is None else alpha)
        return *nothing, np.broadcast_to(loads, (c, m)), factor
