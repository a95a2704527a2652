"""Polyhedron: the plane faces of a body, as polygons between its corners."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, IntArray
from ...surface.geometry import directed_edges, edge_triangles
from ...surface.plane_faces import Planes, planes_of
from ..planar.polygons import edges_of

MOST_FACES = 64  # of a body that is divided along its planes: a tessellated curved surface has more


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """A body that plane faces bound.

    Attributes
    ----------
    vertices : (n, 3) array
        Of the surface.
    triangles : (m, 3) array of int
        Of the surface, wound outward.
    planes : Planes
        The faces as parts of the surface.
    loops : tuple of tuples of tuples of int
        Of each face its polygons, as vertices that are corners of the body: the outer polygon is counterclockwise seen
        from outside, those around holes are clockwise.
    """

    vertices: Array
    triangles: IntArray
    planes: Planes
    loops: tuple[tuple[tuple[int, ...], ...], ...]

    @cached_property
    def corners(self) -> IntArray:
        """Return the vertices at which faces have corners, ascending."""
        return np.unique([vertex for face in self.loops for loop in face for vertex in loop])

    @property
    def edges(self) -> list[tuple[int, int, int, int]]:
        """Return two faces at each edge and its two ends, in the order in which the first face runs through them."""
        sides = {(a, b): number for number, loops in enumerate(self.loops) for loop in loops for a, b in edges_of(loop)}
        return [(face, sides[b, a], a, b) for (a, b), face in sides.items() if a < b and (b, a) in sides]

    @cached_property
    def diagonal(self) -> float:
        """Return the diagonal of the box around the body."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))


def polyhedron_of(vertices: Array, triangles: IntArray) -> Polyhedron | None:
    """Return the body of a closed surface as a polyhedron; None where it has more than MOST_FACES plane parts.

    None is returned, too, where a face touches itself at a vertex.
    """
    planes = planes_of(vertices, triangles, MOST_FACES)
    if planes is None:
        return None
    corners = _corners(planes.parts, triangles)
    following = _borders(planes.parts, triangles)
    if following is None:
        return None
    loops = tuple(tuple(_loops(row, corners)) for row in following)
    if any(len(loop) < 3 for face in loops for loop in face):
        return None
    return Polyhedron(vertices, triangles, planes, loops)


def _corners(parts: IntArray, triangles: IntArray) -> set[int]:
    """Return the vertices at which three or more faces meet."""
    pairs = np.unique(np.stack([triangles.ravel(), np.repeat(parts, 3)], axis=1), axis=0)
    return set(np.flatnonzero(np.bincount(pairs[:, 0]) >= 3).tolist())


def _borders(parts: IntArray, triangles: IntArray) -> list[dict[int, int]] | None:
    """Return for each face the vertex that follows each vertex of its border; None where two may follow."""
    following: list[dict[int, int]] = [{} for _ in range(int(parts.max()) + 1)]
    edges, pairs = edge_triangles(triangles)
    border = {tuple(edge) for edge in edges[parts[pairs[:, 0]] != parts[pairs[:, 1]]].tolist()}
    for number, (a, b) in enumerate(directed_edges(triangles).tolist()):
        if (min(a, b), max(a, b)) in border:
            row = following[parts[number // 3]]
            if a in row:
                return None
            row[a] = b
    return following


def _loops(following: dict[int, int], corners: set[int]) -> list[tuple[int, ...]]:
    """Return the closed chains of a border, each as its corners, the chain with the lowest vertex first."""
    left, loops = set(following), []
    while left:
        start = min(left)
        chain, vertex = [start], following[start]
        while vertex != start:
            chain.append(vertex)
            vertex = following[vertex]
        left -= set(chain)
        loops.append(tuple(vertex for vertex in chain if vertex in corners))
    return loops
