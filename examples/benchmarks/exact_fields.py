"""Exact displacements and temperatures of textbooks: their stresses, heat flows, means and energies, by formula.

A field is a function of position that also takes complex coordinates. So its derivatives are those of a complex step,
right to rounding (Squire, Trapp, SIAM Rev. 40, 1998), and no stress is written out a second time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import iga_nn
from parameterize.arrays import Array

STEP = 1e-30  # of the complex step: its square vanishes beside 1
HIGH = 6  # degree of a box for integrals of formulas: they are right to 1e-9 then

Formula = Callable[[Array, Array, Array], Sequence[Array] | Array]
Place = tuple[float, float, float]
Datum = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True)
class Field:
    """An exact solution u (c, ...) of position (3, ...). A subclass has its law's flux."""

    formula: Formula

    def values(self, x: Array) -> Array:
        """Return u (c, ...) at points (3, ...)."""
        found = self.formula(*x)
        rows = found if isinstance(found, Sequence) else [found]
        return np.stack([np.broadcast_to(row, x.shape[1:]) for row in rows])

    def gradient(self, x: Array) -> Array:
        """Return the gradient (c, 3, ...) at points (3, ...)."""
        columns = []
        for axis in range(3):
            moved = np.array(x, dtype=complex)
            moved[axis] += 1j * STEP
            columns.append(self.values(moved).imag / STEP)
        return np.stack(columns, axis=1)

    def flux(self, x: Array) -> Array:
        """Return the law's flux (c, 3, ...) at points (3, ...)."""
        raise NotImplementedError

    def data(self) -> list[Datum]:
        """Return the values as data of a problem, one function a component."""
        count = len(self.values(np.ones((3, 1))))
        return [lambda x, y, z, row=row: self.values(np.stack([x, y, z]))[row] for row in range(count)]

    def through(self, normal: Callable[[Array], Array]) -> list[Datum]:
        """Return the flux through a face as data, one function a component. normal: (3, ...) of points (3, ...)."""

        def along(x: Array) -> Array:
            return np.einsum("cd...,d...->c...", self.flux(x), normal(x))

        count = len(self.values(np.ones((3, 1))))
        return [lambda x, y, z, row=row: along(np.stack([x, y, z]))[row] for row in range(count)]

    def at(self, place: Place, part: int = 0) -> float:
        """Return a component at a place."""
        return float(self.values(np.array(place)[:, None])[part, 0])

    def mean(self, body: iga_nn.Body, part: int = 0, over: str | None = None) -> float:
        """Return the mean of a component over the body, or over a region of its boundary."""
        fine = finer(body)
        total = iga_nn.integrate(fine, lambda x: self.values(np.asarray(x))[part], over)
        return float(total / iga_nn.integrate(fine, None, over))

    def total(self, body: iga_nn.Body, normal: Callable[[Array], Array], over: str, part: int = 0) -> float:
        """Return the integral of the flux through a region: of elasticity a component of the force on it."""
        along = self.through(normal)[part]
        return float(iga_nn.integrate(finer(body), lambda x: along(*np.asarray(x)), over))

    def energy(self, body: iga_nn.Body) -> float:
        """Return half of the integral of flux : gradient."""

        def density(x: Array) -> Array:
            points = np.asarray(x)
            return 0.5 * (self.flux(points) * self.gradient(points)).sum(axis=(0, 1))

        return float(iga_nn.integrate(finer(body), density))


@dataclass(frozen=True)
class Displacement(Field):
    """A displacement of an elastic body."""

    young: float
    ratio: float

    @property
    def shear(self) -> float:
        """Return the shear modulus."""
        return self.young / (2.0 * (1.0 + self.ratio))

    def flux(self, x: Array) -> Array:
        """Return the stress (3, 3, ...)."""
        slope = self.gradient(x)
        volume = np.trace(slope) * 2.0 * self.shear * self.ratio / (1.0 - 2.0 * self.ratio)
        return self.shear * (slope + np.swapaxes(slope, 0, 1)) + np.multiply.outer(np.eye(3), volume)

    def stress(self, place: Place, row: int, column: int) -> float:
        """Return a component of the stress at a place."""
        return float(self.flux(np.array(place)[:, None])[row, column, 0])

    def von_mises(self, place: Place) -> float:
        """Return von Mises' stress at a place."""
        stress = self.flux(np.array(place)[:, None])[..., 0]
        deviator = stress - np.eye(3) * np.trace(stress) / 3.0
        return float(np.sqrt(1.5 * (deviator * deviator).sum()))

    @property
    def material(self) -> dict[str, float]:
        """Return the keywords of `iga_nn.Elasticity`."""
        return {"young": self.young, "poisson_ratio": self.ratio}


@dataclass(frozen=True)
class Temperature(Field):
    """A temperature."""

    kappa: float = 1.0

    def flux(self, x: Array) -> Array:
        """Return kappa times the gradient (1, 3, ...)."""
        return self.kappa * self.gradient(x)


def finer(body: iga_nn.Body) -> iga_nn.Body:
    """Return the same body on which formulas are integrated with more points: shorter spans, or a higher degree."""
    return iga_nn.Body.from_patches([patch.refined() if max(patch.degrees) > 1 else _raised(patch) for patch in body])


def _raised(patch: iga_nn.BSplineVolume) -> iga_nn.BSplineVolume:
    """Return the same map with a degree of 6, for which integrals have 10 points a span."""

    def place(u: Array, v: Array, w: Array) -> Array:
        return np.moveaxis(patch(np.stack([u, v, w], axis=-1).reshape(-1, 3)).reshape(*u.shape, 3), -1, 0)

    return iga_nn.BSplineVolume.from_function(place, control_points=HIGH + 2, degree=HIGH)


def toward(x: float, y: float, z: float) -> Callable[[Array], Array]:
    """Return the normal of a plane face."""

    def normal(points: Array) -> Array:
        return np.multiply.outer(np.array([x, y, z]), np.ones(points.shape[1:]))

    return normal
