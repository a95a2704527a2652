"""Preconditioned conjugate gradients on torch tensors of any shape, and a preconditioner for tensor-product splines."""

from collections.abc import Callable
from copy import copy

import torch
from torch import Tensor

from ..threads import in_parallel
from .tensor_product import along

Operator = Callable[[Tensor], Tensor]


def conjugate_gradients(
    operator: Operator, right: Tensor, precondition: Operator, *, tolerance: float, max_iterations: int
) -> tuple[Tensor, int]:
    """Solve operator(x) = right from x = 0 until |r| <= tolerance |right|; returns x and the iterations done."""
    x = torch.zeros_like(right)
    residual = right.clone()
    goal = tolerance * float(right.norm())
    direction = precondition(residual)
    product = float((residual * direction).sum())
    for iteration in range(max_iterations):
        if float(residual.norm()) <= goal:
            return x, iteration
        image = operator(direction)
        step = product / float((direction * image).sum())
        x += step * direction
        residual -= step * image
        scaled = precondition(residual)
        new_product = float((residual * scaled).sum())
        direction = scaled + (new_product / product) * direction
        product = new_product
    return x, max_iterations


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

    def to(self, dtype: torch.dtype) -> "FastDiagonalization":
        """Return the same in another precision."""
        other = copy(self)
        other._vectors, other._inverse = tuple(v.to(dtype) for v in self._vectors), self._inverse.to(dtype)
        return other

    def __call__(self, residual: Tensor) -> Tensor:
        """Apply the inverse: (3, n_u, n_v, n_w) -> the same shape."""
        return torch.cat(in_parallel(self._solve, torch.split(residual, 1)))

    def _solve(self, residual: Tensor) -> Tensor:
        """Apply it to one component (1, n_u, n_v, n_w)."""
        for axis, vectors in enumerate(self._vectors, start=1):
            residual = along(vectors.T, residual, axis)
        residual = residual * self._inverse
        for axis, vectors in enumerate(self._vectors, start=1):
            residual = along(vectors, residual, axis)
        return residual
