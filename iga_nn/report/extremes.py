"""Shows the extremes of a solve's levels side by side, where stresses are infinite, and where they yet grow.

Levels and sections are those of report.json; older reports have no extremes, or know no singular places. A section's
`unit` and `stress_unit` are free text, which is shown behind the numbers and changes no number.
"""

import math
from collections.abc import Sequence
from typing import Any

from parameterize.arrays import listed

Level = dict[str, Any]

SAYINGS = {  # quantity -> its words, the extreme that they name, and the section's unit of its values
    "u": ("u at least", "least", ""),
    "magnitude": ("largest displacement", "largest", "unit"),
    "von_mises": ("von Mises at most", "largest", "stress_unit"),
    "plastic_strain": ("equivalent plastic strain at most", "largest", ""),
    "volume_ratio": ("ratio of volumes J at least", "least", ""),
    "first_principal": ("largest principal stress", "largest", "stress_unit"),
    "third_principal": ("smallest principal stress", "least", "stress_unit"),
    "safety": ("smallest safety against yield", "least", ""),
    "gradient_magnitude": ("|gradient| at most", "largest", ""),
    "flux_magnitude": ("|flux| at most", "largest", ""),
}
STRESS = "von_mises"
DERIVATIVES = {STRESS: "von Mises stress", "flux_magnitude": "|flux|", "gradient_magnitude": "|gradient|"}
GROWTH = 1.1  # of the largest stress while h is halved; smooth ones, resolved, grow less, at clamped rims 1.2 and more
SMOOTHED = 1.05  # the plastic strain at the Gauss points over that of splines, up to which there is no notice
MOST_PLACES = 3  # named where a stress is infinite
TINY = 1e-6  # of the largest coordinate: smaller ones are shown as 0


def lines(section: dict[str, Any]) -> list[str]:
    """Return one line for each extreme: its values on all levels and its place on the finest level.

    Where a stress or a gradient is infinite, the first line says so.
    """
    infinite = [f"{_infinite(section)} {where}"] if (where := _where_infinite(section)) else []
    return infinite + [f"{said} {' → '.join(values)} {at}" for said, *values, at in _rows(section)]


def table(section: dict[str, Any]) -> list[list[str]]:
    """Return the head of a table and a row for each extreme: its values on all levels, its place on the finest level.

    The table is empty where no extremes are known.
    """
    rows, known = _rows(section), _known(section)
    if where := _where_infinite(section):
        rows.insert(0, [_infinite(section), *("∞" if level.get("singular") else "–" for level in known), where])
    return [["", *(f"{level['dofs']:,} unknowns" for level in known), "where"], *rows] if rows else []


def finest(section: dict[str, Any]) -> dict[str, tuple[float, str]]:
    """Return the extremes of the finest level, by their words with the unit.

    Each extreme is its value, and its value as text with its place.
    """
    found = {}
    for name, said, end, unit in _worded(section):
        extreme = _known(section)[-1]["extremes"][name]
        title = f"{said} [{section[unit]}]" if section.get(unit) else said
        found[title] = (extreme[end], f"{extreme[end]:.4g} at {_at(extreme, end, section)}")
    return found


def peak_notices(section: dict[str, Any]) -> list[str]:
    """Return the notices on the largest stress, or gradient: where it is infinite, and where it yet grows."""
    known = _known(section)
    if known and "singular" not in known[-1]:  # of a version that did not know these places
        return _growth(known, section) if len(known) > 1 else _of_one_level(known, section)
    return [*_of_singular_places(known, section), *_growth(known, section), *_smoothed(known)]


def _smoothed(known: Sequence[Level]) -> list[str]:
    """Return a notice where splines smooth the peak of the plastic strain at the Gauss points, away from rims."""
    found = known[-1]["extremes"].get("plastic_strain") if known else None
    at_points = known[-1]["load_steps"][-1].get("plastic_strain") if found and known[-1].get("load_steps") else None
    if at_points is None or found is None or "spans" in found or at_points <= SMOOTHED * found["largest"]:
        return []
    return [
        f"the equivalent plastic strain reaches {at_points:.4g} at a Gauss point, and the splines of this mesh "
        f"{found['largest']:.4g}: they smooth the peak; one more --refine resolves it better"
    ]


