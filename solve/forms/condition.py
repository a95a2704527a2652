"""Defines Condition: data on a region of the boundary, which are values, a flux, or an exchange with the outside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from parameterize.arrays import Array

from .data import Data
from .region import Region, regions_of

Kind = Literal["value", "fix", "roller", "symmetry", "flux", "load", "pressure", "exchange", "spring"]
ESSENTIAL = ("value", "fix", "roller", "symmetry")
ALONG_NORMAL = ("roller", "symmetry", "pressure")  # kinds with one number a point: along the outward normal
WITH_FACTOR = ("exchange", "spring")

Regions = Region | str | Sequence[Region | str]
GivenRegions = Regions | Mapping[Any, Any]  # Region or str -> data


@dataclass(frozen=True)
class Condition:
    """Hold data of one kind on a region.

    kind: the name of the kind. data: for a factor the pair (factor, value outside); None for the data of the exact
    solution. free: of values, the components that are left free.
    """

    kind: Kind
    region: Region
    data: Any
    free: tuple[bool, ...] = ()

    @property
    def role(self) -> str:
        """Return the name of the condition's datum in a problem and in messages."""
        return f"{self.kind} {str(self.region)!r}"

    @property
    def is_essential(self) -> bool:
        """Return whether the condition gives values of u, or of its normal component."""
        return self.kind in ESSENTIAL

    @property
    def is_strong(self) -> bool:
        """Return whether the trial space can hold the condition: all components of u on whole faces of the cube."""
        return self.kind in ("value", "fix") and bool(self.region.faces) and not any(self.free)

    def given(self) -> dict[str, tuple[Data | None, int | None]]:
        """Return the condition's data by role, each with its number of entries, None for the number of components."""
        if self.kind in WITH_FACTOR:
            factor, outside = self.data
            return {f"{self.role}: factor": (factor, 1), self.role: (outside, None)}
        return {self.role: (self.data, 1 if self.kind in ALONG_NORMAL else None)}

    def directions(self, components: int, normal: Array) -> list[Array]:
        """Return the unit directions (c, m) along which values are given, for normals (3, m)."""
        if self.kind in ("roller", "symmetry"):
            return [normal]
        units = np.eye(components)[:, :, None] * np.ones(normal.shape[1])
        return [unit for unit, is_free in zip(units, self.free or (False,) * components, strict=True) if not is_free]


def conditions_of(components: int, exact: Any = None, **kinds: GivenRegions | None) -> tuple[Condition, ...]:
    """Return the conditions from the keywords of a problem; each kind is a dictionary of regions, or regions alone.

    Regions alone have the data of the exact solution, or zero without an exact solution. Raises ValueError for data of
    a wrong kind, ExpressionError for a region that is refused.
    """
    found = []
    for kind, entries in kinds.items():
        if entries is None:
            continue
        pairs: Iterable[tuple[Any, Any]]
        if isinstance(entries, Mapping):
            pairs = [(region, data) for key, data in entries.items() for region in regions_of(key)]
        else:
            pairs = [(region, None) for region in regions_of(entries)]
        for region, data in pairs:
            given = _nothing(kind, region, components) if data is None and exact is None else data
            found.append(_condition(kind, region, given, components))  # type: ignore[arg-type]
    return tuple(found)


def _nothing(kind: str, region: Region, components: int) -> Any:
    """Return zero data for regions without data. Raises ValueError for a kind that needs data."""
    if kind not in ESSENTIAL:
        raise ValueError(f"{kind} {str(region)!r}: has no data")
    return 0.0 if kind in ALONG_NORMAL or components == 1 else [0.0] * components


def _condition(kind: Kind, region: Region, data: Any, components: int) -> Condition:
    if kind in WITH_FACTOR:
        pair = data if isinstance(data, tuple | list) and len(data) == 2 else (data, [0.0] * components)
        if pair[0] is None or (kind == "exchange" and pair is not data):
            raise ValueError(f"{kind} {str(region)!r}: give two entries (factor, value outside), got {data!r:.80}")
        return Condition(kind, region, tuple(pair))
    free: tuple[bool, ...] = ()
    if kind == "fix" and isinstance(data, Sequence) and not isinstance(data, str) and None in data:
        free = tuple(entry is None for entry in data)
        data = [0.0 if entry is None else entry for entry in data]
        if all(free):
            raise ValueError(f"fix {str(region)!r}: gives no component; leave it out")
    return Condition(kind, region, data, free)
