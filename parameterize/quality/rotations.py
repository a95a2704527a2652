"""Closest rotations of 3 x 3 matrices, so that the distortion needs no singular value decomposition.

With R the rotation closest to J, the sum of the singular values (the smallest signed with det J) is <R, J>, hence
ARAP = sum (sigma - 1)^2 = |J - R|^2.
"""

import numba
import numpy as np

from ..arrays import Array

_BLOCK = 256  # matrices at a time
_STEPS = 8


def closest_rotations(matrices: Array) -> Array:
    """Return the rotation closest to each matrix: (3, 3, m) -> (3, 3, m); as `optimization.polar` does for tensors."""
    unit = matrices / np.maximum(np.abs(matrices).max(axis=(0, 1)), np.finfo(np.float64).tiny)
    stacked = np.moveaxis(unit, -1, 0)
    regular = np.linalg.det(stacked) > 1e-3 * np.linalg.norm(stacked, axis=(1, 2)) ** 3
    start = np.where(regular, unit, np.eye(3)[:, :, None])
    rotations: Array = polar_factors(start.reshape(9, -1)).reshape(start.shape)
    u, _, vh = np.linalg.svd(stacked[~regular])
    u[:, :, 2] *= np.linalg.det(u @ vh)[:, None]
    rotations[:, :, ~regular] = np.moveaxis(u @ vh, 0, -1)
    return rotations


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def polar_factors(matrices: Array) -> Array:
    """Find rotations (9, m) closest to matrices (9, m): R <- (g R + R^-T / g) / 2 with g = (|R^-1| / |R|)^(1/2)."""
    out = matrices.copy()
    for begin in range(0, out.shape[1], _BLOCK):
        r = out[:, begin : begin + _BLOCK]
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
                left, right = scale / 2, 1 / (2 * scale * det)
                r[0, i], r[1, i], r[2, i] = left * a + right * ca, left * b + right * cb, left * c + right * cc
                r[3, i], r[4, i], r[5, i] = left * d + right * cd, left * e + right * ce, left * f + right * cf
                r[6, i], r[7, i], r[8, i] = left * g + right * cg, left * h + right * ch, left * k + right * ck
    return out
