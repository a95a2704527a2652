"""Computes the stiffness of isotropic and of orthotropic materials, and turns it to the axes of a material.

An orthotropic material has nine constants along its principal axes (Jones, *Mechanics of Composite Materials*, 2nd ed.,
1999, section 2.3): the compliance has 1 / E_i, -nu_ij / E_i and 1 / G_ij as its entries.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from parameterize.arrays import Array

PAIRS_OF_AXES = ((0, 1), (0, 2), (1, 2))  # of nu12, nu13, nu23 and G12, G13, G23
ALIKE = 1e-4  # of the largest entry, by which two directions of a material may differ: constants have three digits


def orthotropic(young: Sequence[float], poisson_ratio: Sequence[float], shear_modulus: Sequence[float]) -> Array:
    """Return the stiffness (3, 3, 3, 3) along the axes from E1, E2, E3, nu12, nu13, nu23 and G12, G13, G23.

    Raises ValueError where it is not positive definite.
    """
    normal = np.diag(1.0 / np.array(young, dtype=np.float64))
    for (i, j), nu in zip(PAIRS_OF_AXES, poisson_ratio, strict=True):
        normal[i, j] = normal[j, i] = -nu / young[i]
    if np.linalg.eigvalsh(normal * np.sqrt(np.multiply.outer(young, young)))[0] <= 0.0:
        bounds = ", ".join(
            f"nu{i + 1}{j + 1} between -{bound:.4g} and {bound:.4g}"
            for i, j in PAIRS_OF_AXES
            if (bound := (young[i] / young[j]) ** 0.5)
        )
        raise ValueError(
            f"poisson_ratio {tuple(poisson_ratio)}: the stiffness of young {tuple(young)} is not positive definite; "
            f"it needs {bounds}, and smaller ones together; nu21 = nu12 E2 / E1 is another number than nu12"
        )
    stiffness = np.zeros((3, 3, 3, 3))
    for (i, j), value in np.ndenumerate(np.linalg.inv(normal)):
        stiffness[i, i, j, j] = value
    for (i, j), value in zip(PAIRS_OF_AXES, shear_modulus, strict=True):
        for a, b in product(((i, j), (j, i)), repeat=2):
            stiffness[*a, *b] = value
    return stiffness


def nearest_isotropic(stiffness: Array) -> tuple[float, float]:
    """Return Lame's constants lambda and mu of the isotropic stiffness nearest to one (Voigt's average)."""
    bulk, whole = float(np.einsum("iijj", stiffness)), float(np.einsum("ijij", stiffness))
    shear = (3.0 * whole - bulk) / 30.0
    return bulk / 9.0 - 2.0 / 3.0 * shear, shear


def is_the_same_across(stiffness: Array) -> bool:
    """Return whether a stiffness along its axes is that of a transversely isotropic material about the first one."""
    angle = 1.0  # any one that is no multiple of 45 degrees
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(angle), -np.sin(angle)], [0.0, np.sin(angle), np.cos(angle)]])
    size = float(np.abs(stiffness).max())
    return bool(np.abs(turned(stiffness, turn) - stiffness).max() <= ALIKE * size)


def turned(tensor: Array, axes: Array) -> Array:
    """Return a tensor (3, 3) or (3, 3, 3, 3) along axes, the rows of a rotation (3, 3), along x, y, z."""
    for place in range(tensor.ndim):
        tensor = np.moveaxis(np.tensordot(axes.T, tensor, (1, place)), 0, place)
    return tensor


def product_of(stiffness: Array, grad: Any) -> Any:
    """Return the stress (3, 3, ...) of a gradient (3, 3, ...), of numbers or of jets."""
    return np.tensordot(stiffness, grad, 2)
