"""Computes cofactors, determinants, norms and least eigenvalues of 3 x 3 matrices.

Matrices have the shape (3, 3, m): row, column, sample. In this layout every operation runs along contiguous memory.
"""

import math

import numba
import numpy as np

from ..arrays import Floats


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cofactors_and_determinants(matrices: Floats) -> tuple[Floats, Floats]:
    """Return the cofactors (3, 3, m), whose transpose over det J is the inverse of J, and the determinants (m,)."""
    cofactors = np.empty_like(matrices)
    for row in range(3):
        a, b = matrices[(row + 1) % 3], matrices[(row + 2) % 3]
        for c in range(3):
            p, q = (c + 1) % 3, (c + 2) % 3
            for i in range(matrices.shape[2]):
                cofactors[row, c, i] = a[p, i] * b[q, i] - a[q, i] * b[p, i]
    return cofactors, dots(matrices[0], cofactors[0])


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def dots(a: Floats, b: Floats) -> Floats:
    """Return the inner products (m,) of vectors (k, m)."""
    out = np.zeros(a.shape[1], a.dtype)
    for c in range(a.shape[0]):
        for i in range(a.shape[1]):
            out[i] += a[c, i] * b[c, i]
    return out


def squared_norms(matrices: Floats) -> Floats:
    """Return the sums (m,) of the squared entries of matrices (3, 3, m)."""
    flat = matrices.reshape(9, -1)
    return np.asarray(dots(flat, flat))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def least_eigenvalues(matrices: Floats) -> Floats:
    """Return the least eigenvalues (m,) of symmetric matrices (3, 3, m), by the trigonometric formula."""
    out = np.empty(matrices.shape[2], matrices.dtype)
    for i in range(out.size):
        s = matrices[:, :, i]
        mean = (float(s[0, 0]) + float(s[1, 1]) + float(s[2, 2])) / 3.0
        a, b, c = s[0, 0] - mean, s[1, 1] - mean, s[2, 2] - mean
        d, e, f = float(s[1, 2]), float(s[0, 2]), float(s[0, 1])
        spread = math.sqrt((a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)) / 6.0)
        determinant = a * (b * c - d * d) - f * (f * c - d * e) + e * (f * d - b * e)
        cosine = determinant / max(2.0 * spread**3, 1e-300)
        angle = math.acos(min(max(cosine, -1.0), 1.0)) / 3.0
        out[i] = mean + 2.0 * spread * math.cos(angle + 2.0 * math.pi / 3.0)
    return out
