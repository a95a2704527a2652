"""Cuts a surface that surrounds the cube's centre along the rays through the cube's 12 edges.

Each edge of the cube spans, with the centre, a half plane where two coordinates (relative to the centre) are equal in
size and no smaller than the third. The triangles that cross such a half plane are split, which puts mesh vertices and
edges on it; seen from the centre the mesh then contains the 12 edges and 8 corners of the cube.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from ..surface.geometry import edge_table
from .cube import CubeLayout

NEAR_VERTEX = 0.1  # share of an edge's length: a crossing this close to a vertex takes the vertex and leaves no sliver
_COARSENING = 1.25  # factor of the longest edge each time a mesh would get too many points
_PLANES = [(a, b, sign) for a, b in ((0, 1), (0, 2), (1, 2)) for sign in (1.0, -1.0)]
_PIECES = np.array(  # pieces of a triangle 0, 1, 2 with new vertices 3 on side 0-1, 4 on 1-2, 5 on 2-0; two are 3 and 5
    [
        [(0, 1, 2), (0, 0, 0), (0, 0, 0), (0, 0, 0)],  # row k, of k new vertices, has k + 1 pieces; the rest is padding
        [(0, 3, 2), (3, 1, 2), (0, 0, 0), (0, 0, 0)],
        [(0, 3, 5), (3, 1, 2), (3, 2, 5), (0, 0, 0)],
        [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
    ]
)


@dataclass(frozen=True, eq=False)
class CutMesh:
    """Hold the triangles after splitting, and the places of their vertices on the original mesh.

    parents: (n, 2), original or earlier vertices. share: (n,); the position is (1 - share) * first + share * second.
    Vertices of the input are their own parents, with share 0. Parents of a new vertex always come before it.
    """

    faces: IntArray
    parents: IntArray
    share: Array

    def carry(self, values: Array) -> Array:
        """Return values (n, k) at all vertices, interpolated along split edges from values (n_input, k)."""
        result = np.empty((len(self.parents), values.shape[1]))
        n = len(values)
        result[:n] = values
        for i in range(n, len(result)):
            a, b = self.parents[i]
            result[i] = (1.0 - self.share[i]) * result[a] + self.share[i] * result[b]
        return result

    def laid_out(self, layout: CubeLayout) -> CubeLayout:
        """Return the layout of the input with this mesh's triangles, and with points and places at all vertices."""
        return CubeLayout(self.carry(layout.points), self.faces, self.carry(layout.places), layout.n_own)


def cut_along_rays(mapped: Array, faces: IntArray, snap: float = NEAR_VERTEX) -> CutMesh:
    """Return the mesh, vertices (n, 3) and faces (m, 3), split along the six planes of the cube's edges.

    A crossing closer to an end of an edge than `snap`, a share of the edge's length, uses that end instead of a new
    vertex.
    """
    position = mapped - 0.5
    n = len(position)
    parents, share = np.stack([np.arange(n)] * 2, axis=1), np.zeros(n)
    for a, b, sign in _PLANES:
        height = position[:, a] - sign * position[:, b]
        edges, where = _crossings(height, position, faces, (a, b, 3 - a - b), snap)
        new = (1.0 - where)[:, None] * position[edges[:, 0]] + where[:, None] * position[edges[:, 1]]
        new[:, b] = sign * new[:, a]  # on the plane, to the last bit
        faces = split_edges(faces, edges, len(position))
        position = np.concatenate([position, new])
        parents = np.concatenate([parents, edges])
        share = np.concatenate([share, where])
    return CutMesh(faces, parents, share)


def subdivide_long_edges(
    vertices: Array, faces: IntArray, longest: float, most: float = math.inf
) -> tuple[Array, IntArray] | None:
    """Halve mesh edges until none is longer than `longest`; the given vertices stay first, the surface is the same.

    vertices: (n, 3), or with further columns, which are interpolated as well. Returns None where this needs more than
    `most` vertices: long slivers may need millions.
    """
    while True:
        edges = edge_table(faces)[0]
        ends = vertices[edges]
        long = np.linalg.norm((ends[:, 1] - ends[:, 0])[:, :3], axis=1) > longest
        if not long.any():
            return vertices, faces
        if len(vertices) + np.count_nonzero(long) > most:
            return None
        faces = split_edges(faces, edges[long], len(vertices))
        vertices = np.concatenate([vertices, ends[long].mean(axis=1)])


