"""States the problem of a report: its equation, its material and its data, for the page."""

from collections.abc import Sequence
from typing import Any

from ..options import PROBLEMS, ProblemOptions
from . import document as reports
from .document import Report

Row = tuple[str, str]  # a name, and the formula or number

FROM_EXACT = "from the exact solution"


def statement_of(report: Report) -> list[Row]:
    """Return the equation of a report and its data; for a study the exact solution; for a map alone an empty list."""
    section = reports.solved(report)
    rows = next((_rows(kind, section) for name, kind in PROBLEMS.items() if name in report), [])
    return rows + ([("exact solution", _text(section["exact"]))] if section.get("exact") else [])


def _rows(kind: type[ProblemOptions], section: Report) -> list[Row]:
    derived = FROM_EXACT if section.get("exact") else "0"
    (words, option), (flux, on_faces) = kind.essential, kind.natural
    faces, exchanges = _faces(section.get(on_faces, ())), _faces(section.get("robin", ()))
    rows = [(name, _text(value) or derived) for name, value in kind.law_of(section)]
    if section.get("regions"):
        rows.append((f"{flux} outside the regions below", derived))
    else:
        where = "elsewhere on the boundary" if faces or exchanges else "on the boundary"
        rows.append((f"{words} {where}", _text(section.get(option, derived))))
    rows += [(f"{flux} on {face}", data or FROM_EXACT) for face, data in faces]
    for face, data in exchanges:
        alpha, _, value = data.partition(":")
        rows.append((f"exchange on {face}", f"κ ∂u/∂n + α u = g, α = {alpha}, g = {value or FROM_EXACT}"))
    return rows


def regions_of(report: Report) -> list[tuple[str, ...]]:
    """Return the head of a table and a row for every condition on a region: kind, region, data, area.

    The table is empty where there are no conditions on regions.
    """
    section = reports.solved(report)
    regions = section.get("regions") or report.get("regions") or []
    unit = f" [{section['unit']}²]" if section.get("unit") else ""
    head = ("condition", "on", "data", f"area{unit}")
    rows = [(*(_text(one.get(key)) for key in ("kind", "region", "data")), _number(one.get("area"))) for one in regions]
    return [head, *rows] if rows else []


def _faces(entries: Sequence[str]) -> list[Row]:
    """Return the face and the data of entries such as "u1=0;0;-1" and "v0"; the data are "" where they are absent."""
    return [(face, data) for face, _, data in (entry.partition("=") for entry in entries)]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else "" if value is None else str(value)
