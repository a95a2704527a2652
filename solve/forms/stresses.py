"""Computes equivalent and principal stresses of stress tensors."""

import numpy as np

from parameterize.arrays import Array


def von_mises(stress: Array) -> Array:
    """Return von Mises' equivalent stress (...) of a stress tensor (3, 3, ...): sqrt(3/2 s : s), s its deviator."""
    deviator = stress - _mean_pressure(stress)
    return np.asarray(np.sqrt(1.5 * (deviator * deviator).sum(axis=(0, 1))))


def principal(stress: Array) -> Array:
    """Return the principal stresses (3, ...) of a stress tensor (3, 3, ...), the largest first."""
    values = np.linalg.eigvalsh(np.moveaxis(stress, (0, 1), (-2, -1)))
    return np.asarray(np.moveaxis(values[..., ::-1], -1, 0), dtype=np.float64)


def outer_principal(stress: Array) -> Array:
    """Return the largest and the smallest principal stress (2, ...) of a symmetric stress tensor (3, 3, ...).

    They follow from the cosines of the characteristic polynomial's angle: `principal` takes ten times as long. Where
    two principal stresses are equal, the results are accurate to 1e-8 of the deviator.
    """
    mean = (stress[0, 0] + stress[1, 1] + stress[2, 2]) / 3.0
    xx, yy, zz = (stress[i, i] - mean for i in range(3))
    xy, xz, yz = stress[0, 1], stress[0, 2], stress[1, 2]
    size = np.sqrt((xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    cube = np.where(size > 0.0, size, 1.0) ** 3
    angle = np.arccos(np.clip(determinant / (2.0 * cube), -1.0, 1.0)) / 3.0
    return np.stack([mean + 2.0 * size * np.cos(angle), mean + 2.0 * size * np.cos(angle + 2.0 * np.pi / 3.0)])


def _mean_pressure(stress: Array) -> Array:
    """Return a third of the trace times the unit tensor, (3, 3, ...)."""
    third = (stress[0, 0] + stress[1, 1] + stress[2, 2]) / 3.0
    return np.multiply.outer(np.eye(3), third)
