"""Defines NonlinearBody, the base class of laws of solids that are not linear, with supports and loads on regions."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from numbers import Real
from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array

from .conditions import OF_BODIES, Condition, GivenRegions
from .data import Data
from .inertia import with_inertia
from .owners import Owner, entry_of
from .problem import LawWithData
from .stresses import outer_principal, principal, von_mises

Number = float | Mapping[Owner, float]
NONE = ("0", "0", "0")  # of a vector
SUPPORTS = ("fix", "roller", "symmetry", "turn", "spring", "total_spring", "foundation")
LOADS = ("load", "pressure", "hydrostatic", "total_force", "moment", "remote_force", "bearing")


@dataclass(frozen=True, kw_only=True)
class NonlinearBody(LawWithData):
    """State a body of a law that is not linear, held and loaded on regions of its boundary.

    The numbers of the material are numbers, or dictionaries by patch or by the name of a solid. Loads keep their
    direction and their area of the body at rest: they are dead.
    """

    body_force: Data | None = None
    density: Number | None = None
    gravity: Data | None = None
    acceleration: Data | None = None
    spin: tuple[Data, Data] | None = None
    conditions: Sequence[Condition] = ()  # type: ignore[assignment]  # a tuple once the problem is made
    fix: GivenRegions | None = None
    roller: GivenRegions | None = None
    symmetry: GivenRegions | None = None
    load: GivenRegions | None = None
    pressure: GivenRegions | None = None
    spring: GivenRegions | None = None
    turn: GivenRegions | None = None
    total_spring: GivenRegions | None = None
    foundation: GivenRegions | None = None
    hydrostatic: GivenRegions | None = None
    total_force: GivenRegions | None = None
    moment: GivenRegions | None = None
    remote_force: GivenRegions | None = None
    bearing: GivenRegions | None = None

    exact: ClassVar[Data | None] = None  # type: ignore[misc]  # the exact solution is not a datum of these laws
    components = 3
    linear = False
    labels: ClassVar = {"source": "body_force"}
    keywords: ClassVar = {name: OF_BODIES[name] for name in (*SUPPORTS, *LOADS)}
    numbers: ClassVar[tuple[str, ...]]  # the names of the material's numbers

    def __post_init__(self) -> None:
        for name in self.numbers:
            given = getattr(self, name)
            for value in given.values() if isinstance(given, Mapping) else [given]:
                if isinstance(value, bool) or not isinstance(value, Real) or not isfinite(float(value)):
                    raise ValueError(f"{name} must be a number, got {value!r:.80}")
                self.check_number(name, float(value))
        self._read_keywords()
        if not self.conditions:
            raise ValueError("nothing holds the body: give fix, roller, symmetry or spring")
        force = with_inertia(self.body_force, self.density, self.gravity, self.acceleration, self.spin)
        self._set({"source": NONE if force is None else force}, None, None)
        if not self.by_patch:
            self.check_material()

    def check_number(self, name: str, value: float) -> None:
        """Raise ValueError for a number of the material that is out of range."""
        raise NotImplementedError(f"{type(self).__name__}.check_number")

    def check_material(self) -> None:
        """Raise ValueError for numbers that do not fit together; each patch has numbers, not dictionaries, here."""

    @property
    def by_patch(self) -> dict[str, Collection[Owner]]:
        """Return the patches or solids for which data are given one by one, by the name of the datum."""
        given = {name: getattr(self, name) for name in self.numbers}
        return super().by_patch | {name: own.keys() for name, own in given.items() if isinstance(own, Mapping)}

    def of_patch(self, patch: int, solid: str = "") -> Self:
        """Return the problem with the data and the material of a patch and its solid."""
        own = {name: entry_of(getattr(self, name), patch, solid) for name in self.numbers}
        found = super().of_patch(patch, solid)._assign(**own)
        found.check_material()
        return found

    @property
    def in_volume(self) -> Hashable:
        """Return what the law and its data in the volume are made of: the same for patches where they are the same."""
        given = (getattr(self, name) for name in self.numbers)
        return super().in_volume, *(tuple(own.items()) if isinstance(own, Mapping) else own for own in given)

    def free_motions(self, x: Array) -> Array:
        """Return the six rigid motions (6, 3, m) of a body: along x, y, z, and about x, y, z."""
        shifts = np.eye(3)[:, :, None] * np.ones(x.shape[1])
        turns = [np.cross(axis, x, axisb=0).T for axis in np.eye(3)]
        return np.concatenate([shifts, np.stack(turns)])

    def demand_held(self) -> None:
        """Raise ValueError where no support is given."""
        if not any(one.is_support for one in self.conditions):
            raise ValueError("nothing holds the body: give fix, roller, symmetry or spring")


def stress_quantities(stress: Any) -> dict[str, Any]:
    """Return the quantities that follow from a stress (3, 3, ...), a function of u, grad and x, by name."""
    return {
        "stress": stress,
        "von_mises": lambda u, grad, x: von_mises(stress(u, grad, x)),
        "pressure": lambda u, grad, x: -np.trace(stress(u, grad, x)) / 3.0,
        "principal": lambda u, grad, x: principal(stress(u, grad, x)),
        "first_principal": lambda u, grad, x: outer_principal(stress(u, grad, x))[0],
        "third_principal": lambda u, grad, x: outer_principal(stress(u, grad, x))[1],
    }
