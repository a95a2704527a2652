"""Computes closest rotations, cofactors, determinants, norms and least eigenvalues of 3 x 3 matrices.

Matrices have the shape (3, 3, m): row, column, sample. In this layout every operation runs along contiguous memory.

With R the rotation closest to J, the sum of the singular values (the smallest signed with det J) is <R, J>, hence
ARAP = sum (sigma - 1)^2 = |J - R|^2, without a singular value decomposition. The distance |J - R| is stationary in R,
so its gradient with R held is exact.
"""

import math

import numba
import numpy as np

from ..arrays import Floats, Mask

_BLOCK = 256  # matrices at a time: they stay in the cache
_STEPS = 8  # of Newton's method: the least regular matrix takes 8 in double precision
_REGULAR = 1e-3  # det J / |J|^3 above which a matrix is safely away from reflections


def closest_rotations(matrices: Floats) -> Floats:
    """Return the rotation closest to each matrix, in the same precision: (3, 3, m) -> (3, 3, m).

    Scaled Newton steps (Higham 1986) where det J is safely positive. Elsewhere these would end at a reflection or
    divide by zero; these few matrices take an SVD with the smallest direction flipped. A matrix that is not finite
    gets some rotation: the energy of both is not finite either.
    """
    flat, regular = _polar_factors(np.ascontiguousarray(matrices).reshape(9, -1))
    rotations: Floats = flat.reshape(matrices.shape)
    if not regular.all():
        rest = np.nan_to_num(matrices[:, :, ~regular], nan=0.0, posinf=0.0, neginf=0.0)
        u, _, vh = np.linalg.svd(np.moveaxis(rest, -1, 0))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vh))[:, None]
        rotations[:, :, ~regular] = np.moveaxis(u @ vh, 0, -1)
    return rotations


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _polar_factors(matrices: Floats) -> tuple[Floats, Mask]:
    """Find rotations (9, m) closest to matrices (9, m): R <- (g R + R^-T / g) / 2 with g = (|R^-1| / |R|)^(1/2).

    Matrices that are not regular are left out: the identity stands in their place, and False in the second array (m,).
    """
    out, regular = np.empty_like(matrices), np.empty(matrices.shape[1], np.bool_)
    one, half = matrices.dtype.type(1.0), matrices.dtype.type(0.5)
    for begin in range(0, out.shape[1], _BLOCK):
        r, j, safe = out[:, begin : begin + _BLOCK], matrices[:, begin : begin + _BLOCK], regular[begin:]
        for i in range(r.shape[1]):
            a, b, c = j[0, i], j[1, i], j[2, i]
            d, e, f = j[3, i], j[4, i], j[5, i]
            g, h, k = j[6, i], j[7, i], j[8, i]
            size = np.sqrt(a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + k * k)
            a, b, c, d, e, f = a / size, b / size, c / size, d / size, e / size, f / size
            g, h, k = g / size, h / size, k / size
            safe[i] = a * (e * k - f * h) + b * (f * g - d * k) + c * (d * h - e * g) > _REGULAR
            for entry, value in enumerate((a, b, c, d, e, f, g, h, k)):
                r[entry, i] = value if safe[i] else one * (entry % 4 == 0)
        for _ in range(_STEPS):
            for i in range(r.shape[1]):
                a, b, c = r[0, i], r[1, i], r[2, i]
                d, e, f = r[3, i], r[4, i], r[5, i]
                g, h, k = r[6, i], r[7, i], r[8, i]
                ca, cb, cc = e * k - f * h, f * g - d * k, d * h - e * g
                cd, ce, cf = c * h - b * k, a * k - c * g, b * g - a * h
                cg, ch, ck = b * f - c * e, c * d - a * f, a * e - b * d
                det = a * ca + b * cb + c * cc
                size = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + k * k
                turned = ca * ca + cb * cb + cc * cc + cd * cd + ce * ce + cf * cf + cg * cg + ch * ch + ck * ck
                scale = np.sqrt(np.sqrt(turned / size) / det)
                left, right = half * scale, half / (scale * det)
                r[0, i], r[1, i], r[2, i] = left * a + right * ca, left * b + right * cb, left * c + right * cc
                r[3, i], r[4, i], r[5, i] = left * d + right * cd, left * e + right * ce, left * f + right * cf
                r[6, i], r[7, i], r[8, i] = left * g + right * cg, left * h + right * ch, left * k + right * ck
    return out, regular


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
