"""Draws the samples of the losses: interior stencils (section 4.4.2) and surface triangles, both with a seed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..arrays import Array, IntArray
from ..config import TrainConfig
from ..surface.geometry import normals_and_areas
from ..surface.solid import Solid

# The 19 of 3^3 lattice offsets that first and second differences need, centre first.
_STEPS = np.array(list(np.ndindex(3, 3, 3))) - 1
OFFSETS = np.concatenate([_STEPS[np.count_nonzero(_STEPS, axis=1) == moved] for moved in range(3)])
_PLACES = {tuple(offset): place for place, offset in enumerate(OFFSETS.tolist())}
_UNITS = np.eye(3, dtype=np.int64)
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # directions of the second differences, in their order
_LAYER = 2.6  # cells: the nodes that `stencils` has outside of a body lie in a layer as thick, within 8 %


def _differences() -> tuple[Array, Array]:
    """Return the weights of the stencil's points in first (3, 19) and in second differences (6, 19), for spacing 1."""
    first, second = np.zeros((3, 19)), np.zeros((6, 19))
    for a in range(3):
        for side in (-1, 1):
            first[a, _PLACES[tuple(side * _UNITS[a])]] = 0.5 * side
    for row, (a, b) in enumerate(_PAIRS):
        if a == b:
            second[row, 0] = -2.0
            second[row, [_PLACES[tuple(side * _UNITS[a])] for side in (-1, 1)]] = 1.0
        else:
            for left, right in np.ndindex(2, 2):
                place = _PLACES[tuple((2 * left - 1) * _UNITS[a] + (2 * right - 1) * _UNITS[b])]
                second[row, place] = 0.25 * (2 * left - 1) * (2 * right - 1)
    return first, second


@dataclass(frozen=True, eq=False)
class Stencils:
    """Hold a lattice that covers the domain, and for each stencil centre its 19 lattice points.

    nodes: (n, 3), positions. index: (r, 19) into nodes, in the order of OFFSETS. cell: the lattice spacing h.
    """

    nodes: Array
    index: IntArray
    cell: float

    def shifted(self, generator: np.random.Generator) -> Array:
        """Return the nodes, all moved by one random vector of [-h/2, h/2]^3."""
        return self.nodes + self.cell * generator.uniform(-0.5, 0.5, 3)

    @cached_property
    def differences(self) -> csr_array:
        """Return the matrix (9 r, n) from values at the nodes to the derivatives at the stencils.

        Its rows are three first derivatives of all stencils, then three pure and three mixed second ones.
        """
        first, second = _differences()
        weights = np.concatenate([first / self.cell, second / self.cell**2])
        kind, place = np.nonzero(weights)
        count = len(self.index)
        rows = count * kind[:, None] + np.arange(count)
        values = np.broadcast_to(weights[kind, place][:, None], rows.shape)
        columns = self.index[:, place].T
        return csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(9 * count, len(self.nodes)))


def stencils(vertices: Array, faces: IntArray, cell: float) -> Stencils:
    """Return stencils around every lattice point inside the surface or within h/2 of it, to cover it at any shift."""
    solid = Solid(vertices, faces)
    index = solid.lattice_near(cell, cell / 2.0)
    centres = index[solid.signed_distances(np.asarray(cell * index, dtype=np.float64)) < cell / 2.0]
    needed, inverse = np.unique((centres[:, None, :] + OFFSETS).reshape(-1, 3), axis=0, return_inverse=True)
    return Stencils(needed * cell, inverse.reshape(-1, len(OFFSETS)), cell)


class TriangleSampler:
    """Draw triangles with probability proportional to area, or all triangles where there are at most `count`."""

    def __init__(self, vertices: Array, faces: IntArray, count: int) -> None:
        _, area = normals_and_areas(vertices, faces)
        self._cumulative = np.cumsum(area / area.sum())
        self._count = min(count, len(faces))

    def draw(self, generator: np.random.Generator) -> IntArray:
        """Return indices (count,) of triangles by systematic sampling: one random offset along the cumulated area."""
        if self._count == len(self._cumulative):
            return np.arange(self._count)
        ticks = (np.arange(self._count) + generator.random()) / self._count
        return np.searchsorted(self._cumulative, ticks).clip(max=len(self._cumulative) - 1)


def points_of_a_step(vertices: Array, faces: IntArray, train: TrainConfig) -> int:
    """Estimate the number of points that the network maps in a step; vertices (n, 3) at volume 1, faces (m, 3)."""
    area = float(normals_and_areas(vertices, faces)[1].sum())
    nodes = (1.0 + _LAYER * train.cell * area) / train.cell**3
    return round(nodes) + min(len(vertices), 3 * train.triangles)
