"""Tensor-product splines as torch contractions: Jacobians on a grid, 1-D matrices, Kronecker operators.

Control points are held as (3, n_u, n_v, n_w), component first, so that every contraction is one large matrix product.
"""

from __future__ import annotations

import warnings
from copy import copy
from dataclasses import dataclass

import numpy as np
import torch
from scipy.sparse import csr_array
from torch import Tensor

from ..arrays import Array
from ..spline.bspline import collocation, gauss_points

_END_SPANS = 1


def along(matrix: Tensor, field: Tensor, axis: int) -> Tensor:
    """Apply a matrix (m, n) along one axis of a field, in as few and as large products as the layout allows."""
    before, after = field.shape[:axis], field.shape[axis + 1 :]
    if not after:
        return field @ matrix.T
    return (matrix @ field.reshape(-1, field.shape[axis], after.numel())).view(*before, len(matrix), *after)


def to_torch(matrix: csr_array, device: torch.device) -> Tensor:
    """A scipy CSR matrix as a torch CSR tensor, float64."""
    starts, columns = (
        torch.as_tensor(part.astype(np.int64), device=device) for part in (matrix.indptr, matrix.indices)
    )
    data = torch.as_tensor(matrix.data, device=device)
    with warnings.catch_warnings():  # torch calls its CSR tensors beta, once a process
        warnings.simplefilter("ignore", UserWarning)
        return torch.sparse_csr_tensor(starts, columns, data, size=matrix.shape)


@dataclass(frozen=True, eq=False)
class ControlRows:
    """A sparse matrix (N, n_u n_v n_w) that applies to control points (3, n_u, n_v, n_w), and its transpose."""

    matrix: Tensor
    transposed: Tensor

    @classmethod
    def of(cls, rows: csr_array, device: torch.device) -> ControlRows:
        """Take the rows of a scipy matrix."""
        return cls(to_torch(rows, device), to_torch(csr_array(rows.T), device))

    def to(self, dtype: torch.dtype) -> ControlRows:
        """Return the same rows in another precision."""
        return ControlRows(self.matrix.to(dtype), self.transposed.to(dtype))

    def __call__(self, control: Tensor) -> Tensor:
        """Return the values (N, 3) at control points."""
        return self.matrix @ control.reshape(3, -1).T

    def adjoint(self, dual: Tensor, like: Tensor) -> Tensor:
        """Apply the transpose to (N, 3); the result has the shape of the control points `like`."""
        return (self.transposed @ dual).T.reshape(like.shape)


@dataclass(frozen=True, eq=False)
class TensorGrid:
    """Basis values and derivatives (m, n) at the grid's points, one pair of matrices a direction.

    order: the directions in the order of their contraction. Fields may have further axes behind the three of the grid;
    there the contractions are fastest from the last direction to the first.
    """

    values: tuple[Tensor, Tensor, Tensor]
    slopes: tuple[Tensor, Tensor, Tensor]
    order: tuple[int, int, int] = (0, 1, 2)

    def to(self, dtype: torch.dtype) -> TensorGrid:
        """Return the same grid in another precision."""
        values, slopes = (tuple(m.to(dtype) for m in part) for part in (self.values, self.slopes))
        return TensorGrid(values, slopes, self.order)  # type: ignore[arg-type]

    def jacobian(self, control: Tensor) -> Tensor:
        """Return J (component, direction, grid): (3, n_u, n_v, n_w, ...) -> (3, 3, m_u, m_v, m_w, ...)."""
        i, j, k = self.order
        values, slopes = self.values, self.slopes
        plain, by_i = along(values[i], control, i + 1), along(slopes[i], control, i + 1)
        by_i = along(values[j], by_i, j + 1)
        plain, by_j = along(values[j], plain, j + 1), along(slopes[j], plain, j + 1)
        columns = {
            i: along(values[k], by_i, k + 1),
            j: along(values[k], by_j, k + 1),
            k: along(slopes[k], plain, k + 1),
        }
        return torch.stack([columns[direction] for direction in range(3)], dim=1)

    def adjoint(self, dual: Tensor) -> Tensor:
        """Apply the transpose of `jacobian`: (3, 3, m_u, m_v, m_w, ...) -> (3, n_u, n_v, n_w, ...)."""
        i, j, k = self.order
        values, slopes = ([m.T for m in part] for part in (self.values, self.slopes))
        by_i = along(values[j], along(values[k], dual[:, i], k + 1), j + 1)
        by_j = along(slopes[j], along(values[k], dual[:, j], k + 1), j + 1)
        plain = by_j + along(values[j], along(slopes[k], dual[:, k], k + 1), j + 1)
        return along(slopes[i], by_i, i + 1) + along(values[i], plain, i + 1)


