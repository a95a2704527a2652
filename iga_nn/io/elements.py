"""Cuts a body into finite elements, whose nodes lie on its map and are shared at interfaces.

An element is a span of the map, or a part of one. Its nodes form a lattice of q + 1 points a direction; programs with
fewer nodes, as those of 20, take some of it. Elements of a left-handed patch run against w, so that all are
right-handed.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body, shared_numbers
from parameterize.spline.bspline import breakpoints
from parameterize.spline.orientation import hands_of
from parameterize.spline.volume import FACE_NAMES
from solve.discretization.grading import Grading

Cuts = tuple[Array, Array, Array]  # the parameters of a patch at which its elements end, a direction each


@dataclass(frozen=True, eq=False)
class Alike:
    """Name patches of one group that are cut at the same parameters.

    group: the number of their group. places: (k,), in the group. numbers: (k,), in the body. cuts: of each direction.
    """

    group: int
    places: IntArray
    numbers: IntArray
    cuts: Cuts


@dataclass(frozen=True, eq=False)
class Elements:
    """Hold the elements of a body, patch after patch.

    degree: q, of the lattice of nodes. grading: where the spans of the map are cut. points: (n, 3), of all nodes.
    cells: (e, q + 1, q + 1, q + 1), numbers of nodes along the element's own three directions. owners: (e,), patches.
    low, high: (e, 3), the parameters of the patch between which an element lies.
    """

    body: Body
    degree: int
    grading: Grading
    points: Array
    cells: IntArray
    owners: IntArray
    low: Array
    high: Array

    @classmethod
    def of(cls, body: Body, degree: int, grading: Grading) -> Elements:
        """Return the elements of a body, cut as a grading says."""
        alike = alike_patches(body, grading)
        shapes: list[tuple[int, ...]] = [()] * len(body)
        for some in alike:
            for number in some.numbers.tolist():
                shapes[number] = tuple(degree * (len(row) - 1) + 1 for row in some.cuts)
        labels, count = shared_numbers(shapes, body.interfaces)
        points = np.empty((count, 3))
        left = hands_of(body.groups) < 0
        parts: dict[int, tuple[IntArray, Array, Array]] = {}
        for some in alike:
            u, v, w = (lattice(row, degree) for row in some.cuts)
            grid = body.groups[some.group].rows(some.places).grid(u, v, w)
            own = np.stack([labels[number] for number in some.numbers.tolist()])
            points[own] = grid
            starts, low, high = _spans(some.cuts)
            inside = np.indices((degree + 1,) * 3)  # (3, q + 1, q + 1, q + 1)
            i, j, k = degree * starts.T[:, :, None, None, None] + inside[:, None]
            cells = own[:, i, j, k]
            for number, cell in zip(some.numbers.tolist(), cells, strict=True):
                parts[number] = (cell[..., ::-1] if left[number] else cell), low, high
        each = [parts[number] for number in range(len(body))]
        owners = np.repeat(np.arange(len(body)), [len(part[0]) for part in each])
        cells, low, high = (np.concatenate(rows) for rows in zip(*each, strict=True))
        return cls(body, degree, grading, points, cells, owners, low, high)

    def __len__(self) -> int:
        return len(self.owners)

    @cached_property
    def left(self) -> Mask:
        """Return whether each element (e,) runs against w, as those of left-handed patches do."""
        return (hands_of(self.body.groups) < 0)[self.owners]

    @cached_property
    def starts(self) -> IntArray:
        """Return the number of each patch's first element, and the number of all elements: (patches + 1,)."""
        return np.searchsorted(self.owners, np.arange(len(self.body) + 1))

    def local(self, elements: IntArray, parameters: Array) -> Array:
        """Return the coordinates (m, 3) from -1 to 1 of parameters (m, 3) of the patches in elements (m,)."""
        found = 2.0 * (parameters - self.low[elements]) / (self.high - self.low)[elements] - 1.0
        found[self.left[elements], 2] *= -1.0
        return found

    def holding(self, patches: IntArray, parameters: Array) -> IntArray:
        """Return the elements (m,) that hold parameters (m, 3) of patches (m,)."""
        found = np.empty(len(patches), dtype=np.int64)
        for some in alike_patches(self.body, self.grading):
            here = np.flatnonzero(np.isin(patches, some.numbers))
            counts = [len(row) - 1 for row in some.cuts]
            rows = [
                np.clip(np.searchsorted(row, parameters[here, axis], side="right") - 1, 0, len(row) - 2)
                for axis, row in enumerate(some.cuts)
            ]
            found[here] = self.starts[patches[here]] + np.ravel_multi_index(rows, counts)
        return found

    @cached_property
    def outer(self) -> tuple[IntArray, IntArray]:
        """Return the elements (f,) with a face on the boundary, and which (f,), in the order of FACE_NAMES.

        The faces are those of the patch; see `own_face` for those of the element.
        """
        found = []
        glued = self.body.glued[self.owners]
        for face in range(len(FACE_NAMES)):
            axis, side = divmod(face, 2)
            ends = self.high[:, axis] == 1.0 if side else self.low[:, axis] == 0.0
            here = np.flatnonzero(ends & ~glued[:, face])
            found.append(np.stack([here, np.full(len(here), face)]))
        elements, faces = np.concatenate(found, axis=1)
        return elements, faces

    def own_face(self, elements: IntArray, faces: IntArray) -> IntArray:
        """Return the faces (f,) of elements along their own directions from faces (f,) of their patches."""
        return np.where(self.left[elements] & (faces >= 4), 9 - faces, faces)

    def nodes_of_faces(self, elements: IntArray, faces: IntArray) -> IntArray:
        """Return the numbers (f, q + 1, q + 1) of the nodes on faces of elements, faces of their patches."""
        found = np.empty((len(elements), self.degree + 1, self.degree + 1), dtype=np.int64)
        own = self.own_face(elements, faces)
        for face in range(len(FACE_NAMES)):
            here = np.flatnonzero(own == face)
            axis, side = divmod(face, 2)
            found[here] = np.take(self.cells[elements[here]], -side, axis=1 + axis)
        return found

    @cached_property
    def place_of_nodes(self) -> tuple[IntArray, Array]:
        """Return for each node a patch (n,) that it lies on, and its parameters (n, 3) there."""
        q = self.degree
        local = np.indices((q + 1,) * 3).reshape(3, -1).T / q  # (nodes, 3)
        elements = np.repeat(np.arange(len(self)), len(local))
        share = np.tile(local, (len(self), 1))
        share[self.left[elements], 2] = 1.0 - share[self.left[elements], 2]
        parameters = self.low[elements] * (1.0 - share) + self.high[elements] * share
        numbers, first = np.unique(self.cells.reshape(-1), return_index=True)
        patches, places = np.empty(len(self.points), dtype=np.int64), np.empty_like(self.points)
        patches[numbers], places[numbers] = self.owners[elements[first]], parameters[first]
        return patches, places

    def finer(self, elements: IntArray) -> Elements:
        """Return elements of which those that are named (k,) are halved in each direction, and what is tied to them."""
        times: dict[int, Array] = {}
        sheets = self.grading.sheets
        for element in elements.tolist():
            patch = int(self.owners[element])
            counts = [len(self.grading.places(patch)[axis]) - 1 for axis in range(3)]
            place = np.unravel_index(element - self.starts[patch], counts)
            for axis in range(3):
                sheet = int(sheets.numbers[patch, axis])
                row = times.setdefault(sheet, np.zeros(self.grading.spans[sheet], dtype=bool))
                row[-1 - place[axis] if sheets.flipped[patch, axis] else place[axis]] = True
        return Elements.of(self.body, self.degree, self.grading.refined(times))


