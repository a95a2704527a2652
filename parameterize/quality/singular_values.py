"""Singular values of 3 x 3 matrices, the smallest with the sign of the determinant."""

import numba
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array


def signed_singular_values(jacobians: ArrayLike) -> Array:
    """Return the singular values, largest first, the smallest with the sign of det: (..., 3, 3) -> (..., 3).

    Raises ValueError for another shape or entries that are not finite.
    """
    matrices = np.asarray(jacobians, dtype=np.float64)
    if matrices.shape[-2:] != (3, 3):
        raise ValueError(f"jacobians must have shape (..., 3, 3), got {matrices.shape}")
    if not np.all(np.isfinite(matrices)):
        raise ValueError("jacobians must be finite")
    values = np.empty(matrices.shape[:-1])
    _one_sided_jacobi(np.ascontiguousarray(matrices).reshape(-1, 3, 3), values.reshape(-1, 3))
    return values


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _one_sided_jacobi(matrices: Array, out: Array) -> None:
    """Write the signed singular values of matrices (m, 3, 3) into out (m, 3).

    Hestenes' method: columns are rotated in pairs until orthogonal; their lengths are the singular values. Accurate for
    small ones too, unlike the eigenvalues of J^T J (Demmel, Veselic, SIAM J. Matrix Anal. Appl. 13, 1992).
    """
    columns = np.empty((3, 3))
    for m in range(matrices.shape[0]):
        size = 0.0
        for entry in matrices[m].flat:
            size = max(size, abs(entry))
        if size == 0.0:
            out[m] = 0.0
            continue
        for p in range(3):
            for i in range(3):
                columns[p, i] = matrices[m, i, p] / size
        a, b, c = columns
        for _ in range(30):  # sweeps; three to six do
            if max(_make_orthogonal(a, b), _make_orthogonal(a, c), _make_orthogonal(b, c)) < 1e-15:
                break
        first, second, third = np.sqrt(_dot(a, a)), np.sqrt(_dot(b, b)), np.sqrt(_dot(c, c))
        smallest = min(first, second, third)
        out[m, 0] = size * max(first, second, third)
        out[m, 1] = size * max(min(first, second), min(max(first, second), third))
        det = (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )
        out[m, 2] = -size * smallest if det < 0.0 else size * smallest


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _make_orthogonal(a: Array, b: Array) -> float:
    """Rotate two columns (3,) into orthogonal ones; return the cosine of the angle they had."""
    alpha, beta, gamma = _dot(a, a), _dot(b, b), _dot(a, b)
    if gamma == 0.0:
        return 0.0
    zeta = (beta - alpha) / (2.0 * gamma)
    tangent = np.copysign(1.0, zeta) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = cosine * tangent
    for i in range(3):
        a[i], b[i] = cosine * a[i] - sine * b[i], sine * a[i] + cosine * b[i]
    return float(abs(gamma) / np.sqrt(alpha) / np.sqrt(beta))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
