"""Preconditioned conjugate gradients with the history of its residuals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Vector = Any  # a NumPy array or a torch tensor: anything with their arithmetic, `reshape` and `@`


@dataclass(frozen=True, eq=False)
class LinearResult:
    """The last iterate, and |r| / |b| before the first and after every iteration."""

    x: Vector
    residuals: tuple[float, ...]
    converged: bool

    @property
    def iterations(self) -> int:
        """Number of iterations made."""
        return len(self.residuals) - 1


def conjugate_gradients(
    operator: Callable[[Vector], Vector],
    b: Vector,
    preconditioner: Callable[[Vector], Vector],
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
    start: Vector | None = None,
) -> LinearResult:
    """Solve A x = b from x = `start` (default: zero) until |r| <= tolerance |b|.

    Saad, *Iterative Methods for Sparse Linear Systems*, 2nd ed., algorithm 9.1.

    b: an array or a tensor of any shape; the operator's answers are overwritten.
    Stops without convergence after `max_iterations`, or as soon as a direction shows that A is not positive definite.
    """
    norm_b = math.sqrt(_dot(b, b))
    x, p, r = 0.0 * b, 0.0 * b, 1.0 * b
    if norm_b == 0.0:
        return LinearResult(x, (0.0,), True)
    if start is not None:
        x += start
        r -= operator(x)
    residuals = [math.sqrt(_dot(r, r)) / norm_b]
    rz_old = 1.0
    while residuals[-1] > tolerance and len(residuals) <= max_iterations:
        z = preconditioner(r)
        rz = _dot(r, z)
        p *= rz / rz_old
        p += z
        product = operator(p)
        curvature = _dot(p, product)
        if not (rz > 0.0 and curvature > 0.0):  # NaN included
            break
        step = rz / curvature
        x += step * p
        product *= step
        r -= product
        rz_old = rz
        residuals.append(math.sqrt(_dot(r, r)) / norm_b)
    return LinearResult(x, tuple(residuals), residuals[-1] <= tolerance)


def _dot(a: Vector, b: Vector) -> float:
    """Inner product, in words that NumPy and torch share."""
    return float(a.reshape(-1) @ b.reshape(-1))
