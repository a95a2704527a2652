"""Reads the texts in which an option states data: FACE=TEXT, REGION=DATA, vectors, data by patch."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    from solve.forms.conditions import Condition

SMALLEST_SHARE = 1e-8  # what the linear solver leaves is 1e-10
_EQUALS = re.compile("(?<![<>=])=(?!=)")
_OWNER = re.compile(r"""(?:^|,)\s*("[^"]*"|'[^']*'|[^,:"']*[^,:"'\s])\s*:""")
_DURATION = re.compile(r"(\d+\.?\d*|\.\d+)\s*(s|min|h)?")
_SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
_AT = re.compile(r"\bat\s*\(")
_PATCH = re.compile(r"p(\d+)")
_AT_POINT = re.compile(r"(.*)\sat\s*\((.*)\)\s*")
_OF_REGION = re.compile("\"[^\"]*\"|'[^']*'|plane\\s+[xyz]\\s*=")  # quoted text, and planes of a solid model


def faces(name: str, entries: Sequence[str]) -> dict[str, str | None]:
    """Return FACE=TEXT and FACE entries as a table. Raises InputError for a face with two entries."""
    found: dict[str, str | None] = {}
    for entry in entries:
        face, equals, text = entry.partition("=")
        if face in found:
            raise InputError(f"{name}: face {face} is given twice")
        found[face] = text if equals else None
    return found


def on_regions(kind: str, entries: Sequence[str], read: Callable[[str], Any]) -> dict[str, Any]:
    """Return REGION=DATA and REGION entries as a table.

    read: the function that converts the text of the data; an entry without data has None. The = of <= and >=, that of
    "plane x=60", and quoted text belong to the region. Raises InputError for a region with two entries.
    """
    found: dict[str, Any] = {}
    for entry in entries:
        split = _EQUALS.search(_OF_REGION.sub(lambda text: "." * len(text[0]), entry))
        region = (entry if split is None else entry[: split.start()]).strip()
        if not region:
            raise InputError(f"{kind} {entry!r:.80}: write a region before the =, such as 'nz > 0.9'")
        if region in found:
            raise InputError(f"{kind}: region {region!r:.80} is given twice")
        found[region] = None if split is None else read(entry[split.end() :].strip())
    return found


def datum(kind: type[Condition], entries: int, text: str) -> Any:
    """Return the data of a condition on a region: a formula, a vector, or FACTOR:OUTSIDE. Raises InputError.

    An entry of a vector that is left out leaves the component of a support free.
    """
    from solve.forms.conditions import Exchange, Foundation, Spring

    flag = "--" + kind.option.replace("_", "-")
    if kind.has_point:
        return at_point(flag, text)
    if issubclass(kind, Exchange):
        factor, colon, outside = text.partition(":")
        if issubclass(kind, Foundation) or (not colon and issubclass(kind, Spring)):
            return text
        if not (factor.strip() and outside.strip()):
            raise InputError(f"{kind.kind} {text!r:.80}: write REGION=ALPHA:OUTSIDE, such as 'nz > 0.9=25:20'")
        return factor, outside if entries == 1 else vector(flag, outside)
    if entries == 1:
        return text
    if _AT.search(text):
        raise InputError(f"{flag} {text!r:.80}: acts at no point: leave 'at (x, y, z)' out")
    parts = vector(flag, text)
    return [entry if entry.strip() else None for entry in parts or ()] if kind.is_essential else parts


def vector(flag: str, text: str | None) -> list[str] | None:
    """Return the formulas of a vector; "0" is the zero vector. Raises InputError where there are not three formulas."""
    if text is None:
        return None
    entries = ["0"] * 3 if text.strip() == "0" else text.split(";")
    if len(entries) != 3:
        form = "write three formulas with semicolons between them, such as '0;0;-1', or 0 for none"
        raise InputError(f"{flag} {text!r:.80}: {form}")
    return entries


def at_point(flag: str, text: str) -> tuple[list[str], list[str]]:
    """Return the vector and the point of "0;0;-500 at (10, 0, 50)". Raises InputError for another text."""
    found = _AT_POINT.fullmatch(text)
    parts, point = (found[1].split(";"), found[2].split(",")) if found else ([], [])
    if len(parts) != 3 or len(point) != 3:
        raise InputError(f"{flag} {text!r:.80}: write a vector and a point, such as '0;0;-500 at (10, 0, 50)'")
    return parts, point


def by_patch(flag: str, text: str, read: Callable[[str], Any]) -> Any:
    """Return what `read` makes of a text, or of each patch's or solid's own entry, by its number or name.

    Texts by patch are such as "p0: 1, p1: 2+x", by solid such as "steel: 210000, pad: 8"; a name with a comma, a colon
    or a quotation mark stands in quotes. Raises InputError for an owner with two entries, for patches beside solids,
    and for text before the first owner.
    """
    before, *rest = _OWNER.split(text)
    if not rest:
        return read(text)
    owners = [int(patch[1]) if (patch := _PATCH.fullmatch(name)) else name.strip("\"'") for name in rest[::2]]
    if before.strip() or len(set(owners)) < len(owners) or len(set(map(type, owners))) > 1:
        forms = "'steel: 1, pad: 2', or a patch, 'p0: 1, p1: 2'"
        raise InputError(f"{flag} {text!r:.80}: write one entry a solid, {forms}")
    return {owner: read(entry.strip()) for owner, entry in zip(owners, rest[1::2], strict=True)}


def numbers(flag: str, given: float | str) -> Any:
    """Return a number, or the numbers of each patch or solid. Raises InputError."""
    return _plain(given) if not isinstance(given, str) else by_patch(flag, given, lambda text: number(flag, text))


def constants(flag: str, given: float | str | None) -> Any:
    """Return a number, or three of them with semicolons between, also those of each solid. Raises InputError."""

    def read(text: str) -> Any:
        parts = [number(flag, part) for part in text.split(";")]
        if len(parts) not in (1, 3):
            raise InputError(
                f"{flag} {text!r:.80}: give one number, or three with semicolons along the material's axes"
            )
        return parts[0] if len(parts) == 1 else tuple(parts)

    return _plain(given) if not isinstance(given, str) else by_patch(flag, given, read)


def _plain(given: float | None) -> float | None:
    """Return a number without its class."""
    return float(given) if isinstance(given, float) else given


def number(flag: str, text: str) -> float:
    """Return the number of a text. Raises InputError for another text."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{flag} {text!r:.80}: give a number, or one a solid, such as 'steel: 1, pad: 2'") from None


def duration(flag: str, given: str | float) -> float:
    """Return the seconds of a number, or of a text such as 90s, 10min or 1.5h. Raises InputError for any other."""
    text = str(given).strip()
    found = _DURATION.fullmatch(text)
    seconds = float(found[1]) * _SECONDS[found[2] or "s"] if found else 0.0
    if not 0.0 < seconds < math.inf:
        raise InputError(f"{flag} {text!r:.80}: give a time such as 90s, 10min or 1h")
    return seconds


def share(flag: str, given: str | float) -> float:
    """Return a share between 0 and 1 of a number, or of a text such as 2% or 0.02. Raises InputError for any other."""
    text = str(given).strip()
    try:
        found = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        found = -1.0
    if not SMALLEST_SHARE <= found < 1.0:
        raise InputError(f"{flag} {text!r:.80}: give a share such as 2% or 0.02, {SMALLEST_SHARE:g} or larger")
    return found