def subdivide_finely(vertices: Array, faces: IntArray, longest: float, most: int) -> tuple[Array, IntArray]:
    """Halve edges longer than `longest`, a limit that grows until there are at most `most` points.

    vertices: (n, 3), or with further columns, which are interpolated as well. All given vertices are kept, even if
    there are more than `most`.
    """
    while True:
        found = subdivide_long_edges(vertices, faces, longest, max(most, len(vertices)))
        if found is not None:
            return found
        longest *= _COARSENING


def _crossings(
    height: Array, position: Array, faces: IntArray, axes: tuple[int, int, int], snap: float
) -> tuple[IntArray, Array]:
    """Return the mesh edges (k, 2) that a cube edge's half plane splits, and the places (k,) as shares of the edges.

    A triangle meets the plane in a segment. A triangle stays whole only where that segment lies entirely beyond one of
    the cube's corners; so, after all planes, no half plane passes through the inside of a triangle.
    """
    level = height[faces]
    sides = faces[(level.min(axis=1) < 0.0) & (level.max(axis=1) > 0.0)][:, [[0, 1], [1, 2], [2, 0]]]  # (k, 3, 2)
    sides.sort(axis=2)
    start, end = height[sides[:, :, 0]], height[sides[:, :, 1]]
    crossing = start * end < 0.0  # (k, 3)
    where = np.where(crossing, start, 0.0) / np.where(crossing, start - end, 1.0)
    where[end == 0.0] = 1.0
    point = position[sides[:, :, 0]] + where[..., None] * (position[sides[:, :, 1]] - position[sides[:, :, 0]])
    meets = crossing | (start == 0.0) | (end == 0.0)
    size, third = np.abs(point[..., axes[0]]), point[..., axes[2]]
    above, below = (meets & (third > -size)).any(axis=1), (meets & (third < size)).any(axis=1)
    split = crossing & (above & below)[:, None] & (where > snap) & (where < 1.0 - snap)
    edges, first = np.unique(sides[split], axis=0, return_index=True)
    return edges, where[split][first]


def split_edges(faces: IntArray, edges: IntArray, first_new: int) -> IntArray:
    """Return the faces (m', 3) after edges are split: vertex `first_new + i` lies on edge i.

    edges: (k, 2), each edge once, the smaller number first. A triangle with one split edge gives two triangles, with
    two split edges three, with three split edges four.
    """
    touched = np.zeros(int(faces.max()) + 1, dtype=bool)
    touched[edges.ravel()] = True
    candidate = touched[faces].sum(axis=1) >= 2
    face = faces[candidate]
    new = _numbers_on_sides(face, edges, first_new)
    there = new >= 0
    count = there.sum(axis=1)
    turns = there & ((count == 1)[:, None] | np.roll(there, 1, axis=1))  # the sides that may become side 0 - 1
    order = (turns.argmax(axis=1)[:, None] + np.arange(3)) % 3
    six = np.concatenate([np.take_along_axis(face, order, axis=1), np.take_along_axis(new, order, axis=1)], axis=1)
    pieces = np.take_along_axis(six, _PIECES[count].reshape(-1, 12), axis=1).reshape(-1, 4, 3)
    return np.concatenate([faces[~candidate], pieces[np.arange(4) <= count[:, None]]])


def _numbers_on_sides(face: IntArray, edges: IntArray, first_new: int) -> IntArray:
    """Return the numbers (m, 3) of the new vertices on the sides 0-1, 1-2, 2-0 of faces (m, 3), -1 without one."""
    if not len(edges):
        return np.full(face.shape, -1, dtype=np.int64)
    base = max(int(face.max(initial=0)), int(edges.max())) + 1
    keys = edges[:, 0].astype(np.int64) * base + edges[:, 1]
    order = np.argsort(keys)
    side = np.sort(np.stack([face, np.roll(face, -1, axis=1)], axis=-1), axis=-1)  # (m, 3, 2)
    asked = side[..., 0] * base + side[..., 1]
    place = order[np.minimum(np.searchsorted(keys, asked, sorter=order), len(keys) - 1)]
    return np.where(keys[place] == asked, first_new + place, -1)
