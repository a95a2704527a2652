"""Shows the loads on a body and the reactions of its supports, from a level of report.json; older levels lack them.

For elasticity these are forces, for a scalar law inflows. The unit of forces is that of stresses times that of areas.
"""

import math
import re
from collections.abc import Sequence
from typing import Any

from ..level_table import capitalized

AXES = ("x", "y", "z")
NEWTON = {("MPa", "mm"), ("N/mm²", "mm"), ("N/mm^2", "mm"), ("Pa", "m"), ("N/m²", "m"), ("N/m^2", "m")}
FACE = re.compile(r"(p\d+_)?[uvw][01]")  # of a patch
MOST_FACES = 6  # whose reactions stand one by one; more are one sum
TINY = 1e-6  # of the largest number: the linear solver's own error is smaller


def heading(section: dict[str, Any]) -> str:
    """Return the title of the table."""
    return "What holds the body" if _is_force(section) else "What flows into the body"


def table(section: dict[str, Any]) -> list[list[str]]:
    """Return the head of a table, and a row for the load, for each support and for the imbalance.

    The table is empty where the finest level has no reactions.
    """
    level = _finest(section)
    if not level.get("reactions"):
        return []
    unit = unit_of(section)
    head = [f"{axis}{unit and f' [{unit}]'}" for axis in AXES] if _is_force(section) else ["inflow"]
    rows = [("load", level["load"]), *_reactions(level).items()]
    shown = [["", *head], *([capitalized(role), *_numbers(values, level)] for role, values in rows)]
    of = unit and f" [{moment_unit_of(section)}]"
    shown += [[f"Moment about the origin, {role}{of}", *numbers] for role, numbers in _moments(level)]
    length = section.get("unit")
    for motion in level.get("rigid", ()):
        for name, own in (("shift", f" [{length}]" if length else ""), ("turn", " [rad]")):
            shown.append([f"{capitalized(name)} of {motion['region']}{own}", *_six_digits(motion[name])])
    if "imbalance" in level:
        shown.append(["Imbalance, relative", f"{level['imbalance']:.1e}", *[""] * (len(head) - 1)])
    return shown


def lines(section: dict[str, Any]) -> list[str]:
    """Return a line for the load and one for each support; an empty list where the finest level has no reactions."""
    level = _finest(section)
    if not level.get("reactions"):
        return []
    unit = unit_of(section)
    rows = [("load", level["load"]), *((f"{role} answers", force) for role, force in _reactions(level).items())]
    found = [f"{said} {_vector(_numbers(values, level))}{unit and f' {unit}'}" for said, values in rows]
    turning = [f"{role} {_vector(numbers)}" for role, numbers in _moments(level)]
    of = unit and f" in {moment_unit_of(section)}"
    found += [
        f"{motion['region']} shifts by {_vector(_six_digits(motion['shift']))} at "
        f"{_vector(_six_digits(motion['centre']))}, turns by {_vector(_six_digits(motion['turn']))} rad, "
        f"its loads balanced to {motion['residual']:.0e}"
        for motion in level.get("rigid", ())
    ]
    return found + ([f"moments about the origin{of}: {', '.join(turning)}"] if turning else [])


def _six_digits(values: Sequence[float]) -> list[str]:
    return [f"{value:.6g}" for value in values]


def _finest(section: dict[str, Any]) -> dict[str, Any]:
    levels: list[dict[str, Any]] = section.get("levels") or [{}]
    return levels[-1]


def _reactions(level: dict[str, Any]) -> dict[str, list[float]]:
    """Return the reactions by support; those of the faces of many patches are one sum."""
    faces = [role for role in level["reactions"] if FACE.fullmatch(role)]
    if len(faces) <= MOST_FACES:
        return dict(level["reactions"])
    rest = {role: force for role, force in level["reactions"].items() if role not in set(faces)}
    total = [math.fsum(parts) for parts in zip(*(level["reactions"][role] for role in faces), strict=True)]
    return {f"data on {len(faces):,} faces": total, **rest}


def _is_force(section: dict[str, Any]) -> bool:
    return len(_finest(section).get("load", ())) == len(AXES)


def unit_of(section: dict[str, Any]) -> str:
    """Return the unit of forces, where the units of stresses and of lengths are known."""
    stress, length = section.get("stress_unit"), section.get("unit")
    if (stress, length) in NEWTON:
        return "N"
    return f"{stress}·{length}²" if stress and length else ""


def moment_unit_of(section: dict[str, Any]) -> str:
    """Return the unit of moments, where the units of stresses and of lengths are known."""
    unit, length = unit_of(section), section.get("unit")
    return f"N·{length}" if unit == "N" else f"{section['stress_unit']}·{length}³" if unit else ""


def _moments(level: dict[str, Any]) -> list[tuple[str, list[str]]]:
    """Return the moments of the load and of each support as text; none where the level lacks them."""
    known = level.get("moments")
    if not known:
        return []
    rows = [("load", known["load"]), *_reactions(known).items()]
    return [(role, _numbers(values, known)) for role, values in rows]


def _numbers(values: list[float], level: dict[str, Any]) -> list[str]:
    """Return numbers as text; a number that is tiny in comparison with the largest is written as 0."""
    everything = [*level["load"], *(value for force in level["reactions"].values() for value in force)]
    least = TINY * max(map(abs, everything))
    return [f"{value if abs(value) > least else 0.0:.5g}" for value in values]


def _vector(numbers: list[str]) -> str:
    return numbers[0] if len(numbers) == 1 else f"({', '.join(numbers)})"