def _of_singular_places(known: Sequence[Level], section: dict[str, Any]) -> list[str]:
    """Return the notice on the places where the stress is infinite; none where it is finite."""
    where = _where_infinite(section)
    name = next((name for name in DERIVATIVES if known and name in known[-1]["extremes"]), None)
    if not where or name is None:
        return []
    found, unit = known[-1]["extremes"][name], _behind(section.get(SAYINGS[name][2]))
    begin = f"the {_infinite(section)} {where}, and what a mesh gives there is no result"
    if not found.get("spans"):
        return [
            f"{begin}: all of this mesh lies near to these places; one more --refine, or more, leaves a part to read"
        ]
    return [f"{begin}; {SAYINGS[name][0]} {found['largest']:.4g}{unit} at {_at(found, 'largest', section)}"]


def _growth(known: Sequence[Level], section: dict[str, Any]) -> list[str]:
    """Return a notice where the largest stress, or gradient, grew by more than GROWTH for each time h was halved.

    Growth beside a place where it is infinite is known.
    """
    for name, title in DERIVATIVES.items() if len(known) > 1 and "graded" not in known[-1] else ():
        coarse, fine = known[-2:]
        if name not in coarse["extremes"] or name not in fine["extremes"] or fine["extremes"][name].get("beside"):
            continue
        before, now = (level["extremes"][name]["largest"] for level in (coarse, fine))
        if before > 0.0 and now > before * GROWTH ** math.log2(coarse["h"] / fine["h"]):
            grew = f"grew from {before:.4g} to {now:.4g}{_behind(section.get(SAYINGS[name][2]))}"
            where = place_of(fine["extremes"][name]["largest_at"], section)
            return [
                f"the largest {title} {grew} under the last refinement, at {where}: the mesh does not resolve it, or "
                "it is infinite there, as at an edge that the spline rounds off; one more --refine tells"
            ]
    return []


def _of_one_level(known: Sequence[Level], section: dict[str, Any]) -> list[str]:
    """Return the notice on the largest stress where it is known on one level alone, or not at all."""
    if not known or STRESS not in known[-1]["extremes"]:
        return []
    where = place_of(known[-1]["extremes"][STRESS]["largest_at"], section)
    return [
        f"the largest {DERIVATIVES[STRESS]}, at {where}, is known on one level alone: at a clamped rim or a re-entrant "
        "edge it is infinite, and the number is no result; --refine 0 1 tells whether it grows"
    ]


def _infinite(section: dict[str, Any]) -> str:
    """Return the words for what is infinite."""
    return "stress is infinite at" if STRESS in _known(section)[-1]["extremes"] else "gradient is infinite at"


def _where_infinite(section: dict[str, Any]) -> str:
    """Return the words for the places where the stress is infinite; "" where it is finite everywhere."""
    known = _known(section)
    return listed([place["text"] for place in known[-1].get("singular", ())], MOST_PLACES) if known else ""


def _at(extreme: dict[str, Any], end: str, section: dict[str, Any]) -> str:
    """Return the place of an extreme as text, and how far it is from where the stress is infinite."""
    at = place_of(extreme[f"{end}_at"], section)
    if (spans := extreme.get("spans")) is None:
        return at
    if not spans:
        return f"{at}, a number without meaning: all of the mesh lies near to where the stress is infinite"
    radius = f"up to {extreme['radius']:.3g}{_behind(section.get('unit'))}"
    return f"{at}, farther than {spans:g} span{'' if spans == 1.0 else 's'} ({radius}) from there"


def place_of(point: Sequence[float], section: dict[str, Any]) -> str:
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
        rows.append([said, *values, f"at {_at(levels[-1], end, section)}"])
    return rows


def _worded(section: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the quantities of the finest level, each with its words, the name of its extreme and its unit."""
    levels, found = _known(section), []
    for name in levels[-1]["extremes"] if levels else ():
        found.append((name, *SAYINGS.get(name, (f"{name} at most", "largest", ""))))
        if name == "u":
            found.append((name, "u at most", "largest", ""))
    return found
