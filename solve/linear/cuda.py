"""The linear solve on torch tensors, on a GPU or, for tests, on the CPU: operator, preconditioner and iteration.

Where a CPU gains from knowing that few functions are nonzero at a point, a GPU gains from large matrix products: the
bases of directions v and w are dense matrices here, direction u goes layer by layer. Everything is double precision.
Geometry factors and load come from `operator.assemble` on the CPU.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

from parameterize.arrays import Array

from ..discretization.operator import Operator
from ..discretization.quadrature import Table
from .cg import LinearResult, conjugate_gradients
from .preconditioner import FastDiagonalization

LAYER_BYTES = 2**28  # of one field on a layer of points of u


def check_available(device: str) -> None:
    """Raise ValueError where torch has no such device here."""
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
    """As `conjugate_gradients` for an operator's free coefficients, on a torch device.

    Raises ValueError where torch has no such device.
    """
    check_available(device)
    apply = DeviceOperator(operator, device).apply_free
    right_there, start_there = (
        None if x is None else torch.as_tensor(np.ascontiguousarray(x), device=device) for x in (right, start)
    )
    result = conjugate_gradients(
        apply, right_there, device_preconditioner(preconditioner, device), tolerance, max_iterations, start_there
    )
    return LinearResult(result.x.cpu().numpy(), result.residuals, result.converged)


class DeviceOperator:
    """The operator with its factors as a tensor on a device."""

    def __init__(self, operator: Operator, device: str) -> None:
        self._window = operator.window
        self._shape = operator.space.shape
        q_u, v_blocks, q_w, terms, lanes = operator.factors.shape
        self._factors = torch.empty((q_u, terms, v_blocks * lanes, q_w), dtype=torch.float64, device=device)
        for q, factors in enumerate(operator.factors):  # (v blocks, q_w, terms, lanes)
            plane = torch.as_tensor(factors, device=device).permute(2, 0, 3, 1)
            self._factors[q] = plane.reshape(terms, v_blocks * lanes, q_w)
        rows = (q_u, v_blocks * lanes, q_w)  # points of v that only fill a block up have no function
        self._u, self._v, self._w = (
            [torch.as_tensor(_dense(table, n, count, d), device=device) for d in (0, 1)]
            for table, n, count in zip(operator.tables, self._shape, rows, strict=True)
        )
        first, last = operator.tables[0].first, operator.tables[0].first + operator.tables[0].values.shape[2]
        step = max(1, LAYER_BYTES // (8 * rows[1] * rows[2]))
        self._layers = [
            (slice(q, min(q + step, q_u)), slice(int(first[q]), int(last[min(q + step, q_u) - 1])))
            for q in range(0, q_u, step)
        ]

    def apply_free(self, free: Tensor) -> Tensor:
        """The product restricted to the free coefficients, a tensor of the window's shape."""
        full = free.new_zeros(self._shape)
        full[self._window] = free
        result = torch.zeros_like(full)
        for points, functions in self._layers:
            self._add_layer(full, points, functions, result)
        return result[self._window]

    def _add_layer(self, x: Tensor, points: slice, functions: slice, result: Tensor) -> None:
        """Add the part of some points of u, which see the given functions of u."""
        (b_v, d_v), (b_w, d_w) = self._v, self._w
        b_u, d_u = (matrix[points, functions] for matrix in self._u)
        planes, planes_u = (torch.tensordot(matrix, x[functions], 1) for matrix in (b_u, d_u))  # (q, n_v, n_w)
        lines = b_v @ planes  # (q, q_v, n_w)
        along = ((b_v @ planes_u) @ b_w.T, (d_v @ planes) @ b_w.T, lines @ d_w.T)  # (q, q_v, q_w) each
        uu, uv, uw, vv, vw, ww = self._factors[points, :6].unbind(1)
        flux_u = uu * along[0] + uv * along[1] + uw * along[2]
        flux_v = uv * along[0] + vv * along[1] + vw * along[2]
        back = (uw * along[0] + vw * along[1] + ww * along[2]) @ d_w
        if self._factors.shape[1] == 7:
            back += (self._factors[points, 6] * (lines @ b_w.T)) @ b_w
        planes = b_v.T @ back + d_v.T @ (flux_v @ b_w)
        planes_u = b_v.T @ (flux_u @ b_w)
        result[functions] += torch.tensordot(b_u.T, planes, 1) + torch.tensordot(d_u.T, planes_u, 1)


def device_preconditioner(preconditioner: FastDiagonalization, device: str) -> Callable[[Tensor], Tensor]:
    """Fast diagonalization on a device."""
    u, v, w = (torch.as_tensor(vectors, device=device) for vectors in preconditioner.vectors)
    inverse, scaling = (torch.as_tensor(d, device=device) for d in (preconditioner.inverse, preconditioner.scaling))

    def transform(u: Tensor, v: Tensor, w: Tensor, x: Tensor) -> Tensor:
        return (v @ torch.tensordot(u, x, 1)) @ w.T

    def precondition(residual: Tensor) -> Tensor:
        if preconditioner.singular:
            residual = residual - residual.mean()
        result = scaling * transform(u, v, w, inverse * transform(u.T, v.T, w.T, scaling * residual))
        return result - result.mean() if preconditioner.singular else result

    return precondition


def _dense(table: Table, n: int, rows: int, derivative: int) -> Array:
    """Matrix (rows, n) of the basis or its derivatives at the points of a table, with zero rows behind them."""
    dense = np.zeros((rows, n))
    columns = table.first[:, None] + np.arange(table.values.shape[2])
    np.put_along_axis(dense[: len(columns)], columns, table.values[derivative], axis=1)
    return dense
