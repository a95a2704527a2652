"""Turns the loads of a problem into forces at the nodes of elements: their resultant is that of the solve.

The force at a node is the integral of the load times the node's function of its element. These functions sum to 1, so
that the forces at all nodes sum to the load, as the solve integrates it. An exchange with the outside becomes a film on
faces of elements, with a coefficient whose integral is that of the solve.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.interface import axis_side
from parameterize.spline.orientation import orientations
from parameterize.spline.patch_groups import PatchGroup
from parameterize.spline.volume import FACE_NAMES
from solve.discretization.face_data import face_rules
from solve.discretization.on_regions import renewed, weak_faces
from solve.discretization.shared_out import shared_out
from solve.discretization.surface_rule import Faces
from solve.field import Points
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.options import SolveOptions
from solve.patch_system import PatchProblem
from solve.preparation import on_patches

from .element_shapes import ElementShape
from .elements import Alike, Elements, alike_patches, chunks

GAUSS = 4  # points a direction on an element
AT_ONCE = 500  # patches


@dataclass(frozen=True, eq=False)
class PointLoads:
    """Hold loads at points: patches (m,), parameters (m, 3), weights (m,) in space, forces (m, c) and factors (m,).

    forces: load times weight. factors: of u in the flux, not times the weight; zero but for exchanges.
    """

    patches: IntArray
    parameters: Array
    weights: Array
    forces: Array
    factors: Array


@dataclass(frozen=True, eq=False)
class Films:
    """Hold films on faces of elements: elements (f,), their own faces (f,), coefficients (f,), outside values (f,)."""

    elements: IntArray
    faces: IntArray
    coefficients: Array
    outside: Array


def problems_on(elements: Elements, problem: BoundaryValueProblem) -> tuple[BoundaryValueProblem, list[PatchProblem]]:
    """Return the problem placed in the body, and on each patch with a space whose spans are the elements."""
    return on_patches(elements.body, problem, SolveOptions(grading=elements.grading, threads=1))


def nodal_loads(
    elements: Elements, shape: ElementShape, patches: Sequence[PatchProblem], components: int
) -> tuple[Array, Films]:
    """Return the forces (n, c) at all nodes, and the films of exchanges. Raises ValueError as a solve."""
    forces = np.zeros((len(elements.points), components))
    films = []
    for flow in _flows(elements, patches):
        inside = elements.holding(flow.patches, flow.parameters)
        is_film = flow.factors > 0.0
        plain = np.flatnonzero(~is_film)
        _add(forces, elements, shape, inside[plain], flow.parameters[plain], flow.forces[plain])
        if is_film.any():
            films.append(_film(elements, flow, inside, np.flatnonzero(is_film)))
    return forces, _of_shape(elements, shape, films)


def _add(
    forces: Array, elements: Elements, shape: ElementShape, inside: IntArray, parameters: Array, loads: Array
) -> None:
    """Add loads (m, c) at points in elements `inside` (m,) to the forces at nodes."""
    for part in chunks(len(inside), 100_000):
        own = inside[part]
        functions = shape.functions(elements.local(own, parameters[part]))
        nodes = shape.chosen(elements.cells[own])
        for component in range(forces.shape[1]):
            share = functions * loads[part, component][:, None]
            forces[:, component] += np.bincount(nodes.ravel(), share.ravel(), len(forces))


def _flows(elements: Elements, patches: Sequence[PatchProblem]) -> Iterator[PointLoads]:
    """Yield the loads: of regions, of whole faces, and per volume."""
    if patches[0].problem.conditions:
        yield from _of_regions(patches)
    yield from _of_faces(elements, patches)
    yield from _of_volume(elements, patches)


def _of_regions(patches: Sequence[PatchProblem]) -> Iterator[PointLoads]:
    first, same = patches[0], [patch.problem.in_volume for patch in patches]
    if not first.problem.has_totals:
        faces = weak_faces(patches, same)
    else:
        faces = weak_faces([replace(patch, problem=patch.problem.nominal()) for patch in patches], same)
        conditions = shared_out(first.problem.conditions, faces, first.space)
        faces = [renewed(face, patches[face.patches[0]].problem.sharing(conditions)) for face in faces]
    for face in faces:
        forces = (face.loads * face.weights).T
        yield PointLoads(face.patches[face.owners], face.places, face.weights, forces, face.factor[0, 0])


def _of_faces(elements: Elements, patches: Sequence[PatchProblem]) -> Iterator[PointLoads]:
    for group in elements.body.groups:
        for place, number in enumerate(group.numbers.tolist()):
            patch = patches[number]
            for name in (face for one in patch.problem.faces if not one.is_essential for face in one.faces):
                if name not in patch.space.outer:
                    continue
                rule = face_rules(group.rows(np.array([place])), patch.space, name)
                alpha, given = rule.data(patch.problem)
                grid = np.stack(np.meshgrid(*rule.rows, indexing="ij"), axis=-1).reshape(-1, 3)
                weights = rule.area.ravel()
                forces = (given.reshape(len(given), -1) * weights).T
                factors = np.zeros(len(grid)) if alpha is None else alpha.ravel()
                yield PointLoads(np.full(len(grid), number), grid, weights, forces, factors)


def _of_volume(elements: Elements, patches: Sequence[PatchProblem]) -> Iterator[PointLoads]:
    for some in alike_patches(elements.body, elements.grading):
        for part in chunks(len(some.places), AT_ONCE):
            yield from _of_alike(elements, some, part, patches)


def _of_alike(elements: Elements, some: Alike, part: slice, patches: Sequence[PatchProblem]) -> Iterator[PointLoads]:
    t, weights = np.polynomial.legendre.leggauss(GAUSS)
    u, v, w = rows = [(row[:-1, None] + np.diff(row)[:, None] * (0.5 + 0.5 * t)).ravel() for row in some.cuts]
    sizes = [(np.diff(row)[:, None] * 0.5 * weights).ravel() for row in some.cuts]
    numbers = some.numbers[part]
    active = [not _is_free(patches[number].problem) for number in numbers.tolist()]
    if not any(active):
        return
    group = elements.body.groups[some.group].rows(some.places[part])
    x = group.grid(u, v, w)
    det = np.abs(np.linalg.det(group.grid_jacobian(u, v, w)))
    measure = det * np.einsum("i,j,k->ijk", *sizes)
    grid = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3)
    for place, number in enumerate(numbers.tolist()):
        if active[place]:
            points = Points.of(np.ascontiguousarray(np.moveaxis(x[place], -1, 0)), rows)
            source = patches[number].problem.source_at(points)
            own = measure[place].ravel()
            forces = (source.reshape(len(source), -1) * own).T
            yield PointLoads(np.full(len(own), number), grid, own, forces, np.zeros(len(own)))


def _is_free(problem: BoundaryValueProblem) -> bool:
    """Return whether the body has no load per volume."""
    source = problem.data.get("source")
    return source is not None and source.is_zero


def _film(elements: Elements, flow: PointLoads, inside: IntArray, points: IntArray) -> tuple[IntArray, Array]:
    """Return the faces (f, 2), element and own face, of some points of a flow, and their integrals (f, 2).

    The integrals are those of the factor, and of the factor times the value outside.
    """
    own, parameters = inside[points], flow.parameters[points]
    local = elements.local(own, parameters)
    axis = np.abs(local).argmax(axis=1)  # the points lie on a face: one coordinate is -1 or 1
    faces = 2 * axis + (local[np.arange(len(axis)), axis] > 0.0)
    rows, place = np.unique(np.stack([own, faces], axis=1), axis=0, return_inverse=True)
    values = [flow.factors[points] * flow.weights[points], flow.forces[points, 0]]
    sums = np.stack([np.bincount(place.ravel(), value, len(rows)) for value in values], axis=1)
    return rows.astype(np.int64), np.asarray(sums)


def _of_shape(elements: Elements, shape: ElementShape, films: Sequence[tuple[IntArray, Array]]) -> Films:
    """Return the films of all parts, with coefficients that have the integrals on the faces as they are written."""
    none = np.empty(0)
    if not films:
        return Films(none.astype(np.int64), none.astype(np.int64), none, none)
    rows, place = np.unique(np.concatenate([row for row, _ in films]), axis=0, return_inverse=True)
    sums = np.zeros((len(rows), 2))
    np.add.at(sums, place.ravel(), np.concatenate([sums for _, sums in films]))
    owners, faces = rows.T
    areas = face_areas(elements, shape, owners, faces)
    return Films(owners, faces, sums[:, 0] / areas, sums[:, 1] / sums[:, 0])


def face_areas(elements: Elements, shape: ElementShape, owners: IntArray, faces: IntArray) -> Array:
    """Return the areas (f,) of faces of elements as their shape has them; faces: the elements' own."""
    q = shape.degree
    areas = np.empty(len(owners))
    t, weights = np.polynomial.legendre.leggauss(GAUSS)
    t, weights = 0.5 * (t + 1.0), 0.5 * weights
    across = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    measure = np.multiply.outer(weights, weights).ravel()
    for face, name in enumerate(FACE_NAMES):
        here = np.flatnonzero(faces == face)
        if not len(here):
            continue
        points = elements.points[shape.chosen(elements.cells[owners[here]])]
        nets = np.einsum("bk,ekc->ebc", shape.to_bernstein, points).reshape(-1, *[q + 1] * 3, 3)
        group = PatchGroup(np.arange(len(here)), (q, q, q), (np.repeat([0.0, 1.0], q + 1),) * 3, nets)
        own = Faces(group, *axis_side(name), orientations(group))
        _, area = own.points_and_areas(np.repeat(np.arange(len(here)), len(across)), np.tile(across, (len(here), 1)))
        areas[here] = np.linalg.norm(area, axis=0).reshape(len(here), -1) @ measure
    return areas
