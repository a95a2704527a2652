"""Defines the conditions on the boundary, a class each: values, fluxes, and exchanges with the outside, on regions.

A new kind is a subclass with its name in `__all__`. Its word in messages, in reports and on the command line is the
name of the class in small letters. A problem takes it in `conditions`; a short form of its own is an entry in
`OF_SCALARS` or `OF_BODIES`, and a field of the same name in the problem.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES

from .data import Datum, demand, parse_each
from .frame import UnitFrame
from .parser import ExpressionError
from .region import PATCH_FACE, Part, Region, Regions, regions_of

__all__ = ["Exchange", "Fix", "Flux", "Load", "Pressure", "Robin", "Roller", "Spring", "Symmetry", "Value"]

GivenRegions = Regions | Mapping[Any, Any]  # Region or str -> data
OnFaces = Mapping[str, Any]


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

    kind: ClassVar[str]
    entries: ClassVar[int | None] = None  # of the datum; None for one a component of u
    is_essential: ClassVar[bool] = False  # whether values of u, or of its normal component, are given
    factor_name: ClassVar[str] = "factor"
    is_along_normal: ClassVar[bool] = False  # so that u has as many components as space

    def __init_subclass__(cls) -> None:
        cls.kind = cls.__name__.lower()

    def __post_init__(self) -> None:
        if type(self) is Condition:
            raise TypeError("Condition is a base class: give one of its kinds, such as iga_nn.Value")
        object.__setattr__(self, "faces", self.region.faces)
        object.__setattr__(self, "parsed", {})

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the data of a keyword. Raises ValueError for data of another kind."""
        return cls(region, data, name=name)

    def _with(self, **values: Any) -> Self:
        """Return a copy with other values of some fields."""
        other = copy(self)
        for name, value in values.items():
            object.__setattr__(other, name, value)
        return other

    @property
    def role(self) -> str:
        """Return the name of the condition's datum in messages."""
        return self.name or f"{self.kind} {str(self.region)!r}"

    @property
    def is_strong(self) -> bool:
        """Return whether the trial space can hold the condition: all components of u on whole faces of the cube."""
        return False

    @property
    def is_support(self) -> bool:
        """Return whether the condition answers loads: it gives values of u, or a flux that depends on u."""
        return self.is_essential or self.factor is not None

    @property
    def text(self) -> str:
        """Return the data for a report."""
        return _joined(self.data) if self.factor is None else f"{_joined(self.factor)}, outside {_joined(self.data)}"

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


class Value(Condition):
    """u = g on a region of the boundary, by default zero, or that of the exact solution.

    An entry of g that is None leaves that component free.

    Parameters
    ----------
    region : Region or str
        Where the condition holds.
    data : datum, optional
        g.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> warm = [iga_nn.Value("u0", "20"), iga_nn.Exchange("nz > 0.9", 25, 30)]
    >>> iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(conditions=warm)).report.converged
    True
    """

    is_essential: ClassVar[bool] = True

    @property
    def free(self) -> tuple[bool, ...]:
        """Return for each component whether it is left free; () if none is."""
        entries = self.data if isinstance(self.data, list | tuple) else ()
        return tuple(entry is None for entry in entries) if None in entries else ()

    @property
    def is_strong(self) -> bool:
        """Return whether the trial space can hold the condition: all components of u on whole faces of the cube."""
        return self.entries is None and bool(self.faces) and not self.free

    def _full(self, data: Any) -> Any:
        if self.free and all(self.free):
            raise ValueError(f"{self.role}: gives no component; leave it out")
        return [0.0 if entry is None else entry for entry in data] if self.free else data

    def directions(self, components: int, normal: Array) -> list[Array]:
        """Return the unit directions (c, m) along which values are given, for normals (3, m)."""
        units = np.eye(components)[:, :, None] * np.ones(normal.shape[1])
        return [unit for unit, is_free in zip(units, self.free or (False,) * components, strict=True) if not is_free]

    def values_at(self, exact: Exact, x: Array) -> Array:
        """Return the values (c, ...), or (1, ...) of the component along the one direction, at points (3, ...)."""
        return exact.exact_values(x) if self.datum is None else self.datum(x)

    def values_along(self, direction: Array, exact: Exact, x: Array) -> Array:
        """Return the values (m,) along a direction (c, m) at points (3, m)."""
        found = self.values_at(exact, x)
        return found[0] if len(found) != len(direction) else np.asarray((found * direction).sum(axis=0))