def alike_patches(body: Body, grading: Grading) -> list[Alike]:
    """Return the patches of a body, those of one group with the same cuts together."""
    found = []
    for label, group in enumerate(body.groups):
        own = [breakpoints(row) for row in group.knots]
        classes = defaultdict(list)
        for place, number in enumerate(group.numbers.tolist()):
            classes[grading.places(number)].append(place)
        for places, members in classes.items():
            u, v, w = (np.interp(row, np.arange(len(knots)), knots) for row, knots in zip(places, own, strict=True))
            chosen = np.array(members)
            found.append(Alike(label, chosen, group.numbers[chosen], (u, v, w)))
    return found


def cut(body: Body, parts: int) -> Grading:
    """Return the spans of a body's map, each in so many parts a direction."""
    grading = Grading.of(body)
    rows = [np.append((row[:-1, None] + np.arange(parts) / parts).ravel(), row[-1]) for row in grading.rows]
    return replace(grading, rows=tuple(rows))


def lattice(cuts: Array, degree: int) -> Array:
    """Return the parameters (q s + 1,) of the nodes on elements that end at cuts (s + 1,)."""
    share = np.arange(degree) / degree
    return np.append((cuts[:-1, None] * (1.0 - share) + cuts[1:, None] * share).ravel(), cuts[-1])


def _spans(cuts: Cuts) -> tuple[IntArray, Array, Array]:
    """Return the places (s, 3) of a patch's elements, and their least and largest parameters (s, 3)."""
    places = np.indices([len(row) - 1 for row in cuts]).reshape(3, -1).T
    low, high = (np.stack([row[places[:, axis] + step] for axis, row in enumerate(cuts)], axis=-1) for step in (0, 1))
    return places, low, high


def chunks(count: int, size: int) -> Iterator[slice]:
    """Yield slices of at most so many entries."""
    for begin in range(0, count, size):
        yield slice(begin, begin + size)
