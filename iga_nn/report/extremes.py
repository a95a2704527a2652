"""Shows the extremes of a solve's levels side by side, and whether the largest stress grows under refinement.

Levels and sections are those of report.json; older reports have no extremes. A section's `unit` and `stress_unit` are
free text, which is shown behind the numbers and changes no number.
"""

import math
from collections.abc import Sequence
from typing import Any

Level = dict[str, Any]

SAYINGS = {  # quantity -> its words, the extreme that they name, and the section's unit of its values
    "u": ("u at least", "least", ""),
    "magnitude": ("largest displacement", "largest", "unit"),
    "von_mises": ("von Mises at most", "largest", "stress_unit"),
    "first_principal": ("largest principal stress", "largest", "stress_unit"),
    "third_principal": ("smallest principal stress", "least", "stress_unit"),
    "gradient_magnitude": ("|gradient| at most", "largest", ""),
    "flux_magnitude": ("|flux| at most", "largest", ""),
}
STRESS = "von_mises"
DERIVATIVES = {STRESS: "von Mises stress", "flux_magnitude": "|flux|", "gradient_magnitude": "|gradient|"}
GROWTH = 1.1  # of the largest stress while h is halved; smooth ones, resolved, grow less, at clamped rims 1.2 and more
TINY = 1e-6  # of the largest coordinate: smaller ones are shown as 0


def lines(section: dict[str, Any]) -> list[str]:
    """Return one line for each extreme: its values on all levels and its place on the finest level."""
    return [f"{said} {' → '.join(values)} {at}" for said, *values, at in _rows(section)]


def table(section: dict[str, Any]) -> list[list[str]]:
    """Return the head of a table and a row for each extreme: its values on all levels, its place on the finest level.

    The table is empty where no extremes are known.
    """
    rows = _rows(section)
    return [["", *(f"{level['dofs']:,} unknowns" for level in _known(section)), "where"], *rows] if rows else []


def finest(section: dict[str, Any]) -> dict[str, tuple[float, str]]:
    """Return the extremes of the finest level, by their words with the unit.

    Each extreme is its value, and its value as text with its place.
    """
    found = {}
    for name, said, end, unit in _worded(section):
        extreme = _known(section)[-1]["extremes"][name]
        title = f"{said} [{section[unit]}]" if section.get(unit) else said
        found[title] = (extreme[end], f"{extreme[end]:.4g} at {_place(extreme[f'{end}_at'], section)}")
    return found


def growth_notices(section: dict[str, Any]) -> list[str]:
    """Return a notice where the largest stress, or gradient, grew by more than GROWTH for each time h was halved.

    One level of a stress has a notice that nothing is known of its growth.
    """
    if len(known := _known(section)) < 2:
        return _of_one_level(known, section)
    coarse, fine = known[-2:]
    for name, title in DERIVATIVES.items():
        if name not in coarse["extremes"] or name not in fine["extremes"]:
            continue
        before, now = (level["extremes"][name]["largest"] for level in (coarse, fine))
        if before > 0.0 and now > before * GROWTH ** math.log2(coarse["h"] / fine["h"]):
            grew = f"grew from {before:.4g} to {now:.4g}{_behind(section.get(SAYINGS[name][2]))}"
            where = _place(fine["extremes"][name]["largest_at"], section)
            return [
                f"the largest {title} {grew} under the last refinement, at {where}: where it keeps growing, as at a "
                "clamped rim or a re-entrant edge, it is infinite there and the number is no result; one more --refine "
                "tells"
            ]
    return []


def _of_one_level(known: Sequence[Level], section: dict[str, Any]) -> list[str]:
    """Return the notice on the largest stress where it is known on one level alone, or not at all."""
    if not known or STRESS not in known[-1]["extremes"]:
        return []
    where = _place(known[-1]["extremes"][STRESS]["largest_at"], section)
    return [
        f"the largest {DERIVATIVES[STRESS]}, at {where}, is known on one level alone: at a clamped rim or a re-entrant "
        "edge it is infinite, and the number is no result; --refine 0 1 tells whether it grows"
    ]


def _place(point: Sequence[float], section: dict[str, Any]) -> str:
    """Return a point as text: "(12.5, 0, 3.1) mm"."""
    least = TINY * max(map(abs, point))
    coordinates = ", ".join(f"{x if abs(x) > least else 0.0:.4g}" for x in point)
    return f"({coordinates}){_behind(section.get('unit'))}"


def _behind(unit: str | None) -> str:
    return f" {unit}" if unit else ""


def _known(section: dict[str, Any]) -> list[Level]:
    return [level for level in section.get("levels", []) if level.get("extremes")]


def _rows(section: dict[str, Any]) -> list[list[str]]:
    """Return the words for each extreme, its value on each level, and its place on the finest."""
    rows = []
    for name, said, end, unit in _worded(section):
        levels = [level["extremes"].get(name) for level in _known(section)]
        values = ["–" if level is None else f"{level[end]:.4g}" for level in levels]
        values[-1] += _behind(section.get(unit))
        rows.append([said, *values, f"at {_place(levels[-1][f'{end}_at'], section)}"])
    return rows


def _worded(section: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the quantities of the finest level, each with its words, the name of its extreme and its unit."""
    levels, found = _known(section), []
    for name in levels[-1]["extremes"] if levels else ():
        found.append((name, *SAYINGS.get(name, (f"{name} at most", "largest", ""))))
        if name == "u":
            found.append((name, "u at most", "largest", ""))
    return found
