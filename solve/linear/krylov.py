"""Krylov methods with the history of their residuals: conjugate gradients, and SciPy's GMRES."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from parameterize.arrays import Array

INDEFINITE = "the matrix is not positive definite"
NO_DIRECTION = "the preconditioner does not give finite numbers"
NO_PRODUCT = "the matrix, or the right-hand side, does not give finite numbers"
RESTART = 60  # iterations of GMRES between restarts: as many vectors are kept
Vector = Any  # a NumPy array or a torch tensor: anything with their arithmetic, `reshape` and `@`


@dataclass(frozen=True, eq=False)
class LinearResult:
    """The last iterate, and |r| / |b| before the first and after every iteration.

    breakdown: why the iteration could not go on; "" where it could.
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


class _Breakdown(ArithmeticError):
    """A product whose numbers are not finite; the message says whose."""


def generalized_residuals(
    operator: Callable[[Array], Array],
    b: Array,
    preconditioner: Callable[[Array], Array],
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
    start: Array | None = None,
) -> LinearResult:
    """Solve A x = b, not symmetric, by GMRES; arguments as in `conjugate_gradients`.

    The preconditioner P stands on the right, A P y = b - A x with x + P y the answer: residuals are those of A.
    """
    norm = float(np.linalg.norm(b))
    if norm == 0.0:
        return LinearResult(np.zeros(b.shape), (0.0,), True)
    x = np.zeros(b.shape) if start is None else start.copy()
    rest = b if start is None else b - operator(x)
    size = float(np.linalg.norm(rest)) / norm
    residuals, y, left, made, breakdown = [size], np.zeros(b.size), max_iterations, 1, ""

    def product(y: Array) -> Array:
        direction = _finite(preconditioner(y.reshape(b.shape)), NO_DIRECTION)
        return _finite(operator(direction), NO_PRODUCT).ravel()

    matrix = LinearOperator((b.size, b.size), matvec=product, dtype=np.float64)
    try:
        _finite(rest, NO_PRODUCT)
        while left > 0 and residuals[-1] > tolerance:
            made = len(residuals)
            y, _ = gmres(
                matrix,
                rest.ravel(),
                x0=y,
                rtol=0.0,
                atol=tolerance * norm,
                restart=min(RESTART, left),
                maxiter=1,  # of restarts
                callback=lambda residual: residuals.append(float(residual) * size),
                callback_type="pr_norm",
            )
            left -= RESTART
    except _Breakdown as error:
        breakdown = str(error)
        del residuals[made:]  # y is that of the last restart
    if y.any():
        x += preconditioner(y.reshape(b.shape))
    return LinearResult(x, tuple(residuals), not breakdown and residuals[-1] <= tolerance, breakdown)


def _finite(x: Array, fault: str) -> Array:
    """Return x. Raises _Breakdown where its numbers are not finite."""
    if not np.isfinite(x).all():
        raise _Breakdown(fault)
    return x
