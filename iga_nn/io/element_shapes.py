"""Defines the elements of other programs: which nodes of a lattice they take, in which order, and their functions.

C3D8 and C3D20 are those of Abaqus and CalculiX (CalculiX CrunchiX user's manual, "Element types"): corners first,
counterclockwise at the bottom and at the top; then the middles of the edges at the bottom, at the top, and upward.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from parameterize.arrays import Array, IntArray

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))


@dataclass(frozen=True, eq=False)
class ElementShape:
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


@dataclass(frozen=True, eq=False)
class Full(ElementShape):
    """Hold an element with all nodes of its lattice: the map of degree q through them."""

    def functions(self, local: Array) -> Array:
        """Return the functions (m, k) of the nodes at coordinates (m, 3) from -1 to 1; they sum to 1."""
        t = np.linspace(-1.0, 1.0, self.degree + 1)
        rows = [
            np.prod([(local - other) / (own - other) for other in t if other != own], axis=0) for own in t
        ]  # of each place of a direction: (m, 3)
        along = np.stack(rows)  # (q + 1, m, 3)
        return np.asarray(np.prod([along[self.nodes[:, axis], :, axis] for axis in range(3)], axis=0).T)

    @cached_property
    def to_bernstein(self) -> Array:
        """Return the matrix ((q + 1)^3, k) from values at the nodes to Bernstein coefficients of degree q."""
        q, t = self.degree, np.linspace(0.0, 1.0, self.degree + 1)
        values = np.stack([comb(q, k) * t**k * (1.0 - t) ** (q - k) for k in range(q + 1)], axis=1)
        one = np.linalg.inv(values)
        whole = np.einsum("ai,bj,ck->abcijk", one, one, one).reshape((q + 1) ** 3, *[q + 1] * 3)
        i, j, k = self.nodes.T
        return np.asarray(whole[:, i, j, k])


def _of_gmsh(degree: int) -> IntArray:
    """Return the places (k, 3) of the nodes of gmsh's hexahedra: corners, edges, faces, and the inside.

    Gmsh reference manual, "Node ordering"; what is inside of a face or of the element is ordered as a smaller one.
    """
    corners = np.array(CORNERS)
    found = [degree * corners]
    steps = np.arange(1, degree)[:, None]
    found += [degree * corners[a] + steps * (corners[b] - corners[a]) for a, b in GMSH_EDGES]
    if degree == 2:
        found += [corners[list(face)].sum(axis=0)[None] // 2 for face in GMSH_FACES]
        return np.concatenate([*found, np.ones((1, 3), dtype=np.int64)])
    for face in GMSH_FACES:
        own = corners[list(face)]
        found.append(degree * own + np.where(np.ptp(own, axis=0) > 0, 1 - 2 * own, 0))  # a step along the face
    return np.concatenate([*found, 1 + corners])


GMSH_EDGES = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))
GMSH_FACES = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))

C3D8 = ElementShape("C3D8", 1, np.array(CORNERS))
C3D20 = ElementShape("C3D20", 2, _with_edges())
C3D20R = ElementShape("C3D20R", 2, _with_edges())
SHAPES = {shape.name: shape for shape in (C3D20, C3D20R, C3D8)}
HEX27 = Full("hex27", 2, _of_gmsh(2))
HEX64 = Full("hex64", 3, _of_gmsh(3))
GMSH_SHAPES = {shape.name: shape for shape in (HEX64, HEX27)}
