"""Closest rotations of 3 x 3 matrices, so that the distortion needs no singular value decomposition.

With R the rotation closest to J, the sum of the singular values (the smallest signed with det J) is <R, J>, hence
ARAP = sum (sigma - 1)^2 = |J|^2 - 2 <R, J> + 3, and since R is stationary the gradient with R held fixed is exact.
"""

from __future__ import annotations

import torch
from torch import Tensor


def determinant(j: Tensor) -> Tensor:
    """Determinant of (..., 3, 3) by the rule of Sarrus: cheaper in a batch than LU."""
    return (j[..., 0, :] * torch.linalg.cross(j[..., 1, :], j[..., 2, :])).sum(-1)


def cofactor(j: Tensor) -> Tensor:
    """Cofactor matrices: inverse(J) = cofactor(J)^T / det J, for (..., 3, 3)."""
    a, b, c = j[..., 0, :], j[..., 1, :], j[..., 2, :]
    cross = torch.linalg.cross
    return torch.stack([cross(b, c), cross(c, a), cross(a, b)], dim=-2)


@torch.no_grad()
def closest_rotation(j: Tensor, iterations: int = 7) -> Tensor:
    """The rotation closest to each matrix of (m, 3, 3), detached.

    Scaled Newton steps R <- (g R + R^-T / g) / 2 (Higham 1986) where det J is safely positive. Elsewhere Newton would
    end at a reflection or divide by zero; those few are done by SVD with the smallest direction flipped.
    """
    size = j.square().sum(dim=(-2, -1)).sqrt().clamp_min(torch.finfo(j.dtype).tiny)
    regular = determinant(j) > 1e-4 * size**3
    r = torch.where(regular[:, None, None], j / size[:, None, None], torch.eye(3, dtype=j.dtype, device=j.device))
    for _ in range(iterations):
        inverse_t = cofactor(r) / determinant(r)[:, None, None]
        g2 = (inverse_t.square().sum(dim=(-2, -1)) / r.square().sum(dim=(-2, -1))).sqrt()
        g = g2.sqrt()[:, None, None]
        r = 0.5 * (g * r + inverse_t / g)
    if not bool(regular.all()):
        rest = ~regular
        r[rest] = _rotation_by_svd(j[rest])
    return r


def _rotation_by_svd(j: Tensor) -> Tensor:
    """U diag(1, 1, det U V) V^T."""
    u, _, vh = torch.linalg.svd(j)
    sign = determinant(u @ vh).sign()
    u = torch.cat([u[:, :, :2], u[:, :, 2:] * sign[:, None, None]], dim=2)
    return u @ vh


def arap(j: Tensor) -> Tensor:
    """sum (sigma_i - 1)^2 of each matrix (m, 3, 3) -> (m,), the smallest sigma signed with det; exact gradient."""
    r = closest_rotation(j)
    return (j - r).square().sum(dim=(-2, -1))
