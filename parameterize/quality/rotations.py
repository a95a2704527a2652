"""Closest rotations of 3 x 3 matrices, so that the distortion needs no singular value decomposition.

With R the rotation closest to J, the sum of the singular values (the smallest signed with det J) is <R, J>, hence
ARAP = sum (sigma - 1)^2 = |J - R|^2. The distance |J - R| is stationary in R, so its gradient with R held is exact.
"""

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
