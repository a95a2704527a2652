"""Closest rotations of 3 x 3 matrices, so that the distortion needs no singular value decomposition.

With R the rotation closest to J, the sum of the singular values (the smallest signed with det J) is <R, J>, hence
ARAP = sum (sigma - 1)^2 = |J|^2 - 2 <R, J> + 3, and since R is stationary the gradient with R held fixed is exact.

Matrices come as (3, 3, m): row, column, sample. Batched this way every operation runs along contiguous memory.
"""

import numba
import numpy as np
import torch
from torch import Tensor

from ..arrays import Array

_BLOCK = 256  # matrices at a time
_STEPS = 8


def determinant(j: Tensor) -> Tensor:
    """Return the determinants of (3, 3, m): (m,)."""
    return (j[:1] * cross(j[1:2], j[2:])).sum(dim=(0, 1))


def cofactor(j: Tensor) -> Tensor:
    """Return the cofactors (3, 3, m): the inverse of J is their transpose over det J."""
    cyclic = torch.cat([j, j[:2]])
    return cross(cyclic[1:4], cyclic[2:5])


def cofactor_and_determinant(j: Tensor) -> tuple[Tensor, Tensor]:
    """Return the matrices of cofactors (3, 3, m) and the determinants (m,), expanded along the first row."""
    cofactors = cofactor(j)
    return cofactors, (j[0] * cofactors[0]).sum(0)


def cross(a: Tensor, b: Tensor) -> Tensor:
    """Return the cross products of rows (k, 3, m), row by row; slices along the samples are fast."""
    a, b = torch.cat([a, a[:, :2]], dim=1), torch.cat([b, b[:, :2]], dim=1)  # (k, 5, m)
    return torch.addcmul(a[:, 1:4] * b[:, 2:5], a[:, 2:5], b[:, 1:4], value=-1.0)


def least_eigenvalue(s: Tensor) -> Tensor:
    """Return the least eigenvalue of symmetric matrices (3, 3, m), by the trigonometric formula: (m,)."""
    mean = (s[0, 0] + s[1, 1] + s[2, 2]) / 3.0
    shifted = s - mean * torch.eye(3, dtype=s.dtype, device=s.device)[:, :, None]
    spread = (shifted.square().sum(dim=(0, 1)) / 6.0).sqrt()
    cosine = determinant(shifted) / (2.0 * spread**3).clamp_min(torch.finfo(s.dtype).tiny)
    angle = torch.acos(cosine.clamp(-1.0, 1.0)) / 3.0
    return mean + 2.0 * spread * torch.cos(angle + 2.0 * torch.pi / 3.0)


@torch.no_grad()
def closest_rotation(j: Tensor) -> Tensor:
    """Return the rotation closest to each matrix of (3, 3, m), detached.

    Scaled Newton steps (Higham 1986) where det J is safely positive. Elsewhere these would end at a reflection or
    divide by zero; those few are done by SVD with the smallest direction flipped. A matrix that is not finite gets some
    rotation: the energy made of both tells.
    """
    size = j.square().sum(dim=(0, 1)).sqrt().clamp_min(torch.finfo(j.dtype).tiny)
    regular = determinant(j) > 1e-3 * size**3
    identity = torch.eye(3, dtype=j.dtype, device=j.device)[:, :, None]
    start = torch.where(regular, j / size, identity).cpu().numpy()
    r = torch.from_numpy(_polar_factors(start.reshape(9, -1)).reshape(start.shape)).to(j.device)
    if not bool(regular.all()):
        rest = ~regular
        r[:, :, rest] = _rotation_by_svd(torch.nan_to_num(j[:, :, rest], 0.0, 0.0, 0.0))
    return r


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _polar_factors(matrices: Array) -> Array:
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


def _rotation_by_svd(j: Tensor) -> Tensor:
    """Return U diag(1, 1, det U V) V^T."""
    u, _, vh = torch.linalg.svd(j.permute(2, 0, 1))
    sign = torch.linalg.det(u @ vh).sign()
    u = torch.cat([u[:, :, :2], u[:, :, 2:] * sign[:, None, None]], dim=2)
    return (u @ vh).permute(1, 2, 0)
