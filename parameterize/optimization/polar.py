"""Closest rotations, cofactors and determinants of 3 x 3 matrices, as tensors.

Matrices come as (3, 3, m): row, column, sample. Batched this way every operation runs along contiguous memory. The
distance |J - R| to the closest rotation is stationary in R, so its gradient with R held fixed is exact.
"""

import torch
from torch import Tensor

from ..quality.rotations import polar_factors


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
    r = torch.from_numpy(polar_factors(start.reshape(9, -1)).reshape(start.shape)).to(j.device)
    if not bool(regular.all()):
        rest = ~regular
        u, _, vh = torch.linalg.svd(torch.nan_to_num(j[:, :, rest], 0.0, 0.0, 0.0).permute(2, 0, 1))
        sign = torch.linalg.det(u @ vh).sign()
        u = torch.cat([u[:, :, :2], u[:, :, 2:] * sign[:, None, None]], dim=2)
        r[:, :, rest] = (u @ vh).permute(1, 2, 0)
    return r