class Fix(Value):
    """Hold a body: u = g on a region, zero by default; an entry of g that is None leaves that component free.

    Examples
    --------
    >>> import iga_nn
    >>> print(iga_nn.Fix("x < 1", (0, None, "y")).text)
    0;free;y
    """


class Roller(Value):
    """Hold a body along the outward normal alone: u . n = g on a region, zero by default.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Roller("w0").role
    "roller 'w0'"
    """

    entries: ClassVar[int | None] = 1
    is_along_normal: ClassVar[bool] = True

    def directions(self, components: int, normal: Array) -> list[Array]:
        """Return the normal."""
        return [normal]


class Symmetry(Roller):
    """Hold a body where a plane of symmetry cuts it: u . n = 0 on a region, as on a roller.

    Examples
    --------
    >>> import iga_nn
    >>> issubclass(iga_nn.Symmetry, iga_nn.Roller)
    True
    """


class Flux(Condition):
    """flux . n = g on a region, the flux into the body; None for that of the exact solution.

    Parameters
    ----------
    region : Region or str
        Where the condition holds.
    data : datum or None
        g.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> heated = [iga_nn.Value("u0", 20), iga_nn.Flux("u1", "x")]
    >>> iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(conditions=heated)).report.converged
    True
    """

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return g (c, ...)."""
        return exact.exact_flux(self.role, x, normal) if self.datum is None else self.datum(x)


class Load(Flux):
    """Load a body by a force per area on a region: sigma n = g.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> pulled = iga_nn.Elasticity(conditions=[iga_nn.Fix("u0"), iga_nn.Load("u1", (0, 0, 1))])
    >>> iga_nn.solve(benchmark_volume(2), pulled).report.balance.imbalance < 1e-8
    True
    """


class Pressure(Flux):
    """Load a body by a force per area against the outward normal: sigma n = -p n on a region.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Pressure("nz > 0.9", "10-z").role
    "pressure 'nz > 0.9'"
    """

    entries: ClassVar[int | None] = 1
    is_along_normal: ClassVar[bool] = True

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return -p n (3, ...)."""
        return super().flux_at(exact, x, normal) if self.datum is None else -self.datum(x)[0] * normal


class Exchange(Condition):
    """flux . n = alpha (outside - u) on a region, as of heat that passes to the air.

    Parameters
    ----------
    region : Region or str
        Where the condition holds.
    alpha : entry
        The factor, not negative.
    outside : datum or None
        The value outside; None for the one with which the exact solution fits.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Exchange("nz > 0.9", 25, "20+x").text
    '25, outside 20+x'
    """

    def __init__(self, region: Region | str, alpha: Any, outside: Any = None, *, name: str = "") -> None:
        super().__init__(region, outside, name=name)
        if alpha is None:
            raise ValueError(f"{self.role}: the {self.factor_name} must be a number, a formula or a function, got None")
        object.__setattr__(self, "factor", alpha)

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the pair of a keyword. Raises ValueError for anything else."""
        if not isinstance(data, tuple | list) or len(data) != 2 or data[0] is None:
            role = name or f"{cls.kind} {str(region)!r}"
            words = "alpha, g" if name else "factor, value outside"
            raise ValueError(f"{role}: give two entries ({words}), got {data!r:.80}")
        return cls(region, *data, name=name)

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return the flux (c, ...) into a body with u = 0."""
        if self.datum is not None:
            return np.asarray(self.factor_at(x) * self.datum(x))
        return exact.exact_flux(self.role, x, normal) + self.factor_at(x) * exact.exact_values(x)


