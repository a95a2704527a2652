"""Draws the samples of the losses: interior stencils (section 4.4.2) and surface triangles, both with a seed."""

from dataclasses import dataclass

import igl
import numpy as np
import torch
from torch import Tensor

from ..arrays import Array, IntArray
from ..surface.geometry import normals_and_areas

# The 19 of 3^3 lattice offsets that first and second differences need, centre first.
_STEPS = np.array(list(np.ndindex(3, 3, 3))) - 1
_SMALL = 8  # lattice points along a part of the lattice that is not halved further
_ROUNDING = 1e-6  # error of a distance, in cells
_ACCURACY = 2.0  # of the fast winding number
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


def signed_distance(points: Array, vertices: Array, faces: IntArray) -> Array:
    """Return the distance (m,) of points (m, 3) to the surface, negative inside."""
    kind = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    return np.asarray(igl.signed_distance(points, vertices, faces, sign_type=kind)[0])


def near_or_inside(vertices: Array, faces: IntArray, cell: float, margin: float) -> IntArray:
    """Return the integer coordinates (k, 3), ascending, of all lattice points inside, and of some beside the surface.

    The bounding box, extended by `margin`, is halved until a part is small, or farther than `margin` from the box or
    plane of every triangle. Such far parts are kept only inside the surface: a thin body that is not parallel to the
    axes fills little of its box.
    """
    corners = vertices[faces]
    grown = np.stack([corners.min(axis=1) - margin, corners.max(axis=1) + margin], axis=1) / cell  # (m, 2, 3)
    normals, _ = normals_and_areas(vertices, faces)
    heights = (normals * corners[:, 0]).sum(axis=1) / cell
    winding, found = igl.FastWindingNumberBVH(), []
    winding.init(vertices, faces)
    low, high = np.floor(grown[:, 0].min(axis=0)).astype(int), np.ceil(grown[:, 1].max(axis=0)).astype(int)
    parts = [(low, high, np.arange(len(faces)))]
    while parts:
        low, high, near = parts.pop()
        near = near[((grown[near, 0] <= high) & (grown[near, 1] >= low)).all(axis=1)]
        off = np.abs(normals[near] @ (low + high) / 2.0 - heights[near])
        near = near[off <= np.abs(normals[near]) @ (high - low) / 2.0 + margin / cell + _ROUNDING]
        if not len(near) and winding.winding_number(cell * low[None].astype(float), _ACCURACY)[0] < 0.5:
            continue
        axis = int((high - low).argmax())
        middle = (low[axis] + high[axis]) // 2
        if not len(near) or high[axis] - low[axis] < _SMALL:
            axes = [np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
            found.append(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))
            continue
        below, above = high.copy(), low.copy()
        below[axis], above[axis] = middle, middle + 1
        parts += [(low, below, near), (above, high, near)]
    index = np.concatenate(found)
    return index[np.lexsort(index.T[::-1])]


def stencils(vertices: Array, faces: IntArray, cell: float, *, device: torch.device, dtype: torch.dtype) -> Stencils:
    """Return stencils around every lattice point inside the surface or within h/2 of it, to cover it at any shift."""
    index = near_or_inside(vertices, faces, cell, cell / 2.0)
    centres = index[signed_distance(np.asarray(cell * index, dtype=np.float64), vertices, faces) < cell / 2.0]
    needed, inverse = np.unique((centres[:, None, :] + OFFSETS).reshape(-1, 3), axis=0, return_inverse=True)
    return Stencils(
        torch.as_tensor(needed * cell, dtype=dtype, device=device),
        torch.as_tensor(inverse.reshape(-1, len(OFFSETS)), device=device),
        cell,
    )


def interior_points(vertices: Array, faces: IntArray, cell: float) -> Array:
    """Return the lattice points (k, 3) inside the surface."""
    points = near_or_inside(vertices, faces, cell, 0.0) * cell
    return points[igl.fast_winding_number(vertices, faces, points) > 0.5]


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
