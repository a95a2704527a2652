"""Defines Condition: data on a region of the boundary, whatever their kind."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from parameterize.arrays import Array

from .data import Datum, demand, parse_each
from .frame import UnitFrame
from .parser import ExpressionError
from .region import Part, Region

CAPITAL = re.compile("(?<=[a-z])(?=[A-Z])")  # where a word begins in the name of a class


class Exact(Protocol):
    """Describe the exact solution of a problem, from which data follow that are not given."""

    def exact_values(self, x: Array) -> Array:
        """Return u (c, ...) at points (3, ...)."""

    def exact_flux(self, name: str, x: Array, normal: Array) -> Array:
        """Return flux . n (c, ...) at points with normals (3, ...). name: the datum, for messages."""


class _Where:
    """Take a region or its text, and give the region."""

    def __get__(self, condition: Any, owner: type | None = None) -> Region:
        if condition is None:
            raise AttributeError("region")  # so a dataclass asks for the default: there is none
        found: Region = vars(condition)["region"]
        return found

    def __set__(self, condition: Any, region: Region | str) -> None:
        if isinstance(region, list | tuple):
            raise ExpressionError(f"a condition has one region, such as 'u0 or u1', got {region!r:.80}")
        vars(condition)["region"] = region if isinstance(region, Region) else Region(region)


@dataclass(frozen=True)
class Condition:
    """Hold data on a region of the boundary.

    region: Region, or its text. data: the datum; None for that of the exact solution. factor: of u in the flux, if it
    depends on u. name: the name of data that a keyword of faces gives, such as "traction u0"; "" for data on a region.
    faces: the whole faces of the cube that make up the region; those of one patch of several, once the condition is
    that of the patch. parsed: the data by their names, once a problem has them.
    """

    region: _Where = _Where()  # noqa: RUF009  # a descriptor, not a default
    data: Any = None
    factor: Any = field(default=None, init=False)
    name: str = field(default="", kw_only=True, repr=False)
    faces: tuple[str, ...] = field(init=False, repr=False, compare=False)
    parsed: Mapping[str, Datum] = field(init=False, repr=False, compare=False)

    kind: ClassVar[str]  # its word, such as "total force"
    option: ClassVar[str]  # its name on the command line and among keywords, such as "total_force"
    entries: ClassVar[int | None] = None  # of the datum; None for one a component of u
    is_essential: ClassVar[bool] = False  # whether values of u, or of its normal component, are given
    is_coupled: ClassVar[bool] = False  # whether u is coupled with u elsewhere, with no data of its own
    factor_name: ClassVar[str] = "factor"
    is_along_normal: ClassVar[bool] = False  # so that u has as many components as space
    has_point: ClassVar[bool] = False  # whether its data are a vector and a point

    def __init_subclass__(cls) -> None:
        cls.kind = CAPITAL.sub(" ", cls.__name__).lower()
        cls.option = cls.kind.replace(" ", "_")

    def __post_init__(self) -> None:
        if type(self) is Condition:
            raise TypeError("Condition is a base class: give one of its kinds, such as iga_nn.Value")
        object.__setattr__(self, "faces", self.region.faces)
        object.__setattr__(self, "parsed", {})

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the data of a keyword. Raises ValueError for data of another kind."""
        return cls(region, data, name=name)

    @classmethod
    def role_on(cls, region: Region | str) -> str:
        """Return the name of a datum on a region in messages."""
        return f"{cls.kind} {str(region)!r}"

    def _keep(self, **values: Any) -> Self:
        for name, value in values.items():
            object.__setattr__(self, name, value)
        return self

    def _with(self, **values: Any) -> Self:
        """Return a copy with other values of some fields."""
        return copy(self)._keep(**values)

    @property
    def role(self) -> str:
        """Return the name of the condition's datum in messages."""
        return self.name or self.role_on(self.region)

    @property
    def is_strong(self) -> bool:
        """Return whether the trial space can hold the condition: all components of u on whole faces of the cube."""
        return False

    @property
    def is_support(self) -> bool:
        """Return whether the condition answers loads: it gives values of u, or a flux that depends on u."""
        return self.is_essential or self.factor is not None

    @property
    def parts(self) -> tuple[Condition, ...]:
        """Return the conditions on one region each that make up this one."""
        return (self,)

    @property
    def text(self) -> str:
        """Return the data for a report."""
        return joined(self.data) if self.factor is None else f"{joined(self.factor)}, outside {joined(self.data)}"

    @property
    def datum(self) -> Datum | None:
        """Return the datum; None for that of the exact solution."""
        return self.parsed.get(self.role)

    @property
    def _factor(self) -> str:
        return f"{self.role}: {self.factor_name}"

    def stated(self, components: int, *, has_exact: bool, of_coordinates: bool) -> Self:
        """Return the condition of a problem with c components of u, whose data are parsed; zero is written for each.

        Raises ExpressionError for a formula that is refused, ValueError for data of another kind, and for a condition
        along the normal of a law with another number of components than space.
        """
        if self.is_along_normal and components != 3:
            raise ValueError(f"{self.role} acts along the normal: u must have three components, not {components}")
        data, count = self.data, self.entries or components
        data = 0.0 if data is None and self.is_essential and not has_exact else data
        data = [0.0] * count if count > 1 and isinstance(data, int | float) and data == 0 else data
        given = {self.role: (self._full(data), count), self._factor: (self.factor, 1)}
        face = self.name.partition(" ")[2]
        parsed = {
            name: parse_each(name, entry, entries, face, of_coordinates=of_coordinates)
            for name, (entry, entries) in given.items()
            if entry is not None
        }
        return self._with(data=data, parsed=parsed)

    def _full(self, data: Any) -> Any:
        """Return the datum with an entry for each component."""
        return data

    def placed(self, frame: UnitFrame | None = None, surface: Part | None = None) -> Self:
        """Return the same condition with X, Y, Z measured in a frame, and its region with a part's surface mesh."""
        parsed = self.parsed if frame is None else {name: datum.placed(frame) for name, datum in self.parsed.items()}
        return self._with(region=self.region.placed(frame, surface), parsed=parsed)

    def on_patch(self, patch: int, solid: str = "", faces: Sequence[str] | None = None) -> Self:
        """Return the condition of one patch of a solid. faces: those of the patch that it has; by default its own."""
        parsed = {name: datum.on_patch(patch, solid) for name, datum in self.parsed.items()}
        if faces is None and all(own is self.parsed[name] for name, own in parsed.items()):
            return self
        return self._with(parsed=parsed, faces=self.faces if faces is None else tuple(faces))

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return the flux (c, ...) into the body at points with normals (3, ...); with a factor, that for u = 0."""
        raise NotImplementedError(f"{type(self).__name__}.flux_at")

    def factor_at(self, x: Array) -> Array:
        """Return the factor (...) of u in the flux. Raises ExpressionError where it is negative."""
        found: Array = self.parsed[self._factor](x)[0]
        demand(found >= 0.0, self._factor, "zero or positive", x)
        return found

    def factors_at(self, components: int, x: Array, normal: Array) -> Array:
        """Return the factor (c, c, m) of u at points with normals (3, m): by default the same for all components."""
        return np.eye(components)[:, :, None] * self.factor_at(x)


def joined(data: Any) -> str:
    """Return a formula or a number, or the entries of a vector with semicolons between them."""
    if isinstance(data, list | tuple):
        return ";".join("free" if entry is None else joined(entry) for entry in data)
    if data is None:
        return "that of the exact solution"
    return f"{data:.12g}" if isinstance(data, float) else str(data)
