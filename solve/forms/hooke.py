"""Defines Hooke: the linear elastic law of one material, isotropic or orthotropic, with its thermal stress."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from parameterize.arrays import Array

from .axes import along, in_space
from .data import LARGEST, SMALLEST
from .material import Constants, demand_constants
from .stiffness import is_the_same_across, nearest_isotropic, orthotropic, product_of, turned

Axes = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


class Lame(NamedTuple):
    """Hold Lame's constants lambda and mu."""

    first: float
    shear: float


@dataclass(frozen=True)
class Hooke:
    """State stress = C : (strain - thermal strain) of a material with constants along its axes.

    Attributes are those of `Material`. axes: three unit vectors, along which the constants are; None for x, y, z, and
    for axes that change from point to point, which the methods take. whole: the law of which this one is the part
    without change of volume, whose thermal stress it has.

    Raises ValueError for constants that no stable material has.
    """

    young: Constants
    poisson_ratio: Constants
    shear_modulus: tuple[float, float, float] | None = None
    expansion: Constants | None = None
    axes: Axes | None = None
    whole: Hooke | None = None

    def __post_init__(self) -> None:
        for young in _each(self.young):
            if not (isinstance(young, Real) and SMALLEST <= young <= LARGEST):
                raise ValueError(f"young must be a positive number from {SMALLEST:g} to {LARGEST:g}, got {young!r:.80}")
        for ratio in _each(self.poisson_ratio):
            if not isinstance(ratio, Real) or not (self.shear_modulus is not None or -1.0 < ratio < 0.5):
                raise ValueError(f"poisson_ratio must lie between -1 and 1/2, got {ratio!r:.80}")
        for shear in self.shear_modulus or ():
            if not (isinstance(shear, Real) and SMALLEST <= shear <= LARGEST):
                raise ValueError(f"shear_modulus must be positive, got {shear!r:.80}")
        for share in () if self.expansion is None else _each(self.expansion):
            if not (isinstance(share, Real) and abs(share) < 1.0):
                raise ValueError(f"expansion must be a number per kelvin such as 12e-6, got {share!r:.80}")
        demand_constants(self.young, self.poisson_ratio, self.shear_modulus)
        if self.shear_modulus is not None:
            assert isinstance(self.young, tuple)
            assert isinstance(self.poisson_ratio, tuple)
            orthotropic(self.young, self.poisson_ratio, self.shear_modulus)

    def demand_the_same_across(self) -> None:
        """Raise ValueError unless the material is the same in all directions across its first axis."""
        alike = is_the_same_across(self._along_axes)
        if isinstance(self.expansion, tuple):
            alike = alike and self.expansion[1] == self.expansion[2]
        if not alike:
            raise ValueError(
                "second_axis is needed: the material differs across its first axis; give both, at an angle"
            )

    @property
    def is_isotropic(self) -> bool:
        """Return whether stiffness and thermal strain are the same in all directions."""
        return self.shear_modulus is None and not isinstance(self.expansion, tuple)

    @cached_property
    def lame(self) -> Lame:
        """Return Lame's constants; of an orthotropic material those of the nearest isotropic one."""
        if isinstance(self.young, tuple) or isinstance(self.poisson_ratio, tuple):
            return Lame(*nearest_isotropic(self._along_axes))
        young, nu = self.young, self.poisson_ratio
        return Lame(young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu)))

    @cached_property
    def _along_axes(self) -> Array:
        """Return the stiffness (3, 3, 3, 3) along the material's axes."""
        if self.shear_modulus is not None:
            return orthotropic(_each(self.young), _each(self.poisson_ratio), self.shear_modulus)
        unit, (first, shear) = np.eye(3), self.lame
        both = np.einsum("ik,jl->ijkl", unit, unit) + np.einsum("il,jk->ijkl", unit, unit)
        return np.asarray(first * np.einsum("ij,kl->ijkl", unit, unit) + shear * both)

    def _in_space(self, tensor: Array) -> Array:
        return tensor if self.axes is None else turned(tensor, np.array(self.axes))

    @cached_property
    def stiffness(self) -> Array | None:
        """Return the stiffness (3, 3, 3, 3) along x, y, z, or along the axes of points; None of an isotropic one."""
        return None if self.shear_modulus is None else self._in_space(self._along_axes)

    @cached_property
    def growth(self) -> Array:
        """Return the thermal strain (3, 3) of one kelvin, along x, y, z, or along the axes of points."""
        expansion = 0.0 if self.expansion is None else self.expansion
        return self._in_space(np.diag(np.broadcast_to(np.array(expansion, dtype=np.float64), 3)))

    @cached_property
    def hold(self) -> Array:
        """Return the stress (3, 3) that holds back the thermal strain of one kelvin, along the same axes."""
        if self.whole is not None:
            return self.whole.hold
        stiffness = self._in_space(self._along_axes)
        return np.asarray(product_of(stiffness, self.growth))

    def stress(self, grad: Any, pressure: Any = None, axes: Any = None) -> Any:
        """Return the stress (3, 3, ...) of a gradient (3, 3, ...) without thermal strain.

        pressure: (...), in place of -lambda div u, of an isotropic material. axes: (3, 3, ...), of points.
        """
        if self.stiffness is not None:
            if axes is None:
                return product_of(self.stiffness, grad)
            return in_space(axes, product_of(self.stiffness, along(axes, grad)))
        lam, mu = self.lame
        stress = grad + np.swapaxes(grad, 0, 1)
        stress *= mu
        pull = lam * (grad[0, 0] + grad[1, 1] + grad[2, 2]) if pressure is None else -pressure
        for i in range(3):
            stress[i, i] += pull
        return stress

    def of_change(self, tensor: Array, change: Any, axes: Any = None) -> Any:
        """Return `growth` or `hold` (3, 3, ...) times changes of temperature (...), which may be jets."""
        found = tensor.reshape(3, 3, *(1,) * np.ndim(change)) * change
        return found if axes is None else in_space(axes, found)

    def without_volume(self) -> Hooke:
        """Return the law 2 mu eps, which a pressure completes, with the thermal stress of this one."""
        return replace(self, young=2.0 * self.lame.shear, poisson_ratio=0.0, whole=self)


def _each(constants: Constants) -> tuple[float, ...]:
    """Return a constant, or those of three axes, as a tuple."""
    return constants if isinstance(constants, tuple) else (constants,)
