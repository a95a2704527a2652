"""Conjugate gradients with the history of their residuals, for NumPy arrays and torch tensors alike."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

INDEFINITE = "the matrix is not positive definite"
NO_DIRECTION = "the preconditioner does not give finite numbers"
NO_PRODUCT = "the matrix, or the right-hand side, does not give finite numbers"
Vector = Any  # a NumPy array or a torch tensor: anything with their arithmetic, `reshape` and `@`


@dataclass(frozen=True, eq=False)
class LinearResult:
    """The last iterate, and |r| / |b| before the first and after every iteration.

    breakdown: the reason why the iteration could not continue; "" where it could.
    """

    x: Vector
    residuals: tuple[float, ...]
    converged: bool
    breakdown: str = ""

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
    total: Callable[[float], float] = float,
) -> LinearResult:
    """Solve A x = b from x = `start` (default: zero) until |r| <= tolerance |b|.

    Saad, *Iterative Methods for Sparse Linear Systems*, 2nd ed., algorithm 9.1.

    b: an array or a tensor of any shape; the operator's answers are overwritten. total: the sum of a number over all
        processes, where each has a part of the vectors.
    Stops without convergence after `max_iterations`, or as soon as a direction is not finite, or shows that A is not
    positive definite.
    """

    def dot(one: Vector, other: Vector) -> float:
        return total(float(one.reshape(-1) @ other.reshape(-1)))  # words that NumPy and torch share

    norm_b = math.sqrt(dot(b, b))
    x, p, r = 0.0 * b, 0.0 * b, 1.0 * b
    if norm_b == 0.0:
        return LinearResult(x, (0.0,), True)
    if start is not None:
        x += start
        r -= operator(x)
    residuals = [math.sqrt(dot(r, r)) / norm_b]
    if not math.isfinite(residuals[0]):
        return LinearResult(x, tuple(residuals), False, NO_PRODUCT)
    rz_old = 1.0
    while residuals[-1] > tolerance and len(residuals) <= max_iterations:
        z = preconditioner(r)
        rz = dot(r, z)
        if fault := _fault(rz):
            return LinearResult(x, tuple(residuals), False, fault)
        p *= rz / rz_old
        p += z
        product = operator(p)
        curvature = dot(p, product)
        if fault := _fault(rz, curvature):
            return LinearResult(x, tuple(residuals), False, fault)
        step = rz / curvature
        x += step * p
        product *= step
        r -= product
        rz_old = rz
        residuals.append(math.sqrt(dot(r, r)) / norm_b)
    return LinearResult(x, tuple(residuals), residuals[-1] <= tolerance)


def _fault(rz: float, curvature: float = 1.0) -> str:
    """Return the fault where r.z, or the curvature p.Ap of the direction that follows from z, is not positive."""
    if not math.isfinite(rz) or rz == 0.0:  # r is neither
        return NO_DIRECTION
    if not math.isfinite(curvature):
        return NO_PRODUCT
    return "" if rz > 0.0 and curvature > 0.0 else INDEFINITE
