"""The patches of an MFEM NURBS mesh as hexahedra, and the numbers of their control points.

MFEM numbers the control points of a mesh in this order: the vertices; the insides of the edges, as they are listed,
each from its smaller vertex; the insides of the faces, as the hexahedra have them first, the first direction of that
face fastest; the insides of the patches, u fastest. Source: `NURBSExtension` and `NURBSPatchMap` of MFEM.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.interface import Face, axis_side, face_layer, varying

# the corners of a hexahedron in MFEM's order, as (u, v, w)
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
# its faces in MFEM's order, each seen from outside
FACES = {"w0": (3, 2, 1, 0), "v0": (0, 1, 5, 4), "u1": (1, 2, 6, 5), "v1": (2, 3, 7, 6), "u0": (3, 0, 4, 7)}
FACES |= {"w1": (4, 5, 6, 7)}
LEADING = (0, 2, 0)  # of the four edges in a direction the one by which MFEM takes the way: from vertex 0, 1 and 0


@dataclass(frozen=True)
class Layout:
    """The hexahedra of a mesh, one a patch.

    Attributes
    ----------
    vertices : int
        How many there are.
    hexahedra : (n, 8) array
        The vertices of each, in MFEM's order.
    edges : (m, 3) array
        The knot vector of each edge, and the vertices at its start and at its end.

    Raises
    ------
    ValueError
        Where a vertex does not exist, a hexahedron has it twice, or an edge is missing or contradicts its neighbours.
    """

    vertices: int
    hexahedra: IntArray
    edges: IntArray

    def __post_init__(self) -> None:
        named = int(max(self.hexahedra.max(), self.edges[:, 1:].max(initial=0)))
        if named >= self.vertices:
            raise ValueError(f"names vertex {named}, and there are {self.vertices}, counted from 0")
        for number, row in enumerate(self.hexahedra.tolist()):
            if len(set(row)) < len(row):
                raise ValueError(f"element {number} has a vertex twice")
        if len({frozenset(ends) for ends in self.edges[:, 1:].tolist()}) < len(self.edges):
            raise ValueError("lists an edge twice")

    @cached_property
    def corners(self) -> IntArray:
        """Return the vertices of each patch as (n, 2, 2, 2)."""
        cube = np.empty((len(self.hexahedra), 2, 2, 2), dtype=np.int64)
        for place, (i, j, k) in enumerate(CORNERS):
            cube[:, i, j, k] = self.hexahedra[:, place]
        return cube

    @cached_property
    def axes(self) -> list[list[tuple[int, bool]]]:
        """Return for each patch and direction the knot vector, and whether it runs the other way.

        Of patches whose edges run along with each other the leading edge of the last one tells the way, as in MFEM.
        Where it writes a mesh, it lists all edges from their lower vertices, whichever way the knots run. Raises
        ValueError where an edge is missing, or the four edges in a direction have different knot vectors.
        """
        listed = {}
        for knots, start, end in self.edges.tolist():
            listed[start, end], listed[end, start] = (knots, False), (knots, True)
        for number, corners in enumerate(self.corners):
            for edges in (edges_along(corners, axis) for axis in range(3)):
                if missing := [ends for ends in edges if tuple(ends) not in listed]:
                    raise ValueError(
                        f"element {number}: has no edge between the vertices {missing[0][0]} and {missing[0][1]}"
                    )
                if len({listed[start, end][0] for start, end in edges}) > 1:
                    raise ValueError(f"element {number}: its edges in one direction have different knot vectors")
        found = [[(0, False)] * 3 for _ in self.hexahedra]
        for bundle in bundles(self.corners):
            last, axis, is_back = max(bundle)
            start, end = leading_edge(self.corners[last], axis)
            knots, is_turned = listed[start, end]
            for number, own_axis, back in bundle:
                found[number][own_axis] = knots, is_turned != (back != is_back)
        return found

    def shapes(self, counts: Sequence[int]) -> list[tuple[int, ...]]:
        """Return the numbers of control points of each patch; counts: those of the knot vectors."""
        return [tuple(counts[knots] for knots, _ in axes) for axes in self.axes]

    def size(self, counts: Sequence[int]) -> int:
        """Return how many control points the mesh has; counts: those of the knot vectors."""
        shapes = self.shapes(counts)
        faces: dict[frozenset[int], int] = {}
        for number, name, key in self._faces():
            faces.setdefault(key, prod(shapes[number][axis] - 2 for axis in varying(name)))
        edges = sum(counts[knots] - 2 for knots in self.edges[:, 0].tolist())
        return self.vertices + edges + sum(faces.values()) + sum(prod(n - 2 for n in shape) for shape in shapes)

    def _faces(self) -> Iterator[tuple[int, str, frozenset[int]]]:
        """Yield patch, face and its vertices, in MFEM's order."""
        for number, row in enumerate(self.hexahedra.tolist()):
            for name, places in FACES.items():
                yield number, name, frozenset(row[place] for place in places)

    def shared_faces(self) -> Iterator[tuple[Face, Face]]:
        """Yield the pairs of faces with the same vertices. Raises ValueError where three have the same."""
        seen: dict[frozenset[int], list[Face]] = {}
        for number, name, key in self._faces():
            seen.setdefault(key, []).append((number, name))
        for key, faces in seen.items():
            if len(faces) > 2:
                raise ValueError(f"{len(faces)} elements have the face of the vertices {sorted(key)}")
            if len(faces) == 2:
                yield faces[0], faces[1]

    def numbers(self, counts: Sequence[int]) -> list[IntArray]:
        """Return the numbers of the control points of each patch, (n_u, n_v, n_w); counts: those of the knot vectors.

        Raises ValueError where the control points of a face differ in their number for its two patches.
        """
        found = [np.empty(shape, dtype=np.int64) for shape in self.shapes(counts)]
        next_number = self._number_faces(found, self._number_edges(found, counts))
        for patch, corners in zip(found, self.corners, strict=True):
            inside = patch[1:-1, 1:-1, 1:-1]
            inside[...] = (next_number + np.arange(inside.size)).reshape(inside.shape, order="F")
            next_number += inside.size
            patch[np.ix_(*[[0, -1]] * 3)] = corners
        return found

    def _number_edges(self, patches: Sequence[IntArray], counts: Sequence[int]) -> int:
        """Enter the numbers inside the edges of all patches, and return the next number."""
        next_number, starts = self.vertices, {}
        for knots, start, end in self.edges.tolist():
            starts[frozenset((start, end))] = next_number
            next_number += counts[knots] - 2
        for patch, corners in zip(patches, self.corners, strict=True):
            for axis in range(3):
                for (i, j), (start, end) in zip(product((0, -1), repeat=2), edges_along(corners, axis), strict=True):
                    inside = np.moveaxis(patch, axis, -1)[i, j, 1:-1]
                    row = starts[frozenset((start, end))] + np.arange(len(inside))
                    inside[...] = row if start < end else row[::-1]
        return next_number

    def _number_faces(self, patches: Sequence[IntArray], next_number: int) -> int:
        """Enter the numbers inside the faces of all patches, and return the next number."""
        grids: dict[frozenset[int], tuple[int, int, IntArray]] = {}
        for number, name, key in self._faces():
            axis, side = axis_side(name)
            inside = np.moveaxis(patches[number], axis, 0)[-side, 1:-1, 1:-1]
            corners = face_layer(self.corners[number], name)
            if key not in grids:
                origin, towards = self.hexahedra[number, FACES[name][:2]].tolist()
                shape = _laid(inside, corners, origin, towards).shape
                grids[key] = origin, towards, (next_number + np.arange(inside.size)).reshape(shape, order="F")
                next_number += inside.size
            origin, towards, grid = grids[key]
            grid = _laid(grid, corners, origin, towards)
            if grid.shape != inside.shape:
                raise ValueError(f"element {number}: the knot vectors of its face {name} are not its neighbour's")
            inside[...] = grid
        return next_number


