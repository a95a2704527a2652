"""Closest rotations of 3 x 3 matrices, so that the distortion needs no singular value decomposition.

With R the rotation closest to J, the sum of the singular values (the smallest signed with det J) is <R, J>, hence
ARAP = sum (sigma - 1)^2 = |J|^2 - 2 <R, J> + 3, and since R is stationary the gradient with R held fixed is exact.

Matrices come as (3, 3, m): row, column, sample. Batched this way every operation runs along contiguous memory.
"""

from __future__ import annotations

import torch
from torch import Tensor


def determinant(j: Tensor) -> Tensor:
    """Determinants of (3, 3, m): (m,)."""
    return (j[:1] * cross(j[1:2], j[2:])).sum(dim=(0, 1))


def cofactor(j: Tensor) -> Tensor:
    """Matrices of cofactors (3, 3, m): the inverse of J is their transpose over det J."""
    cyclic = torch.cat([j, j[:2]])
    return cross(cyclic[1:4], cyclic[2:5])


def cofactor_and_determinant(j: Tensor) -> tuple[Tensor, Tensor]:
    """Return the matrices of cofactors (3, 3, m) and the determinants (m,), expanded along the first row."""
    cofactors = cofactor(j)
    return cofactors, (j[0] * cofactors[0]).sum(0)


def cross(a: Tensor, b: Tensor) -> Tensor:
    """Cross products of rows (k, 3, m), row by row; slices along the samples are fast."""
    a, b = torch.cat([a, a[:, :2]], dim=1), torch.cat([b, b[:, :2]], dim=1)  # (k, 5, m)
    return torch.addcmul(a[:, 1:4] * b[:, 2:5], a[:, 2:5], b[:, 1:4], value=-1.0)


def least_eigenvalue(s: Tensor) -> Tensor:
    """Of symmetric matrices (3, 3, m), by the trigonometric formula: (m,)."""
    mean = (s[0, 0] + s[1, 1] + s[2, 2]) / 3.0
    shifted = s - mean * torch.eye(3, dtype=s.dtype, device=s.device)[:, :, None]
    spread = (shifted.square().sum(dim=(0, 1)) / 6.0).sqrt()
    cosine = determinant(shifted) / (2.0 * spread**3).clamp_min(torch.finfo(s.dtype).tiny)
    angle = torch.acos(cosine.clamp(-1.0, 1.0)) / 3.0
    return mean + 2.0 * spread * torch.cos(angle + 2.0 * torch.pi / 3.0)


@torch.no_grad()
def closest_rotation(j: Tensor, iterations: int = 7) -> Tensor:
    """The rotation closest to each matrix of (3, 3, m), detached.

    Scaled Newton steps R <- (g R + R^-T / g) / 2 (Higham 1986) where det J is safely positive, in single precision
    but for the last step. Elsewhere Newton would end at a reflection or divide by zero; those few are done by SVD with
    the smallest direction flipped. A matrix that is not finite gets some rotation: the energy made of both tells.
    """
    size = j.square().sum(dim=(0, 1)).sqrt().clamp_min(torch.finfo(j.dtype).tiny)
    regular = determinant(j) > 1e-3 * size**3
    identity = torch.eye(3, dtype=j.dtype, device=j.device)[:, :, None]
    r = torch.where(regular, j / size, identity).float()
    for _ in range(iterations - 2):
        cofactors, det = cofactor_and_determinant(r)
        inverse_t = cofactors.div_(det)
        g = (inverse_t.square().sum(dim=(0, 1)) / r.square().sum(dim=(0, 1))).sqrt().sqrt()
        r = r.mul_(g).add_(inverse_t.div_(g)).mul_(0.5)
    for kind in (torch.float32, j.dtype):  # close to the rotation g is 1
        r = r.to(kind)
        r = (cofactor(r) / determinant(r)).add_(r).mul_(0.5)
    if not bool(regular.all()):
        rest = ~regular
        r[:, :, rest] = _rotation_by_svd(torch.nan_to_num(j[:, :, rest], 0.0, 0.0, 0.0))
    return r


def _rotation_by_svd(j: Tensor) -> Tensor:
    """U diag(1, 1, det U V) V^T."""
    u, _, vh = torch.linalg.svd(j.permute(2, 0, 1))
    sign = torch.linalg.det(u @ vh).sign()
    u = torch.cat([u[:, :, :2], u[:, :, 2:] * sign[:, None, None]], dim=2)
    return (u @ vh).permute(1, 2, 0)
