"""Finds the nodes and the faces of elements in regions, and what holds the nodes there."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.interface import axis_side
from parameterize.spline.orientation import orientations
from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.part import PartSurface
from solve.discretization.on_regions import codes_on
from solve.discretization.surface_rule import Faces
from solve.field import Points
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.conditions import Value
from solve.patch_system import PatchProblem

from .cell_regions import regions_at
from .elements import Elements, alike_patches

INWARD = 0.02  # share of the way from a node to the middle of its face, where a region is asked whether it holds
SAME = 0.9  # cosine of the angle up to which normals at a node are taken for one, that of their sum
NEW = 1e-6  # part of a direction beside those that are held, from which on it is held too
ZERO = 1e-9  # entry of a direction that is rounding


@dataclass(frozen=True, eq=False)
class FaceNodes:
    """Hold the nodes of faces of elements on the boundary, of patches of one group with the same name of a face.

    elements: (f,). face: the patches' face, in the order of FACE_NAMES. nodes: (f, k). patches: (f,). parameters: (f,
    k, 3) of the nodes. owners: (f,), the place of each patch among those of `faces`.
    """

    elements: IntArray
    face: int
    nodes: IntArray
    patches: IntArray
    parameters: Array
    faces: Faces
    owners: IntArray

    def along(self, inward: float) -> Array:
        """Return the parameters (f, k, 2) along the faces, moved by a share towards the middles of elements' faces."""
        across = np.delete(self.parameters, self.face // 2, axis=-1)
        middle = 0.5 * (across.min(axis=1) + across.max(axis=1))[:, None]
        return np.asarray(across + inward * (middle - across))

    def seen(self, across: Array) -> tuple[Array, Array, IntArray]:
        """Return points and outward unit normals (3, m), and places of patches (m,), of parameters (f, k, 2)."""
        owners = np.repeat(self.owners, across.shape[1])
        x, area = self.faces.points_and_areas(owners, across.reshape(-1, 2))
        return x, area / np.linalg.norm(area, axis=0), owners


def boundary_faces(elements: Elements) -> Iterator[FaceNodes]:
    """Yield the faces of elements on the boundary, those of alike patches and one name together."""
    owners, names = elements.outer
    q = elements.degree
    for some in alike_patches(elements.body, elements.grading):
        group = elements.body.groups[some.group].rows(some.places)
        hands = orientations(elements.body.groups[some.group])[some.places]
        own = np.isin(elements.owners[owners], some.numbers)
        for face, name in enumerate(FACE_NAMES):
            here = owners[own & (names == face)]
            if not len(here):
                continue
            axis, side = axis_side(name)
            nodes = elements.nodes_of_faces(here, np.full(len(here), face)).reshape(len(here), -1)
            share = np.indices((q + 1, q + 1)).reshape(2, -1).T / q
            share = np.insert(share, axis, float(side), axis=1)[None].repeat(len(here), axis=0)
            if axis < 2:  # the nodes of an element run against w if its patch is left-handed
                left = elements.left[here]
                share[left, :, 2] = 1.0 - share[left, :, 2]
            low, high = elements.low[here][:, None], elements.high[here][:, None]
            parameters = low * (1.0 - share) + high * share
            patches = elements.owners[here]
            place = np.searchsorted(some.numbers, patches)
            yield FaceNodes(here, face, nodes, patches, parameters, Faces(group, axis, side, hands), place)


@dataclass(frozen=True, eq=False)
class Held:
    """Hold equations at nodes: of each its node, the degrees of freedom with their factors, and the value.

    Degrees count from 0. The first of several is held by the others, and occurs in no other equation.
    """

    rows: list[tuple[int, list[tuple[int, float]], float]]
    nodes: dict[str, IntArray]  # by the role of a condition


def held_nodes(elements: Elements, patches: Sequence[PatchProblem]) -> Held:
    """Return what supports hold at the nodes. Raises ExpressionError for values that are not finite."""
    found: dict[int, list[tuple[Array, float]]] = defaultdict(list)
    sets: dict[str, list[IntArray]] = defaultdict(list)
    for faces in boundary_faces(elements):
        for own, problem in _with_data(faces, patches):
            for role, nodes, directions, values in _on(own, problem):
                sets[role].append(np.unique(nodes))
                for node, direction, value in zip(nodes.tolist(), directions, values.tolist(), strict=True):
                    found[node].append((direction, value))
    rows = [(node, *row) for node in sorted(found) for row in _equations(found[node])]
    return Held(rows, {role: np.unique(np.concatenate(parts)) for role, parts in sets.items()})


def _with_data(faces: FaceNodes, patches: Sequence[PatchProblem]) -> Iterator[tuple[FaceNodes, BoundaryValueProblem]]:
    """Yield the faces of patches with the same data, and the problem of these patches."""
    classes = defaultdict(list)
    name = FACE_NAMES[faces.face]
    for row, number in enumerate(faces.patches.tolist()):
        problem = patches[number].problem
        key = problem.on_regions, problem.key_on(name), name in patches[number].space.dirichlet
        classes[key if not problem.has_fields else number].append(row)
    for rows in classes.values():
        own = np.array(rows)
        kept = {key: getattr(faces, key)[own] for key in ("elements", "nodes", "patches", "parameters", "owners")}
        part = replace(faces, **kept)
        yield part, patches[int(part.patches[0])].problem


def _on(faces: FaceNodes, problem: BoundaryValueProblem) -> Iterator[tuple[str, IntArray, Array, Array]]:
    """Yield the role of a support, nodes (m,), and directions (m, c) and values (m,) that are held there."""
    components, name = problem.form.components, FACE_NAMES[faces.face]
    x, normal, _ = faces.seen(faces.along(0.0))
    points = Points.at(x, faces.parameters.reshape(-1, 3))
    nodes = faces.nodes.ravel()
    inside, at_inside, owners = faces.seen(faces.along(INWARD))
    prefixes = [f"p{number}_{name}" if problem.prefix else name for number in faces.faces.group.numbers.tolist()]
    codes = codes_on(problem, faces.faces.nets, prefixes)(inside, at_inside, owners) if problem.conditions else None
    for i, condition in enumerate(problem.conditions, 1):
        here = np.flatnonzero(codes >> i & 1) if codes is not None else np.empty(0, dtype=np.int64)
        if isinstance(condition, Value) and len(here):
            at = Points.at(np.ascontiguousarray(x[:, here]), points.places[here])  # type: ignore[index]
            for direction in condition.directions(components, normal[:, here]):
                yield condition.role, nodes[here], direction.T, condition.values_along(direction, problem, at)
    strong = problem.strong_on(name)
    if name in problem.dirichlet and not any(strong is one for one in problem.conditions):
        values = problem.boundary_at(x, name) if strong is None else strong.values_at(problem, points)
        for component in range(components):
            direction = np.zeros((len(nodes), components))
            direction[:, component] = 1.0
            yield f"values {name}", nodes, direction, np.broadcast_to(values[component], len(nodes))


def _equations(given: Sequence[tuple[Array, float]]) -> Iterator[tuple[list[tuple[int, float]], float]]:
    """Yield the independent equations (degrees of freedom with factors, value) of directions with values at a node.

    Directions that nearly agree, as normals of neighbouring faces do, are taken for their mean. Of equations that
    contradict each other the first holds.
    """
    merged: list[list[Any]] = []
    for direction, value in given:
        for one in merged:
            if abs(one[0] @ direction) > SAME * np.linalg.norm(one[0]):
                sign = np.sign(one[0] @ direction)
                one[0], one[1], one[2] = one[0] + sign * direction, one[1] + sign * value, one[2] + 1
                break
        else:
            merged.append([direction.copy(), value, 1])
    rows = np.array([one[0] / np.linalg.norm(one[0]) for one in merged])
    values = np.array([one[1] / one[2] for one in merged])
    rows[np.abs(rows) < ZERO] = 0.0
    pivots: list[int] = []
    kept: list[int] = []
    for row in range(len(rows)):
        size = np.abs(rows[row])
        pivot = int(size.argmax())
        if size[pivot] < NEW:
            continue
        values[row] /= rows[row, pivot]
        rows[row] /= rows[row, pivot]
        for other in range(len(rows)):
            if other != row and rows[other, pivot] != 0.0:
                values[other] -= rows[other, pivot] * values[row]
                rows[other] -= rows[other, pivot] * rows[row]
                rows[other][np.abs(rows[other]) < ZERO] = 0.0
        kept.append(row)
        pivots.append(pivot)
    for row, pivot in zip(kept, pivots, strict=True):
        others = [(i, float(rows[row, i])) for i in np.flatnonzero(rows[row]).tolist() if i != pivot]
        yield [(pivot, 1.0), *others], float(values[row])


def faces_of_regions(
    elements: Elements, problem: BoundaryValueProblem | None, part: PartSurface | None
) -> dict[str, tuple[IntArray, IntArray]]:
    """Return the elements and their own faces with middles in each condition's region, and in each group of a part.

    problem: placed in the body; None where there is none. Names are those of the conditions, by kind and number, and of
    the groups.
    """
    found: dict[str, list[tuple[IntArray, IntArray]]] = defaultdict(list)
    for faces in boundary_faces(elements):
        across = faces.along(0.0)
        middle = 0.5 * (across.min(axis=1, keepdims=True) + across.max(axis=1, keepdims=True))
        x, normal, owners = faces.seen(middle)
        own = elements.own_face(faces.elements, np.full(len(faces.elements), faces.face))
        face, is_single = FACE_NAMES[faces.face], elements.body.is_single
        for name, here in regions_at(faces.faces, face, (x, normal), owners, is_single, problem, part):
            found[name].append((faces.elements[here], own[here]))
    joined = {name: tuple(map(np.concatenate, zip(*parts, strict=True))) for name, parts in found.items()}
    return {name: (rows[0], rows[1]) for name, rows in joined.items() if len(rows[0])}