def gauss_grid(
    knots: tuple[Array, ...],
    degrees: tuple[int, ...],
    n_gauss: int,
    *,
    inner: int | None = None,
    device: torch.device,
    dtype: torch.dtype,
) -> tuple[TensorGrid, tuple[Tensor, ...]]:
    """Grid of Gauss points and the three weight vectors: `n_gauss` points a span and direction.

    inner: points on all spans but the first and last. One is enough there for smooth splines, which have one basis
    function a span (the half-point rule of Hughes, Reali, Sangalli, CMAME 199, 2010).
    """
    values, slopes, weights = [], [], []
    for k, p in zip(knots, degrees, strict=True):
        points, weight = _graded_points(k, n_gauss, n_gauss if inner is None else inner)
        values.append(_dense(k, p, points, 0, device, dtype))
        slopes.append(_dense(k, p, points, 1, device, dtype))
        weights.append(torch.as_tensor(weight, dtype=dtype, device=device))
    return TensorGrid(tuple(values), tuple(slopes)), tuple(weights)  # type: ignore[arg-type]


def _graded_points(knots: Array, outer: int, inner: int) -> tuple[Array, Array]:
    """Gauss points and weights (m,): `outer` on the first and last span, `inner` on the others."""
    fine, coarse = gauss_points(knots, outer), gauss_points(knots, inner)
    split = min(_END_SPANS, len(fine[0]) // 2)
    middle = slice(split, len(fine[0]) - split)
    points, weights = (
        np.concatenate([f[:split].ravel(), c[middle].ravel(), f[len(f) - split :].ravel()])
        for f, c in zip(fine, coarse, strict=True)
    )
    return points, weights


def _dense(knots: Array, degree: int, x: Array, derivative: int, device: torch.device, dtype: torch.dtype) -> Tensor:
    return torch.as_tensor(collocation(knots, degree, x, derivative).toarray(), dtype=dtype, device=device)


def gram(knots: Array, degree: int, derivative: int, *, device: torch.device, dtype: torch.dtype) -> Tensor:
    """1-D matrix of integrals of products of `derivative`-th derivatives (n, n): mass, stiffness, bending."""
    points, weights = gauss_points(knots, degree + 1)
    table = _dense(knots, degree, points.ravel(), derivative, device, dtype)
    return table.T @ (torch.as_tensor(weights.ravel(), dtype=dtype, device=device)[:, None] * table)


def grams(knots: tuple[Array, ...], degree: int, device: torch.device) -> list[tuple[Tensor, ...]]:
    """Mass, stiffness and bending matrices, each for the three directions; float64."""
    return [tuple(gram(k, degree, d, device=device, dtype=torch.float64) for k in knots) for d in range(3)]


@dataclass(frozen=True, eq=False)
class BendingOperator:
    """x -> weight * H x with x^T H x = int |Hessian F|^2 (exact)."""

    mass: tuple[Tensor, ...]
    slope: tuple[Tensor, ...]
    curve: tuple[Tensor, ...]
    weight: float

    def to(self, dtype: torch.dtype) -> BendingOperator:
        """The same in another precision."""
        mass, slope, curve = (tuple(m.to(dtype) for m in part) for part in (self.mass, self.slope, self.curve))
        return BendingOperator(mass, slope, curve, self.weight)

    def __call__(self, x: Tensor) -> Tensor:
        """(3, n_u, n_v, n_w) -> the same shape."""
        (m0, m1, m2), (k0, k1, k2), (h0, h1, h2) = self.mass, self.slope, self.curve
        xm, xk, xh = along(m2, x, 3), along(k2, x, 3), along(h2, x, 3)
        mm = along(m1, xm, 2)
        first = along(k1, xm, 2) + along(m1, xk, 2)
        second = along(h1, xm, 2) + along(m1, xh, 2) + 2.0 * along(k1, xk, 2)
        result = along(self.weight * h0, mm, 1) + along(m0, self.weight * second, 1)
        return result + along(2.0 * self.weight * k0, first, 1)


class FastDiagonalization:
    """Inverse of A_0 x M x M + M x A_1 x M + M x M x A_2 + shift * M x M x M (Lynch, Rice, Thomas 1964).

    matrices: three symmetric A_d (n, n); mass: three M_d. Three generalised eigenproblems, then products only.
    """

    def __init__(self, matrices: tuple[Tensor, ...], mass: tuple[Tensor, ...], shift: float = 0.0) -> None:
        vectors, values = [], []
        for a, m in zip(matrices, mass, strict=True):
            factor = torch.linalg.cholesky(m)
            half = torch.linalg.solve_triangular(factor, a, upper=False)
            value, vector = torch.linalg.eigh(torch.linalg.solve_triangular(factor, half.T, upper=False))
            vectors.append(torch.linalg.solve_triangular(factor.T, vector, upper=True))
            values.append(value)
        self._vectors = tuple(vectors)
        u, v, w = values
        self._inverse = 1.0 / (u[:, None, None] + v[:, None] + w + shift)

    def to(self, dtype: torch.dtype) -> FastDiagonalization:
        """The same in another precision."""
        other = copy(self)
        other._vectors, other._inverse = tuple(v.to(dtype) for v in self._vectors), self._inverse.to(dtype)
        return other

    def __call__(self, residual: Tensor) -> Tensor:
        """(3, n_u, n_v, n_w) -> the same shape."""
        for axis, vectors in enumerate(self._vectors, start=1):
            residual = along(vectors.T, residual, axis)
        residual = residual * self._inverse
        for axis, vectors in enumerate(self._vectors, start=1):
            residual = along(vectors, residual, axis)
        return residual
