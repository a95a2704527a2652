"""Penalty on the Bernstein coefficients of det J over chosen spans: what the certificate tests is what is penalised.

Penalties on sampled determinants leave folds between the samples, above all along the 12 edges of the cube: there the
surface is smooth, so the three tangents of an exact fit lie in one plane and det J vanishes. What gives way is the fit:
within the first spans next to an edge F keeps a small crease, as large as the floor on the coefficients asks for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse import csr_array
from torch import Tensor

from ..arrays import Array
from ..spline.bernstein import extraction
from ..spline.bspline import basis_derivatives, breakpoints
from .cg import Operator
from .polar import cofactor
from .tensor_product import to_torch

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
        inverse: Array = np.linalg.inv(_bernstein(order - 1, nodes)).astype(np.float64)
        self._double = _Tables(self._tensor(tables[0]), self._tensor(tables[1]), self._tensor(inverse))
        self._single = self._double.single()
        self._extractions = [extraction(k, degree) for k in knots]
        self._widths = [np.diff(breakpoints(k)) for k in knots]
        n_spans = int(np.prod([len(w) for w in self._widths]))
        self._share = 1.0 / (n_spans * order**3)
        self.active = np.zeros((0, 3), dtype=np.int64)

    def activate(self, spans: NDArray[np.int64]) -> None:
        """Add spans (k, 3) to the active ones."""
        self.active = np.unique(np.concatenate([self.active, spans]), axis=0)
        k, width = len(self.active), self.degree + 1
        if k == 0:
            return
        windows, weights = [], []
        for d, (first, weight) in enumerate(self._extractions):
            windows.append(first[self.active[:, d]][:, None] + np.arange(width))
            weights.append(weight[self.active[:, d]])
        flat = (windows[0][:, :, None, None] * self.sizes[1] + windows[1][:, None, :, None]) * self.sizes[2]
        columns = np.broadcast_to((flat + windows[2][:, None, None, :]).reshape(k, width**3), (width**3, k, width**3))
        rows = np.einsum("kax,kby,kcz->abckxyz", *weights, optimize=True)
        starts = np.arange(width**3 * k + 1) * width**3
        shape = (width**3 * k, int(np.prod(self.sizes)))
        bezier = csr_array((rows.ravel(), columns.ravel(), starts), shape=shape)
        bezier.eliminate_zeros()
        self._bezier, self._transposed = to_torch(bezier, self.device), to_torch(csr_array(bezier.T), self.device)
        volumes = np.prod([w[self.active[:, d]] for d, w in enumerate(self._widths)], axis=0)
        self._per_volume = self._tensor(1.0 / volumes)  # (k,)

    def energy_and_gradient(self, control: Tensor) -> tuple[float, Tensor]:
        """The penalty at control points (3, n_u, n_v, n_w), and its gradient."""
        if len(self.active) == 0:
            return 0.0, torch.zeros_like(control)
        bezier = self._bezier_points(control)
        pushed, energy = torch.empty_like(bezier), 0.0
        for block in self._blocks():
            cofactors, shortfall = self._shortfall(self._double, bezier[..., block], self._per_volume[block])
            energy += float(shortfall.square().sum())
            dual = self._double.to_nodes(-2.0 * shortfall * self._per_volume[block])
            pushed[..., block] = self._double.jacobian_adjoint(cofactors * dual.flatten())
        return self._share * energy, self._share * self._from_bezier(pushed, self._transposed)

    def curvature(self, control: Tensor) -> Operator:
        """The Gauss-Newton part of the second derivative at `control`, as an operator in single precision."""
        if len(self.active) == 0:
            return torch.zeros_like
        bezier, tables = self._bezier_points(control).float(), self._single
        per_volume = self._per_volume.float()
        parts = []
        for block in self._blocks():
            cofactors, shortfall = self._shortfall(tables, bezier[..., block], per_volume[block])
            busy = torch.nonzero((shortfall > 0.0).flatten(0, 2).any(0))[:, 0]
            count = len(shortfall[0, 0, 0])
            picked = cofactors.view(3, 3, -1, count)[..., busy].flatten(2)
            mask = (2.0 * self._share) * ((shortfall > 0.0) * per_volume[block] ** 2)[..., busy]
            parts.append((busy + block.start, picked, mask))
        matrix, transposed = self._bezier.float(), self._transposed.float()

        def product(x: Tensor) -> Tensor:
            local = self._to_bezier(x, matrix)
            pushed = torch.zeros_like(local)
            for busy, cofactors, mask in parts:
                if len(busy) == 0:
                    continue
                change = (cofactors * tables.jacobian(local[..., busy])).sum(dim=(0, 1))
                dual = tables.to_nodes(mask * tables.to_coefficients(change.view(mask.shape)))
                pushed[..., busy] = tables.jacobian_adjoint(cofactors * dual.flatten())
            return self._from_bezier(pushed, transposed)

        return product

    def _blocks(self) -> list[slice]:
        return [slice(start, start + _BLOCK) for start in range(0, len(self.active), _BLOCK)]

    def _bezier_points(self, control: Tensor) -> Tensor:
        return self._to_bezier(control, self._bezier)

    def _to_bezier(self, control: Tensor, matrix: Tensor) -> Tensor:
        """Bezier points of the active spans: (3, p + 1, p + 1, p + 1, k)."""
        width = self.degree + 1
        return (matrix @ control.reshape(3, -1).T).T.reshape(3, width, width, width, -1)

    def _from_bezier(self, pushed: Tensor, transposed: Tensor) -> Tensor:
        return (transposed @ pushed.reshape(3, -1).T).T.reshape(3, *self.sizes)

    def _shortfall(self, tables: _Tables, bezier: Tensor, per_volume: Tensor) -> tuple[Tensor, Tensor]:
        """Cofactors of J at the nodes (3, 3, (3 p)^3 k), and how far the coefficients are below the floor."""
        jacobian = tables.jacobian(bezier.contiguous())
        cofactors = cofactor(jacobian)
        det = (jacobian[0] * cofactors[0]).sum(0).view(*[3 * self.degree] * 3, -1)
        return cofactors, (self.floor - tables.to_coefficients(det) * per_volume).clamp_min(0.0)

    def _tensor(self, values: Array) -> Tensor:
        return torch.as_tensor(values, dtype=torch.float64, device=self.device)


@dataclass(frozen=True, eq=False)
class _Tables:
    """Bernstein polynomials and slopes at the nodes (3 p, p + 1); from values there to coefficients (3 p, 3 p)."""

    values: Tensor
    slopes: Tensor
    inverse: Tensor

    def single(self) -> _Tables:
        """The same in single precision."""
        return _Tables(self.values.float(), self.slopes.float(), self.inverse.float())

    def jacobian(self, bezier: Tensor) -> Tensor:
        """Bezier points of the spans (3, p + 1, p + 1, p + 1, k) -> J on unit spans at all nodes (3, 3, (3 p)^3 k)."""
        plain, slope = _along(self.values, bezier, 3), _along(self.slopes, bezier, 3)
        by_w = _along(self.values, slope, 2)
        by_v, plain = _along(self.slopes, plain, 2), _along(self.values, plain, 2)
        columns = _along(self.slopes, plain, 1), _along(self.values, by_v, 1), _along(self.values, by_w, 1)
        return torch.stack([c.flatten(1) for c in columns], dim=1)

    def jacobian_adjoint(self, dual: Tensor) -> Tensor:
        """The transpose of `jacobian`."""
        values, slopes, nodes = self.values.T, self.slopes.T, len(self.values)
        by_u, by_v, by_w = dual.view(3, 3, nodes, nodes, nodes, -1).unbind(1)
        plain = _along(values, _along(slopes, by_u, 1), 2) + _along(slopes, _along(values, by_v, 1), 2)
        slope = _along(values, _along(values, by_w, 1), 2)
        return _along(values, plain, 3) + _along(slopes, slope, 3)

    def to_coefficients(self, field: Tensor) -> Tensor:
        """Values at the nodes -> Bernstein coefficients, (3 p, 3 p, 3 p, k)."""
        for axis in range(3):
            field = _along(self.inverse, field, axis)
        return field

    def to_nodes(self, field: Tensor) -> Tensor:
        """The transpose of `to_coefficients`."""
        for axis in range(3):
            field = _along(self.inverse.T, field, axis)
        return field


def _along(table: Tensor, field: Tensor, axis: int) -> Tensor:
    """Apply (m, n) along one axis, not the last, of a field: as few and as large products as the layout allows."""
    before, after = field.shape[:axis], field.shape[axis + 1 :]
    return (table @ field.reshape(-1, field.shape[axis], after.numel())).view(*before, len(table), *after)


def _bernstein(degree: int, x: Array) -> Array:
    """Bernstein polynomials at x: (m, degree + 1); they are the B-splines of a single span."""
    knots = np.repeat([0.0, 1.0], degree + 1)
    return basis_derivatives(knots, degree, x)[1][0]


def edge_spans(n_spans: tuple[int, int, int]) -> NDArray[np.int64]:
    """Spans (k, 3) that touch one of the cube's 12 edges."""
    index = np.indices(n_spans).reshape(3, -1).T
    at_side = (index == 0) | (index == np.array(n_spans) - 1)
    return index[at_side.sum(axis=1) >= 2]
