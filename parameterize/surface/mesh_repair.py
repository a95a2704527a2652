"""MeshRepair: a mesh while it is repaired. Each step takes one and returns the next one, with notices."""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, IntArray, in_brackets
from .geometry import used_vertices


@dataclass(frozen=True, eq=False)
class MeshRepair:
    """A surface before it is accepted.

    vertices: (n, 3), in the user's units. points: (n, 3), (vertices - middle) / size, in a box of side 1. faces: (m,
    3), vertex numbers. old: (m,), the number of each face in the input, -1 for a face that was added.
    """

    vertices: Array
    points: Array
    faces: IntArray
    old: IntArray
    middle: Array
    size: float

    def where(self, vertex: int) -> str:
        """Return the place of a vertex in the user's units, in words."""
        return in_brackets(self.vertices[vertex])

    def with_faces(self, kept: IntArray) -> "MeshRepair":
        """Return the mesh of the kept faces (k,), with the same vertices."""
        return replace(self, faces=self.faces[kept], old=self.old[kept])

    def with_copies(self, copied: IntArray, faces: IntArray) -> "MeshRepair":
        """Return the mesh with copies of some vertices (k,) behind the others, and faces (m, 3) that use them."""
        vertices, points = (np.concatenate([rows, rows[copied]]) for rows in (self.vertices, self.points))
        return replace(self, vertices=vertices, points=points, faces=faces)

    def with_patches(self, points: Array, faces: IntArray) -> "MeshRepair":
        """Return the mesh with further vertices, points (k, 3) in the box, and further faces (t, 3)."""
        return replace(
            self,
            vertices=np.concatenate([self.vertices, points * self.size + self.middle]),
            points=np.concatenate([self.points, points]),
            faces=np.concatenate([self.faces, faces]),
            old=np.concatenate([self.old, np.full(len(faces), -1)]),
        )

    def compact(self) -> "MeshRepair":
        """Return the mesh without the vertices that no face uses."""
        kept = used_vertices(self.faces)
        numbers = np.zeros(len(self.vertices), dtype=np.int64)
        numbers[kept] = np.arange(len(kept))
        faces = numbers[self.faces]
        return replace(self, vertices=self.vertices[kept], points=self.points[kept], faces=faces)
