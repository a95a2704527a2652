"""Solves by SciPy's GMRES, with the history of its residuals as in `conjugate_gradients`."""

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from parameterize.arrays import Array
from parameterize.conjugate_gradients import NO_DIRECTION, NO_PRODUCT, LinearResult

RESTART = 60  # iterations of GMRES between restarts: as many vectors are kept


class _Breakdown(ArithmeticError):
    """Raised where the numbers of a product are not finite; the message names the product."""


def generalized_residuals(
    operator: Callable[[Array], Array],
    b: Array,
    preconditioner: Callable[[Array], Array],
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
    start: Array | None = None,
) -> LinearResult:
    """Return the solution of A x = b, A not symmetric, by GMRES; arguments and result as in `conjugate_gradients`.

    The preconditioner P is applied on the right, A P y = b - A x with the solution x + P y: residuals are those of A.
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
    """Return x. Raises _Breakdown with the message `fault` where its numbers are not finite."""
    if not np.isfinite(x).all():
        raise _Breakdown(fault)
    return x
