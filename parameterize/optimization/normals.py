"""Penalty on places of F's boundary that do not face the way the mesh does.

A boundary that runs back over itself may have det J > 0 everywhere: the part in between faces inwards, and the closest
points of the mesh cannot be one-to-one on it. What is asked for is (t_a x t_b) . n >= floor at the surface points, t_a
and t_b the tangents of F along the cube's face and n the mesh's normal (the paper's normal term, eq. 12, one-sided).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.sparse import csr_array
from torch import Tensor

from ..arrays import Array, IntArray
from .cg import Operator
from .polar import cross
from .tensor_product import to_torch


@dataclass(frozen=True, eq=False)
class FacingPenalty:
    """Sum of weight (floor - (t_a x t_b) . n)_+^2 over k points.

    along: matrices (k, control points) of t_a and t_b; normals (3, k), pointing out of the cube where (a, b, outwards)
    is right-handed and into it elsewhere; weights (k,).
    """

    along: tuple[Tensor, Tensor]
    back: tuple[Tensor, Tensor]  # their transposes
    normals: Tensor
    weights: Tensor
    floor: float

    def energy_and_gradient(self, control: Tensor) -> tuple[float, Tensor]:
        """The penalty at control points (3, n_u, n_v, n_w), and its gradient."""
        by_a, by_b, size = self._slopes(control)
        shortfall = (self.floor - size).clamp_min(0.0)
        gradient = self._pull(-2.0 * self.weights * shortfall, by_a, by_b, control)
        return float(self.weights @ shortfall.square()), gradient

    def curvature(self, control: Tensor, dtype: torch.dtype) -> Operator:
        """The Gauss-Newton part of the second derivative at `control`."""
        single = self._to(dtype)
        by_a, by_b, size = single._slopes(control.to(dtype))
        scale = 2.0 * single.weights * (size < self.floor)

        def product(x: Tensor) -> Tensor:
            flat = x.reshape(3, -1).T
            a, b = ((matrix @ flat).T for matrix in single.along)
            return single._pull(scale * ((by_a * a).sum(0) + (by_b * b).sum(0)), by_a, by_b, x)

        return product

    def _slopes(self, control: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """(t_a x t_b) . n, last, after its derivatives in t_a and t_b: (3, k) each."""
        flat = control.reshape(3, -1).T
        a, b = ((matrix @ flat).T for matrix in self.along)
        by_a, by_b = cross(b[None], self.normals[None])[0], cross(self.normals[None], a[None])[0]
        return by_a, by_b, (a * by_a).sum(0)

    def _pull(self, factor: Tensor, by_a: Tensor, by_b: Tensor, like: Tensor) -> Tensor:
        pulled = self.back[0] @ (factor * by_a).T + self.back[1] @ (factor * by_b).T
        return pulled.T.reshape(like.shape)

    def _to(self, dtype: torch.dtype) -> FacingPenalty:
        along = tuple(m.to(dtype) for m in self.along)
        back = tuple(m.to(dtype) for m in self.back)
        return FacingPenalty(along, back, self.normals.to(dtype), self.weights.to(dtype), self.floor)  # type: ignore[arg-type]


def facing_penalty(
    indices: IntArray,
    slopes: tuple[Array, Array],
    count: int,
    normals: Array,
    weights: Array,
    floor: float,
    device: torch.device,
) -> FacingPenalty:
    """From the control points (k, c) of each of k points, their weights in t_a and t_b (k, c), and normals (k, 3)."""
    starts = np.arange(0, indices.size + 1, indices.shape[1])
    rows = [csr_array((s.ravel(), indices.ravel(), starts), shape=(len(indices), count)) for s in slopes]
    a, b = (to_torch(r, device) for r in rows)
    back_a, back_b = (to_torch(csr_array(r.T), device) for r in rows)
    return FacingPenalty(
        (a, b),
        (back_a, back_b),
        torch.as_tensor(np.ascontiguousarray(normals.T), device=device),
        torch.as_tensor(weights, device=device),
        floor,
    )
