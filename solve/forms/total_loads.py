"""Defines the loads of bodies that are stated in total: forces and moments that a region shares out over its area.

The resultant of such a load is exact for each quadrature: the numbers by which its field is multiplied follow from
integrals over the region with the weights that its terms have in the solve (`discretization.shared_out`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array

from .condition import Exact
from .constants import Vector, at_point, in_words, vector
from .general_conditions import Flux
from .region import Region

Integral = Callable[[Callable[[Array, Array], Array]], Array]  # of a function of points and normals (3, m)
Field = Callable[[Array, Array], Array]

MOST_STEPS = 50  # of the search for a bearing's pressure; each changes which points of the bore are pressed
SETTLED = 1e-13  # share of a force that the search leaves
SLANTED = 0.02  # share of a bearing's force that may lie outside of what pressure on its region carries
FLAT = 1e-6  # share of the largest eigenvalue of int n n^T up to which no pressure acts along a direction


@dataclass(frozen=True)
class RigidField:
    """Hold a traction force + turn x (x - centre), which shares out a force and a moment over a region."""

    force: Array
    turn: Array
    centre: Array

    def __call__(self, x: Array, normal: Array) -> Array:
        """Return the traction (3, ...) at points with normals (3, ...)."""
        r = np.asarray(x) - _column(self.centre, x)
        return np.broadcast_to(_column(self.force, x), r.shape) + np.cross(self.turn, r, axisb=0, axisc=0)

    @classmethod
    def of(cls, integral: Integral, force: Array, moment: Callable[[Array], Array]) -> RigidField:
        """Return the traction with a force, and with the moment about the region's centre that a function returns.

        The field is the only one of its form, and of all tractions with this force and moment it has the least square
        integral. With the centre c of the region the shift and the turn are not coupled: the moment of
        turn x (x - c) is J turn, J = int |r|^2 - r r^T, r = x - c.
        """
        area = float(integral(lambda x, normal: np.ones(x.shape[1])))
        centre = integral(lambda x, normal: np.asarray(x)) / area

        def inertia(x: Array, normal: Array) -> Array:
            r = np.asarray(x) - centre[:, None]
            return np.eye(3)[:, :, None] * (r * r).sum(axis=0) - r[:, None] * r

        turning = moment(centre)
        turn = np.asarray(np.linalg.solve(integral(inertia), turning)) if turning.any() else np.zeros(3)
        return cls(force / area, turn, centre)


@dataclass(frozen=True)
class PressedField:
    """Hold the traction max(0, a . n) n + rest, n the inward normal: a pressure like a cosine over half of a bore."""

    axis: Array
    rest: Array

    def __call__(self, x: Array, normal: Array) -> Array:
        """Return the traction (3, ...) at points with normals (3, ...)."""
        pressure = np.maximum(-np.tensordot(self.axis, normal, 1), 0.0)
        return -pressure * normal + _column(self.rest, x)


class SharedOut(Flux):
    """Load a body by what is given in total, and shared out over the region.

    field: the traction; None until a solve has found it for its quadrature points.
    """

    field: Field | None = None

    def __init__(self, region: Region | str, data: Any, *, name: str = "") -> None:
        super().__init__(region, data, name=name)
        self._keep(data=vector(self.role, data))

    @property
    def total(self) -> Array:
        """Return the vector (3,) that is given."""
        return np.array(self.data)

    def nominal(self) -> Self:
        """Return the load with some field of its own kind, which shows where it acts."""
        return self._with(field=RigidField(self.total, np.zeros(3), np.zeros(3)))

    def shared_out(self, integral: Integral) -> Self:
        """Return the load with its field. integral: that over the region, of a function (..., m) of its m points.

        Raises ValueError for a total that the region cannot carry.
        """
        return self._with(field=self._field(integral))

    def sharing(self, other: Any) -> Self:
        """Return the load with the field of another one, that of all patches."""
        return self._with(field=other.field)

    def _field(self, integral: Integral) -> Field:
        raise NotImplementedError(f"{type(self).__name__}._field")

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return the traction (3, ...)."""
        assert self.field is not None, f"{self.role} has not been shared out"
        return self.field(x, normal)


