"""Computes closest rotations, cofactors and determinants of 3 x 3 matrices, as tensors.

Matrices have the shape (3, 3, m): row, column, sample. In this layout every operation runs along contiguous memory.
"""

import torch
from torch import Tensor

from ..quality.rotations import closest_rotations


def determinant(j: Tensor) -> Tensor:
    """Return the determinants (m,) of matrices (3, 3, m)."""
    return (j[:1] * _cross(j[1:2], j[2:])).sum(dim=(0, 1))


def cofactor(j: Tensor) -> Tensor:
    """Return the cofactors (3, 3, m) of matrices J (3, 3, m): the inverse of J is the transpose over det J."""
    cyclic = torch.cat([j, j[:2]])
    return _cross(cyclic[1:4], cyclic[2:5])


def _cross(a: Tensor, b: Tensor) -> Tensor:
    """Return the cross products of rows (k, 3, m), row by row; slices along the samples are fast."""
    a, b = torch.cat([a, a[:, :2]], dim=1), torch.cat([b, b[:, :2]], dim=1)  # (k, 5, m)
    return torch.addcmul(a[:, 1:4] * b[:, 2:5], a[:, 2:5], b[:, 1:4], value=-1.0)


def closest_rotation(j: Tensor) -> Tensor:
    """Return the rotation closest to each matrix of (3, 3, m), without a gradient: see `closest_rotations`."""
    return torch.from_numpy(closest_rotations(j.detach().cpu().numpy())).to(j.device)
