"""Solves the linear system on torch tensors, on a GPU or, for tests, on the CPU: operator, preconditioner, iteration.

A CPU profits from the fact that few functions are nonzero at a point; a GPU profits from large matrix products: here
the bases of directions v and w are dense matrices, and direction u is processed layer by layer. All numbers are in
double precision. Geometry factors and load come from `operator.assemble` on the CPU.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients

from ..discretization.operator import Operator
from .preconditioner import FastDiagonalization

LAYER_BYTES = 2**28  # of one field on a layer of points of u


def check_available(device: str) -> None:
    """Raise ValueError where torch has no such device on this machine."""
    if device.startswith("cuda") and not torch.cuda.is_available():
        raise ValueError(f"device {device!r}: torch finds no CUDA GPU here; use device='cpu'")


def solve_on_device(
    operator: Operator,
    preconditioner: FastDiagonalization,
    right: Array,
    tolerance: float,
    max_iterations: int,
    device: str,
    start: Array | None = None,
) -> LinearResult:
    """Return the result of `conjugate_gradients` for an operator's free coefficients, computed on a torch device."""
    b, first = (None if x is None else torch.as_tensor(np.ascontiguousarray(x), device=device) for x in (right, start))
    inverse = device_preconditioner(preconditioner, device)
    found = conjugate_gradients(
        DeviceOperator(operator, device).apply_free, b, inverse, tolerance, max_iterations, first
    )
    return replace(found, x=found.x.cpu().numpy())


class DeviceOperator:
    """Apply the operator with its factors as a tensor on a device."""

    def __init__(self, operator: Operator, device: str) -> None:
        self._window, self._shape = operator.space.window, operator.space.shape
        self._factors = torch.as_tensor(operator.factors, device=device)
        self._u, self._v, self._w = (
            [torch.as_tensor(operator.dense(axis, d), device=device) for d in (0, 1)] for axis in range(3)
        )
        q_u, _, q_w, q_v = operator.factors.shape
        first, values, _ = operator.tables[0]
        last = first + values.shape[2]
        step = max(1, LAYER_BYTES // (8 * q_v * q_w))
        self._layers = [
            (slice(q, min(q + step, q_u)), slice(int(first[q]), int(last[min(q + step, q_u) - 1])))
            for q in range(0, q_u, step)
        ]

    def apply_free(self, free: Tensor) -> Tensor:
        """Return the product restricted to the free coefficients, a tensor of their shape."""
        full = free.new_zeros(self._shape)
        full[self._window] = free
        result = torch.zeros_like(full)
        for points, functions in self._layers:
            self._add_layer(full, points, functions, result)
        return result[self._window]

    def _add_layer(self, x: Tensor, points: slice, functions: slice, result: Tensor) -> None:
        """Add the part of some points of u, at which the given functions of u are not zero, to the product."""
        (b_v, d_v), (b_w, d_w) = self._v, self._w
        b_u, d_u = (matrix[points, functions] for matrix in self._u)
        planes, planes_u = (torch.tensordot(matrix, x[functions], 1) for matrix in (b_u, d_u))  # (q, n_v, n_w)
        lines = b_w @ (b_v @ planes).mT  # (q, q_w, q_v), as all that follow
        along = (b_w @ (b_v @ planes_u).mT, b_w @ (d_v @ planes).mT, d_w @ (b_v @ planes).mT)
        uu, uv, uw, vv, vw, ww = self._factors[points, :6].unbind(1)
        flux_u = uu * along[0] + uv * along[1] + uw * along[2]
        flux_v = uv * along[0] + vv * along[1] + vw * along[2]
        back = d_w.T @ (uw * along[0] + vw * along[1] + ww * along[2])  # (q, n_w, q_v)
        if self._factors.shape[1] == 7:
            back += b_w.T @ (self._factors[points, 6] * lines)
        planes = (back @ b_v + b_w.T @ flux_v @ d_v).mT
        planes_u = (b_w.T @ flux_u @ b_v).mT
        result[functions] += torch.tensordot(b_u.T, planes, 1) + torch.tensordot(d_u.T, planes_u, 1)


def device_preconditioner(preconditioner: FastDiagonalization, device: str) -> FastDiagonalization:
    """Return fast diagonalization with tensors on a device."""
    arrays = (*preconditioner.vectors, preconditioner.inverse, preconditioner.scaling)
    u, v, w, inverse, scaling = (torch.as_tensor(part, device=device) for part in arrays)
    return _OnDevice(preconditioner.space, (u, v, w), inverse, scaling, preconditioner.singular)  # type: ignore[arg-type]


class _OnDevice(FastDiagonalization):
    def _along_u(self, u: Any, x: Any, after: Any = None) -> Any:
        result = torch.tensordot(u, x, 1)
        return result if after is None else after * result

    def _across(self, v: Any, w: Any, x: Any, before: Any = None, after: Any = None) -> Any:
        result = (v @ (x if before is None else before * x)) @ w.T
        return result if after is None else after * result
