"""Defines the elements of other programs: which nodes of a lattice they take, in which order, and their functions.

C3D8 and C3D20 are those of Abaqus and CalculiX (CalculiX CrunchiX user's manual, "Element types"): corners first,
counterclockwise at the bottom and at the top; then the middles of the edges at the bottom, at the top, and upward.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, IntArray

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))


@dataclass(frozen=True, eq=False)
class Shape:
    """Hold an element's name in the files, the degree q of its lattice, and its nodes.

    nodes: (k, 3), places in the lattice from 0 to q, in the order of the files.
    """

    name: str
    degree: int
    nodes: IntArray

    def chosen(self, cells: IntArray) -> IntArray:
        """Return the nodes (e, k) in the files' order from cells (e, q + 1, q + 1, q + 1)."""
        i, j, k = self.nodes.T
        return cells[:, i, j, k]

    def functions(self, local: Array) -> Array:
        """Return the functions (m, k) of the nodes at coordinates (m, 3) from -1 to 1; they sum to 1."""
        ends = 2.0 * self.nodes / self.degree - 1.0  # (k, 3)
        along = 1.0 + local[:, None] * ends
        if self.degree == 1:
            return np.asarray(along.prod(axis=-1) / 8.0)
        middle = self.nodes == 1
        at_corner = along.prod(axis=-1) * ((local[:, None] * ends).sum(axis=-1) - 2.0) / 8.0
        on_edge = np.where(middle, 1.0 - local[:, None] ** 2, along).prod(axis=-1) / 4.0
        return np.where(middle.any(axis=-1), on_edge, at_corner)

    @cached_property
    def to_bernstein(self) -> Array:
        """Return the matrix ((q + 1)^3, k) from values at the nodes to Bernstein coefficients of degree q."""
        t = np.linspace(-1.0, 1.0, self.degree + 1)
        grid = np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
        values = self.functions(grid).reshape(*[self.degree + 1] * 3, -1)
        if self.degree == 2:
            for axis in range(3):
                first, middle, last = np.moveaxis(values, axis, 0)
                values = np.stack([first, 2.0 * middle - 0.5 * (first + last), last], axis=axis)
        return values.reshape(-1, len(self.nodes))


def _with_edges() -> IntArray:
    corners = 2 * np.array(CORNERS)
    return np.concatenate([corners, [(corners[a] + corners[b]) // 2 for a, b in EDGES]])


C3D8 = Shape("C3D8", 1, np.array(CORNERS))
C3D20 = Shape("C3D20", 2, _with_edges())
C3D20R = Shape("C3D20R", 2, _with_edges())
SHAPES = {shape.name: shape for shape in (C3D20, C3D20R, C3D8)}
