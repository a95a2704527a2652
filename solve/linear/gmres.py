"""SciPy's GMRES for laws that are not symmetric, with the history of its residuals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from parameterize.arrays import Array

from .cg import LinearResult

RESTART = 60  # iterations between restarts: as many vectors are kept


def generalized_residuals(
    operator: Callable[[Array], Array],
    b: Array,
    preconditioner: Callable[[Array], Array],
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
    start: Array | None = None,
) -> LinearResult:
    """Solve A x = b from x = `start` (default: zero) until |r| <= tolerance |b|; arrays as in `conjugate_gradients`.

    The preconditioner P stands on the right, A P y = b - A x with x + P y the answer: residuals are those of A.
    """
    norm = float(np.linalg.norm(b))
    x = np.zeros(b.shape) if start is None else start.copy()
    if norm == 0.0:
        return LinearResult(np.zeros(b.shape), (0.0,), True)
    rest = b - operator(x) if start is not None else b
    residuals = [float(np.linalg.norm(rest)) / norm]

    def product(y: Array) -> Array:
        return operator(preconditioner(y.reshape(b.shape))).ravel()

    if residuals[0] > tolerance:
        size, restart = float(np.linalg.norm(rest)) / norm, min(RESTART, max_iterations)
        y, _ = gmres(
            LinearOperator((b.size, b.size), matvec=product, dtype=np.float64),
            rest.ravel(),
            rtol=0.0,
            atol=tolerance * norm,
            restart=restart,
            maxiter=max_iterations // restart,
            callback=lambda residual: residuals.append(float(residual) * size),
            callback_type="pr_norm",
        )
        x += preconditioner(y.reshape(b.shape))
    return LinearResult(x, tuple(residuals), residuals[-1] <= tolerance)
