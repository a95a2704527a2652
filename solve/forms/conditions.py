"""Lists the conditions on the boundary, a class each, and reads those that a problem is given.

A new kind is a subclass with its name in `__all__`. Its word in messages and in reports is the name of the class in
small letters, and so is its name on the command line, with underscores. A problem takes it in `conditions`; a short
form of its own is an entry in `OF_SCALARS` or `OF_BODIES`, and a field of the same name in the problem.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeGuard

from parameterize.spline.volume import FACE_NAMES

from .body_loads import Hydrostatic, Load, Pressure
from .condition import Condition as Condition
from .coupled import Cyclic
from .general_conditions import Exchange, Flux, Robin, Value
from .region import PATCH_FACE, Region, Regions, regions_of
from .rigid import Rigid
from .supports import Fix, Foundation, Roller, Spring, Symmetry, TotalSpring, Turn
from .total_loads import Bearing, Moment, RemoteForce, SharedOut, TotalForce

__all__ = [
    "Bearing",
    "Cyclic",
    "Exchange",
    "Fix",
    "Flux",
    "Foundation",
    "Hydrostatic",
    "Load",
    "Moment",
    "Pressure",
    "RemoteForce",
    "Rigid",
    "Robin",
    "Roller",
    "Spring",
    "Symmetry",
    "TotalForce",
    "TotalSpring",
    "Turn",
    "Value",
]

GivenRegions = Regions | Mapping[Any, Any]  # Region or str -> data
OnFaces = Mapping[str, Any]

KINDS: dict[str, type[Condition]] = {kind.option: kind for kind in map(globals().__getitem__, __all__)}
OF_SCALARS = {"value": Value, "inflow": Flux, "exchange": Exchange}  # by keyword; those of Poisson and Problem
STATED_BY_POINT = (Fix, Roller, Symmetry, Load, Pressure, Spring, Foundation, Turn, Rigid, Hydrostatic)
STATED_IN_TOTAL = (TotalForce, Moment, RemoteForce, Bearing, TotalSpring)
OF_BODIES: dict[str, type[Condition]] = {kind.option: kind for kind in (*STATED_BY_POINT, *STATED_IN_TOTAL)}


def listed(given: Iterable[Condition]) -> tuple[Condition, ...]:
    """Return the conditions of a list. Raises TypeError for anything else."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise TypeError(f"conditions must be a list of conditions such as [iga_nn.Value('u0', 1)], got {given!r:.80}")
    found = tuple(given)
    if wrong := [one for one in found if not isinstance(one, Condition)]:
        raise TypeError(f"conditions must be objects such as iga_nn.Value('u0', 1), got {wrong[0]!r:.80}")
    return tuple(part for one in found for part in one.parts)


def shares_out(condition: Condition) -> TypeGuard[SharedOut | TotalSpring]:
    """Return whether a condition states something in total, which a solve shares out over its region."""
    return isinstance(condition, SharedOut | TotalSpring)


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