class TotalForce(SharedOut):
    """Load a body by a force in total, shared out evenly over the area of a region.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> pulled = iga_nn.Elasticity(fix="u0", total_force={"u1": (0, 0, -500)})
    >>> [round(part, 9) for part in iga_nn.solve(benchmark_volume(2), pulled).report.balance.load]
    [0.0, 0.0, -500.0]
    """

    def _field(self, integral: Integral) -> Field:
        return RigidField.of(integral, self.total, lambda centre: np.zeros(3))


class Moment(SharedOut):
    """Load a body by a moment in total, and no force, shared out over a region.

    The traction is turn x (x - c), c the region's centre: on the end of a round shaft that of Saint-Venant's torsion.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Moment("u1", (0, 0, 20)).text
    '0;0;20'
    """

    def nominal(self) -> Self:
        """Return the load with some field of its own kind, which shows where it acts."""
        return self._with(field=RigidField(np.zeros(3), self.total, np.full(3, np.pi)))

    def _field(self, integral: Integral) -> Field:
        return RigidField.of(integral, np.zeros(3), lambda centre: self.total)


class RemoteForce(SharedOut):
    """Load a body by a force at a point beside it, which a region takes over as a force and a moment.

    Parameters
    ----------
    region : Region or str
        The region that takes the force over; it stays free to deform.
    data : three numbers
        The force.
    point : three numbers
        Where the force acts.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.RemoteForce("u1", (0, 0, -500), (10, 0, 50)).text
    '0;0;-500 at (10, 0, 50)'
    """

    has_point: ClassVar[bool] = True
    point: Vector

    def __init__(self, region: Region | str, data: Any, point: Any, *, name: str = "") -> None:
        super().__init__(region, data, name=name)
        self._keep(point=vector(f"{self.role}: the point", point))

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the pair of a keyword: force and point."""
        return cls(region, *at_point(name or cls.role_on(region), data), name=name)

    @property
    def text(self) -> str:
        """Return the force and its point for a report."""
        return in_words(self.data, self.point)

    def _field(self, integral: Integral) -> Field:
        return RigidField.of(integral, self.total, lambda centre: np.cross(np.array(self.point) - centre, self.total))


class Bearing(SharedOut):
    """Load a bore by a force in total, as a pin in it does: by a pressure on the half that the force points to.

    The pressure is a cosine of the angle to a direction, which is that of the force on a bore without gaps. What
    pressure alone does not carry, up to 2 % of the force, is shared out evenly.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Bearing("bore 1", (0, -500, 0)).role
    "bearing 'bore 1'"
    """

    def _field(self, integral: Integral) -> Field:
        force = self.total
        size = float(np.linalg.norm(force))
        axis = force
        for _ in range(MOST_STEPS if size > 0.0 else 0):
            missing = force - integral(PressedField(axis, np.zeros(3)))
            if np.linalg.norm(missing) <= SETTLED * size:
                break
            # The resultant is the gradient of a convex function of the axis, and linear where the pressed points stay.
            new = _solved(integral(_squares(axis)), force)
            if np.allclose(new, axis, rtol=SETTLED, atol=0.0):
                break
            axis = new
        missing = force - integral(PressedField(axis, np.zeros(3)))
        if np.linalg.norm(missing) > SLANTED * size:
            share = min(1.0, float(np.linalg.norm(missing)) / size)
            raise ValueError(
                f"{self.role}: pressure on this region cannot carry {share:.0%} of the force {in_words(self.data)}: "
                "a bore carries forces across its axis; use total_force for others"
            )
        return PressedField(axis, missing / float(integral(lambda x, normal: np.ones(x.shape[1]))))


def _squares(axis: Array) -> Field:
    """Return the function n n^T (3, 3, m) on the half of a region that faces an axis, zero elsewhere."""

    def found(x: Array, normal: Array) -> Array:
        return normal[:, None] * normal * (np.tensordot(axis, normal, 1) < 0.0)

    return found


def _solved(matrix: Array, force: Array) -> Array:
    """Return the axis whose pressure has a force, within the directions along which normals point."""
    values, vectors = np.linalg.eigh(matrix)
    kept = values > FLAT * values[-1]
    return np.asarray(vectors[:, kept] @ ((vectors[:, kept].T @ force) / values[kept]))


def _column(vector: Array, x: Array) -> Array:
    """Return a vector (3,) in a shape that fits points (3, ...)."""
    return np.reshape(vector, (3,) + (1,) * (np.ndim(x) - 1))
