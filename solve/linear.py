"""Preconditioned conjugate gradients with the history of its residuals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.bspline import Array


@dataclass(frozen=True, eq=False)
class LinearResult:
    """The last iterate, and |r| / |b| before the first and after every iteration."""

    x: Array
    residuals: tuple[float, ...]
    converged: bool

    @property
    def iterations(self) -> int:
        """Number of iterations made."""
        return len(self.residuals) - 1


def conjugate_gradients(
    operator: Callable[[Array], Array],
    b: Array,
    preconditioner: Callable[[Array], Array],
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
) -> LinearResult:
    """Solve A x = b from x = 0 until |r| <= tolerance |b| (Saad, *Iterative Methods for Sparse Linear Systems*,
    2nd ed., algorithm 9.1).

    Stops without convergence after `max_iterations`, or as soon as a direction shows that A is not positive definite.
    """
    x = np.zeros_like(b)
    norm_b = float(np.linalg.norm(b))
    if norm_b == 0.0:
        return LinearResult(x, (0.0,), True)
    r = b.copy()
    residuals = [1.0]
    p, rz_old = np.zeros_like(b), 1.0
    while residuals[-1] > tolerance and len(residuals) <= max_iterations:
        z = preconditioner(r)
        rz = float(np.vdot(r, z))
        p *= rz / rz_old
        p += z
        product = operator(p)
        curvature = float(np.vdot(p, product))
        if not (rz > 0.0 and curvature > 0.0):  # NaN included
            break
        step = rz / curvature
        x += step * p
        product *= step
        r -= product
        rz_old = rz
        residuals.append(float(np.linalg.norm(r)) / norm_b)
    return LinearResult(x, tuple(residuals), residuals[-1] <= tolerance)
