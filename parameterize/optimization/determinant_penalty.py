"""Penalty on the Bernstein coefficients of det J over chosen spans: what the certificate tests is what is penalised.

Penalties on sampled determinants leave folds between the samples, above all along the 12 edges of the cube: there the
surface is smooth, so the three tangents of an exact fit lie in one plane and det J vanishes. What gives way is the fit:
within the first spans next to an edge F keeps a small crease, as large as the floor on the coefficients asks for.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ..arrays import Array
from ..spline.bernstein import extraction
from ..spline.bspline import basis_derivatives, breakpoints, sparse_rows, window_numbers
from .cg import Operator
from .polar import cofactor_and_determinant
from .tensor_product import ControlRows, TensorGrid, along

_BLOCK = 32  # spans at a time: what they need fits into the cache


class SpanBarrier:
    """Mean over all spans of (floor - coefficient)_+^2, 0 on spans not active; coefficients of det J in Bernstein form.

    knots: the same degree p in the three directions; floor in units of det J.
    """

    def __init__(self, knots: tuple[Array, Array, Array], degree: int, floor: float, *, device: torch.device) -> None:
        self.knots, self.degree, self.floor, self.device = knots, degree, floor, device
        self.sizes = tuple(len(k) - degree - 1 for k in knots)
        order = 3 * degree  # coefficients of det J a direction
        nodes: Array = 0.5 - 0.5 * np.cos(np.pi * (np.arange(order) + 0.5) / order)  # Chebyshev points of [0, 1]
        _, tables = basis_derivatives(np.repeat([0.0, 1.0], degree + 1), degree, nodes, 1)  # a single span: Bernstein
        values, slopes = self._tensor(tables[0]), self._tensor(tables[1])  # (3 p, p + 1) each
        self._grid = TensorGrid((values,) * 3, (slopes,) * 3, order=(2, 1, 0))  # J on unit spans at the nodes
        # From values at the nodes to Bernstein coefficients along one direction, (3 p, 3 p).
        self._interpolation = self._tensor(np.linalg.inv(_bernstein(order - 1, nodes)).astype(np.float64))
        self._extractions = [extraction(k, degree) for k in knots]
        self._widths = [np.diff(breakpoints(k)) for k in knots]
        n_spans = int(np.prod([len(w) for w in self._widths]))
        self._share = 1.0 / (n_spans * order**3)
        self.active = np.zeros((0, 3), dtype=np.int64)

    def activate(self, spans: NDArray[np.int64]) -> None:
        """Add spans (k, 3) to the active ones."""
        self.active = np.unique(np.concatenate([self.active, spans]), axis=0)
        if len(self.active) == 0:
            return
        windows, weights = [], []
        for d, (first, weight) in enumerate(self._extractions):
            windows.append(first[self.active[:, d]][:, None] + np.arange(self.degree + 1))
            weights.append(weight[self.active[:, d]])
        columns = window_numbers(windows, self.sizes)  # (k, (p + 1)^3)
        rows = np.einsum("kax,kby,kcz->abckxyz", *weights, optimize=True).reshape(-1, columns.shape[1])
        bezier = sparse_rows(rows, np.tile(columns, (columns.shape[1], 1)), int(np.prod(self.sizes)))
        bezier.eliminate_zeros()
        self._rows = ControlRows.of(bezier, self.device)
        volumes = np.prod([w[self.active[:, d]] for d, w in enumerate(self._widths)], axis=0)
        self._per_volume = self._tensor(1.0 / volumes)  # (k,)

    def energy_and_gradient(self, control: Tensor) -> tuple[float, Tensor]:
        """The penalty at control points (3, n_u, n_v, n_w), and its gradient."""
        if len(self.active) == 0:
            return 0.0, torch.zeros_like(control)
        bezier = self._bezier_points(self._rows, control)
        pushed, energy = torch.empty_like(bezier), 0.0
        for block in self._blocks():
            cofactors, shortfall = self._shortfall(bezier[..., block], self._per_volume[block])
            energy += float(shortfall.square().sum())
            dual = _on_all_axes(self._interpolation.T, -2.0 * shortfall * self._per_volume[block])
            pushed[..., block] = self._grid.adjoint(cofactors * dual)
        return self._share * energy, self._share * self._rows.adjoint(pushed.reshape(3, -1).T, control)

    def curvature(self, control: Tensor) -> Operator:
        """The Gauss-Newton part of the second derivative at `control`, as an operator in single precision."""
        if len(self.active) == 0:
            return torch.zeros_like
        bezier = self._bezier_points(self._rows, control).float()
        per_volume, rows, grid = self._per_volume.float(), self._rows.to(torch.float32), self._grid.to(torch.float32)
        interpolation = self._interpolation.float()
        parts = []
        for block in self._blocks():
            cofactors, shortfall = self._shortfall(bezier[..., block], per_volume[block])
            busy = torch.nonzero((shortfall > 0.0).flatten(0, 2).any(0))[:, 0]
            mask = (2.0 * self._share) * ((shortfall > 0.0) * per_volume[block] ** 2)[..., busy]
            parts.append((busy + block.start, cofactors[..., busy], mask))

        def product(x: Tensor) -> Tensor:
            local = self._bezier_points(rows, x)
            pushed = torch.zeros_like(local)
            for busy, cofactors, mask in parts:
                if len(busy) == 0:
                    continue
                change = (cofactors * grid.jacobian(local[..., busy])).sum(dim=(0, 1))
                dual = _on_all_axes(interpolation.T, mask * _on_all_axes(interpolation, change))
                pushed[..., busy] = grid.adjoint(cofactors * dual)
            return rows.adjoint(pushed.reshape(3, -1).T, x)

        return product

    def _blocks(self) -> list[slice]:
        return [slice(start, start + _BLOCK) for start in range(0, len(self.active), _BLOCK)]

    def _bezier_points(self, rows: ControlRows, control: Tensor) -> Tensor:
        """Return the Bezier points of the active spans: (3, p + 1, p + 1, p + 1, k)."""
        width = self.degree + 1
        return rows(control).T.reshape(3, width, width, width, -1)

    def _shortfall(self, bezier: Tensor, per_volume: Tensor) -> tuple[Tensor, Tensor]:
        """Return the cofactors of J at the nodes (3, 3, n, n, n, k), and how far coefficients are below the floor."""
        jacobian = self._grid.to(bezier.dtype).jacobian(bezier.contiguous())
        cofactors, det = cofactor_and_determinant(jacobian.flatten(2))
        coefficients = _on_all_axes(self._interpolation.to(bezier.dtype), det.view(jacobian.shape[2:]))
        return cofactors.view(jacobian.shape), (self.floor - coefficients * per_volume).clamp_min(0.0)

    def _tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, dtype=torch.float64, device=self.device)


def _on_all_axes(table: Tensor, field: Tensor) -> Tensor:
    """Apply a square table along the three axes of a field (n, n, n, k)."""
    for axis in range(3):
        field = along(table, field, axis)
    return field


def _bernstein(degree: int, x: Array) -> Array:
    """Bernstein polynomials at x: (m, degree + 1); they are the B-splines of a single span."""
    knots = np.repeat([0.0, 1.0], degree + 1)
    return basis_derivatives(knots, degree, x)[1][0]


def edge_spans(n_spans: tuple[int, int, int]) -> NDArray[np.int64]:
    """Spans (k, 3) that touch one of the cube's 12 edges."""
    index = np.indices(n_spans).reshape(3, -1).T
    at_side = (index == 0) | (index == np.array(n_spans) - 1)
    return index[at_side.sum(axis=1) >= 2]