class Robin(Exchange):
    """flux . n + alpha u = g on a region, g in the place of `outside`; None for the g of the exact solution.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Robin("u1", 2, 6).kind
    'robin'
    """

    factor_name: ClassVar[str] = "alpha"

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return g (c, ...)."""
        return super().flux_at(exact, x, normal) if self.datum is None else self.datum(x)


class Spring(Exchange):
    """Hold a body by an elastic foundation: sigma n = alpha (outside - u), a force per area.

    The value outside is zero by default; other data as of `Exchange`.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Spring("nz < -0.9", 50).text, iga_nn.Spring("nz < -0.9", 50, (0, 0, 1)).text
    ('50', '50, outside 0;0;1')
    """

    def __init__(self, region: Region | str, alpha: Any, outside: Any = 0.0, *, name: str = "") -> None:
        super().__init__(region, alpha, outside, name=name)

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the factor of a keyword, or from its pair."""
        return super().of(region, data if isinstance(data, tuple | list) else (data, 0.0), name)

    @property
    def text(self) -> str:
        """Return the factor for a report, and the value outside if it is not zero."""
        is_zero = isinstance(self.data, list | float) and not np.any(self.data)
        return _joined(self.factor) if is_zero else super().text


KINDS = {name.lower(): globals()[name] for name in __all__}  # by the name of an option
OF_SCALARS = {"value": Value, "inflow": Flux, "exchange": Exchange}  # by keyword; those of Poisson and Problem
OF_BODIES = {kind.kind: kind for kind in (Fix, Roller, Symmetry, Load, Pressure, Spring)}


def listed(given: Iterable[Condition]) -> tuple[Condition, ...]:
    """Return the conditions of a list. Raises TypeError for anything else."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise TypeError(f"conditions must be a list of conditions such as [iga_nn.Value('u0', 1)], got {given!r:.80}")
    found = tuple(given)
    if wrong := [one for one in found if not isinstance(one, Condition)]:
        raise TypeError(f"conditions must be objects such as iga_nn.Value('u0', 1), got {wrong[0]!r:.80}")
    return found


def on_regions(kind: type[Condition], entries: GivenRegions | None) -> Iterator[Condition]:
    """Yield the conditions of a problem's keyword: a dictionary of regions to data, or regions alone.

    Raises ValueError for data of a wrong kind, ExpressionError for a region that is refused.
    """
    for given, data in entries.items() if isinstance(entries, Mapping) else [(entries, None)]:
        if given is not None:
            yield from (kind.of(region, data) for region in regions_of(given))


def on_faces(keywords: Mapping[str, tuple[type[Condition], OnFaces]], rest: str, values: Any) -> list[Condition]:
    """Return the conditions of keywords of faces: those of the faces that they name, and values on all others.

    keywords: by name the kind, and its data by face. rest: the keyword of the values. Raises ValueError for names of no
    face, and for faces with two kinds of data.
    """
    found: dict[str, Condition] = {}
    for keyword, (kind, faces) in keywords.items():
        if not isinstance(faces, Mapping):
            raise ValueError(f'{keyword} must be a dictionary of face names such as {{"u0": ...}}, got {faces!r:.80}')
        for face, data in faces.items():
            if face not in FACE_NAMES and not PATCH_FACE.fullmatch(str(face)):
                names = f"{', '.join(FACE_NAMES)}, and p2_u0 of patch 2 of several"
                raise ValueError(f"{keyword}: {face!r} is no face of the cube; the faces are {names}")
            if face in found:
                raise ValueError(
                    f"face {face} has both {found[face].name.split()[0]} and {keyword} data; give only one"
                )
            found[face] = kind.of(Region(face), data, f"{keyword} {face}")
    others = [face for face in FACE_NAMES if face not in found]
    return [*found.values(), *([Value(Region(" or ".join(others)), values, name=rest)] if others else [])]


def _joined(data: Any) -> str:
    """Return a formula or a number, or the entries of a vector with semicolons between them."""
    if isinstance(data, list | tuple):
        return ";".join("free" if entry is None else _joined(entry) for entry in data)
    if data is None:
        return "that of the exact solution"
    return f"{data:.12g}" if isinstance(data, float) else str(data)