def edges_along(corners: IntArray, axis: int) -> list[list[int]]:
    """Return start and end (4, 2) of the edges of a patch in a direction; corners: its vertices (2, 2, 2)."""
    return np.moveaxis(corners, axis, -1).reshape(4, 2).tolist()


def turned_knots(knots: Array, back: bool) -> Array:
    """Return a knot vector, the other way where `back`."""
    return knots[0] + (knots[-1] - knots[::-1]) if back else knots


def leading_edge(corners: IntArray, axis: int) -> list[int]:
    """Return start and end of the edge that tells which way the knots run; corners: of a patch, (2, 2, 2)."""
    return edges_along(corners, axis)[LEADING[axis]]


def bundles(cubes: IntArray) -> Iterator[list[tuple[int, int, bool]]]:
    """Yield the directions of patches whose edges run along with each other: patch, axis, whether the other way.

    cubes: the vertices of the patches (n, 2, 2, 2). Patches that share an edge run along with each other there.
    """
    axes = {(number, axis): edges_along(cube, axis) for number, cube in enumerate(cubes) for axis in range(3)}
    meeting: dict[frozenset[int], list[tuple[int, int]]] = {}
    for place, edges in axes.items():
        for pair in edges:
            meeting.setdefault(frozenset(pair), []).append(place)
    seen: set[tuple[int, int]] = set()
    for first in axes:
        bundle, waiting = [], [] if first in seen else [(*first, False)]
        seen.add(first)
        while waiting:
            number, axis, back = waiting.pop()
            bundle.append((number, axis, back))
            for pair in axes[number, axis]:
                for other in meeting[frozenset(pair)]:
                    if other not in seen:
                        seen.add(other)
                        waiting.append((*other, back != (pair not in axes[other])))
        if bundle:
            yield bundle


def _laid(grid: IntArray, corners: IntArray, origin: int, towards: int) -> IntArray:
    """Return an array in the order of a face; the array's first axis runs from one of its corners (2, 2) to another."""
    i, j = np.argwhere(corners == origin)[0]
    array = grid if corners[1 - i, j] == towards else grid.T
    return array[:: -1 if i else 1, :: -1 if j else 1]
