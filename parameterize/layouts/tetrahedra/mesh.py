"""Defines TetrahedralMesh, the tetrahedra of a part with their cubic nodes on it, and the numbering of these nodes."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...arrays import Array, IntArray, Mask

EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
FACES = np.array([(1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)])  # opposite vertices 0, 1, 2 and 3
ORDER = 3


def _thirds() -> IntArray:
    """Return three times the barycentric coordinates (20, 4): of vertices, of two nodes an edge, and of one a face."""
    rows = list(ORDER * np.eye(4, dtype=np.int64))
    for first, second in EDGES:
        rows += [2 * rows[first] // 3 + rows[second] // 3, rows[first] // 3 + 2 * rows[second] // 3]
    rows += [rows[a] // 3 + rows[b] // 3 + rows[c] // 3 for a, b, c in FACES]
    return np.array(rows)


THIRDS = _thirds()


@dataclass(frozen=True, eq=False)
class TetrahedralMesh:
    """Tetrahedra that keep the corners, edges and faces of a part.

    Attributes
    ----------
    points : (n, 3) array
    cells : (t, 4) array of int
        The vertices of each tetrahedron, of positive volume.
    solids : (t,) array of int
        The solid of each, counted from 0.
    triangles : (b, 3) array of int
        Those on the boundary, and between solids.
    faces : (b,) array of int
        The face of the part on which each of them lies, counted from 1.
    segments : (s, 2) array of int
        The edges of triangles that lie on edges of the part.
    curves : (s,) array of int
        The edge of the part.
    nodes : (t, 20, 3) array
        The cubic nodes of each tetrahedron, on the part where the tetrahedron's own edges and faces are.
    gaps : (b,) array
        How far each cubic triangle is from the part between its nodes; empty if it is not known.
    """

    points: Array
    cells: IntArray
    solids: IntArray
    triangles: IntArray
    faces: IntArray
    segments: IntArray
    curves: IntArray
    nodes: Array
    gaps: Array = field(default_factory=lambda: np.empty(0))

    def with_gaps(self, gaps: Array) -> "TetrahedralMesh":
        """Return the mesh with the distances (t, 4) of the faces opposite to the four vertices from the part."""
        of_faces = np.zeros(len(self.numbering.faces))
        np.maximum.at(of_faces, self.numbering.cells[:, -len(FACES) :] - self.numbering.first_face, gaps)
        return replace(self, gaps=of_faces[rows_in(self.numbering.faces, np.sort(self.triangles, axis=1))])

    @cached_property
    def numbering(self) -> "CubicNumbering":
        """Return the numbers of the cubic nodes."""
        return CubicNumbering.of(len(self.points), self.cells)

    @property
    def straight(self) -> Array:
        """Return the cubic nodes (k, 3) of the straight tetrahedra, by their numbers."""
        return self.numbering.gathered(np.einsum("nk,tkx->tnx", THIRDS / ORDER, self.points[self.cells]))

    @cached_property
    def on_part(self) -> Mask:
        """Return whether each cubic node lies on the boundary, or between solids."""
        return self.numbering.of_triangles(self.triangles)

    @property
    def volumes(self) -> Array:
        """Return the volumes (t,) of the straight tetrahedra."""
        return volumes_of(self.points[self.cells])


@dataclass(frozen=True, eq=False)
class CubicNumbering:
    """The cubic nodes of tetrahedra by numbers: vertices, then two on each edge, then one on each face.

    edges: (e, 2) and faces: (f, 3), their vertices ascending. cells: (t, 20), the nodes of each tetrahedron.
    """

    vertices: int
    edges: IntArray
    faces: IntArray
    cells: IntArray

    @classmethod
    def of(cls, vertices: int, cells: IntArray) -> "CubicNumbering":
        """Return the numbering for tetrahedra (t, 4) of so many vertices."""
        edges, own_edges = np.unique(np.sort(cells[:, EDGES], axis=2).reshape(-1, 2), axis=0, return_inverse=True)
        faces, own_faces = np.unique(np.sort(cells[:, FACES], axis=2).reshape(-1, 3), axis=0, return_inverse=True)
        turned = (cells[:, EDGES[:, 0]] > cells[:, EDGES[:, 1]]).astype(np.int64)
        first = vertices + 2 * own_edges.reshape(-1, len(EDGES))
        on_edges = np.stack([first + turned, first + 1 - turned], axis=2).reshape(len(cells), -1)
        on_faces = vertices + 2 * len(edges) + own_faces.reshape(-1, len(FACES))
        return cls(vertices, edges, faces, np.concatenate([cells, on_edges, on_faces], axis=1))

    def __len__(self) -> int:
        return self.vertices + 2 * len(self.edges) + len(self.faces)

    @property
    def first_face(self) -> int:
        """Return the number of the first node on a face."""
        return self.vertices + 2 * len(self.edges)

    def gathered(self, values: Array) -> Array:
        """Return values (k, 3) by number of those of each tetrahedron (t, 20, 3), which agree where they are shared."""
        found = np.zeros((len(self), 3))
        found[self.cells] = values
        return found

    @cached_property
    def edges_of_faces(self) -> IntArray:
        """Return the edges (f, 3) of the faces: those between vertices 0 and 1, 0 and 2, 1 and 2."""
        pairs = np.stack([self.faces[:, [0, 1]], self.faces[:, [0, 2]], self.faces[:, [1, 2]]], axis=1)
        return rows_in(self.edges, pairs.reshape(-1, 2)).reshape(-1, 3)

    def of_triangles(self, triangles: IntArray) -> Mask:
        """Return whether each node lies on one of the triangles (b, 3)."""
        chosen = np.zeros(len(self), dtype=bool)
        faces = rows_in(self.faces, np.sort(triangles, axis=1))
        edges = self.edges_of_faces[faces]
        for numbers in (triangles, self.vertices + 2 * edges, self.vertices + 2 * edges + 1, self.first_face + faces):
            chosen[numbers] = True
        return chosen


def volumes_of(corners: Array) -> Array:
    """Return the volumes (t,) of tetrahedra by their corners (t, 4, 3)."""
    return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0


def rows_in(table: IntArray, rows: IntArray) -> IntArray:
    """Return where rows (n, k) stand in a table (m, k) of rows in ascending order, which holds all of them."""
    base = int(table.max()) + 1
    keys, wanted = (
        sum(part[:, k] * base ** (part.shape[1] - 1 - k) for k in range(part.shape[1])) for part in (table, rows)
    )
    return np.searchsorted(keys, wanted)
