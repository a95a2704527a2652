"""Draws the samples of the losses: interior stencils (section 4.4.2) and surface triangles, both with a seed."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..arrays import Array, IntArray
from ..config import TrainConfig
from ..surface.geometry import normals_and_areas
from ..surface.solid import Solid

# The 19 of 3^3 lattice offsets that first and second differences need, centre first.
_STEPS = np.array(list(np.ndindex(3, 3, 3))) - 1
OFFSETS = np.concatenate([_STEPS[np.count_nonzero(_STEPS, axis=1) == moved] for moved in range(3)])


@dataclass(frozen=True, eq=False)
class Stencils:
    """Hold a lattice that covers the domain, and for each stencil centre its 19 lattice points.

    nodes: (n, 3), positions. index: (r, 19) into nodes, in the order of OFFSETS. cell: the lattice spacing h.
    """

    nodes: Tensor
    index: Tensor
    cell: float

    def shifted(self, generator: torch.Generator) -> Tensor:
        """Return the nodes, all moved by one random vector of [-h/2, h/2]^3."""
        shift = torch.rand(3, generator=generator, dtype=self.nodes.dtype) - 0.5
        return self.nodes + (self.cell * shift).to(self.nodes.device)


def gather(rows: Tensor, index: Tensor) -> Tensor:
    """Return rows[index] for rows (n, k) and an index of any shape, with a repeatable gradient.

    The gradient of plain indexing adds repeated rows in an order that depends on the threads.
    """
    return rows.index_select(0, index.flatten()).view(*index.shape, rows.shape[1])


def stencils(vertices: Array, faces: IntArray, cell: float, *, device: torch.device, dtype: torch.dtype) -> Stencils:
    """Return stencils around every lattice point inside the surface or within h/2 of it, to cover it at any shift."""
    solid = Solid(vertices, faces)
    index = solid.lattice_near(cell, cell / 2.0)
    centres = index[solid.signed_distances(np.asarray(cell * index, dtype=np.float64)) < cell / 2.0]
    needed, inverse = np.unique((centres[:, None, :] + OFFSETS).reshape(-1, 3), axis=0, return_inverse=True)
    return Stencils(
        torch.as_tensor(needed * cell, dtype=dtype, device=device),
        torch.as_tensor(inverse.reshape(-1, len(OFFSETS)), device=device),
        cell,
    )


class TriangleSampler:
    """Draw triangles with probability proportional to area, or all triangles where there are at most `count`."""

    def __init__(self, vertices: Array, faces: IntArray, count: int, device: torch.device) -> None:
        _, area = normals_and_areas(vertices, faces)
        self._cumulative = torch.as_tensor(np.cumsum(area / area.sum()))
        self._count = min(count, len(faces))
        self._device = device

    def draw(self, generator: torch.Generator) -> Tensor:
        """Return indices (count,) of triangles by systematic sampling: one random offset along the cumulated area."""
        if self._count == len(self._cumulative):
            return torch.arange(self._count, device=self._device)
        start = torch.rand(1, generator=generator, dtype=torch.float64)
        ticks = (torch.arange(self._count) + start) / self._count
        picks = torch.searchsorted(self._cumulative, ticks).clamp(max=len(self._cumulative) - 1)
        return picks.to(self._device)


def points_of_a_step(vertices: Array, faces: IntArray, train: TrainConfig) -> int:
    """Return the number of points that the network maps in a step; vertices (n, 3) at volume 1, faces (m, 3)."""
    nodes = stencils(vertices, faces, train.cell, device=torch.device("cpu"), dtype=torch.float32).nodes
    return len(nodes) + min(len(vertices), 3 * train.triangles)
