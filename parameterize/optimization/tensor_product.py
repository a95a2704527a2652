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
    """Apply a matrix (m, n) along axis 0, 1 or 2 of a field (3, n_0, n_1, n_2)."""
    if axis == 2:
        return field @ matrix.T
    if axis == 1:
        return matrix @ field
    a, b, c = field.shape[1:]
    return (matrix @ field.reshape(3, a, b * c)).reshape(3, -1, b, c)


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
class TensorGrid:
    """Basis values and derivatives (m, n) at the grid's points, one pair of matrices a direction."""

    values: tuple[Tensor, Tensor, Tensor]
    slopes: tuple[Tensor, Tensor, Tensor]

    def to(self, dtype: torch.dtype) -> TensorGrid:
        """The same grid in another precision."""
        values, slopes = (tuple(m.to(dtype) for m in part) for part in (self.values, self.slopes))
        return TensorGrid(values, slopes)  # type: ignore[arg-type]

    def jacobian(self, control: Tensor) -> Tensor:
        """(3, n_u, n_v, n_w) -> (3, 3, m_u, m_v, m_w): component, direction, grid."""
        (b0, b1, b2), (d0, d1, d2) = self.values, self.slopes
        plain, slope = along(b0, control, 0), along(d0, control, 0)
        by_v = along(d1, plain, 1)
        plain = along(b1, plain, 1)
        return torch.stack([along(b2, along(b1, slope, 1), 2), along(b2, by_v, 2), along(d2, plain, 2)], dim=1)

    def adjoint(self, dual: Tensor) -> Tensor:
        """The transpose of `jacobian`: (3, 3, m_u, m_v, m_w) -> (3, n_u, n_v, n_w)."""
        (b0, b1, b2), (d0, d1, d2) = ([m.T for m in part] for part in (self.values, self.slopes))
        slope = along(b1, along(b2, dual[:, 0], 2), 1)
        plain = along(d1, along(b2, dual[:, 1], 2), 1) + along(b1, along(d2, dual[:, 2], 2), 1)
        return along(d0, slope, 0) + along(b0, plain, 0)


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
        xm, xk, xh = along(m2, x, 2), along(k2, x, 2), along(h2, x, 2)
        mm = along(m1, xm, 1)
        first = along(k1, xm, 1) + along(m1, xk, 1)
        second = along(h1, xm, 1) + along(m1, xh, 1) + 2.0 * along(k1, xk, 1)
        result = along(self.weight * h0, mm, 0) + along(m0, self.weight * second, 0)
        return result + along(2.0 * self.weight * k0, first, 0)


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
        for axis, vectors in enumerate(self._vectors):
            residual = along(vectors.T, residual, axis)
        residual = residual * self._inverse
        for axis, vectors in enumerate(self._vectors):
            residual = along(vectors, residual, axis)
        return residual
