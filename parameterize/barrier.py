"""Penalty on the Bernstein coefficients of det J over chosen spans: what the certificate tests is what is penalised.

Penalties on sampled determinants leave folds between the samples, above all along the 12 edges of the cube: there the
surface is smooth, so the three tangents of an exact fit lie in one plane and det J vanishes. What gives way is the fit:
within the first spans next to an edge F keeps a small crease, as large as the floor on the coefficients asks for.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array
from torch import Tensor

from .bspline import Array, basis_derivatives, breakpoints
from .rotation import determinant
from .tensor_grid import to_torch


class SpanBarrier:
    """Mean over all spans of (floor - coefficient)_+^2, 0 on spans not active; coefficients of det J in Bernstein form.

    knots: the same degree p in the three directions; floor in units of det J.
    """

    def __init__(self, knots: tuple[Array, Array, Array], degree: int, floor: float, *, device: torch.device) -> None:
        self.knots, self.degree, self.floor, self.device = knots, degree, floor, device
        self.sizes = tuple(len(k) - degree - 1 for k in knots)
        order = 3 * degree
        nodes: Array = 0.5 - 0.5 * np.cos(np.pi * (np.arange(order) + 0.5) / order)  # Chebyshev points of [0, 1]
        bernstein = _bernstein(order - 1, nodes)
        self._to_coefficients = self._tensor(np.linalg.inv(bernstein).astype(np.float64))  # (3 p, 3 p)
        self._tables = [_span_tables(k, degree, nodes) for k in knots]
        self._n_spans = int(np.prod([len(breakpoints(k)) - 1 for k in knots]))
        self.active = np.zeros((0, 3), dtype=np.int64)

    def activate(self, spans: NDArray[np.int64]) -> None:
        """Add spans (k, 3) to the active ones."""
        self.active = np.unique(np.concatenate([self.active, spans]), axis=0)
        windows = [self._tables[d][0][self.active[:, d]][:, None] + np.arange(self.degree + 1) for d in range(3)]
        i, j, k = windows
        flat = (i[:, :, None, None] * self.sizes[1] + j[:, None, :, None]) * self.sizes[2] + k[:, None, None, :]
        ones, starts = np.ones(flat.size), np.arange(flat.size + 1)
        gather = csr_array((ones, flat.ravel(), starts), shape=(flat.size, int(np.prod(self.sizes))))
        self._gather, self._scatter = to_torch(gather, self.device), to_torch(csr_array(gather.T), self.device)
        pick = [[self._tensor(table[self.active[:, d]]) for table in self._tables[d][1:]] for d in range(3)]
        self._values, self._slopes = zip(*pick, strict=True)

    def energy_and_gradient(self, control: Tensor) -> tuple[float, Tensor]:
        """The penalty at control points (3, n_u, n_v, n_w), and its gradient."""
        if len(self.active) == 0:
            return 0.0, torch.zeros_like(control)
        width = self.degree + 1
        local = (self._gather @ control.reshape(3, -1).T).reshape(-1, width, width, width, 3)
        local = local.permute(0, 4, 1, 2, 3).contiguous().requires_grad_()
        with torch.enable_grad():
            energy = (self.floor - self._coefficients(local)).clamp_min(0.0).square().mean(
                dim=(1, 2, 3)
            ).sum() / self._n_spans
            (gradient,) = torch.autograd.grad(energy, local)
        rows = gradient.permute(0, 2, 3, 4, 1).reshape(-1, 3)
        return float(energy.detach()), (self._scatter @ rows).T.reshape(control.shape)

    def _coefficients(self, local: Tensor) -> Tensor:
        """Control points of the spans (k, 3, p + 1, p + 1, p + 1) -> Bernstein coefficients (k, 3 p, 3 p, 3 p)."""
        columns = []
        for d in range(3):
            field = local
            for axis in range(3):
                table = self._slopes[axis] if axis == d else self._values[axis]
                field = _batched_along(table, field, axis)
            columns.append(field.transpose(0, 1).flatten(1))  # (3, k * (3 p)^3)
        det = determinant(torch.stack(columns, dim=1)).reshape(len(local), *[3 * self.degree] * 3)
        t = self._to_coefficients
        det = det @ t.T
        det = t @ det
        return (t @ det.flatten(2)).reshape(det.shape)

    def _tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, dtype=torch.float64, device=self.device)


def _batched_along(table: Tensor, field: Tensor, axis: int) -> Tensor:
    """Apply (k, m, n) along axis 0, 1 or 2 of (k, 3, n_0, n_1, n_2), span by span."""
    if axis == 2:
        return field @ table.transpose(1, 2)[:, None, None]
    if axis == 1:
        return table[:, None, None] @ field
    k, c, a, b, w = field.shape
    return (table[:, None] @ field.reshape(k, c, a, b * w)).reshape(k, c, -1, b, w)


def _span_tables(knots: Array, degree: int, nodes: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Of every span: its first basis function, and values and slopes at its nodes (n_spans, n_nodes, p + 1)."""
    breaks = breakpoints(knots)
    points = breaks[:-1, None] + np.diff(breaks)[:, None] * nodes
    first, values = basis_derivatives(knots, degree, points.ravel(), 1)
    shape = (*points.shape, degree + 1)
    return first.reshape(points.shape)[:, 0], values[0].reshape(shape), values[1].reshape(shape)


def _bernstein(degree: int, x: Array) -> Array:
    """Bernstein polynomials at x: (m, degree + 1); they are the B-splines of a single span."""
    knots = np.repeat([0.0, 1.0], degree + 1)
    return basis_derivatives(knots, degree, x)[1][0]


def edge_spans(n_spans: tuple[int, int, int]) -> NDArray[np.int64]:
    """Spans (k, 3) that touch one of the cube's 12 edges."""
    index = np.indices(n_spans).reshape(3, -1).T
    at_side = (index == 0) | (index == np.array(n_spans) - 1)
    return index[at_side.sum(axis=1) >= 2]
