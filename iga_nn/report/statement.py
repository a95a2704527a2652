"""States the problem of a report: its equation, its material and its data, for the page."""

from collections.abc import Sequence
from typing import Any

from . import document as reports
from .document import Report

Row = tuple[str, str]  # a name, and the formula or number

FROM_EXACT = "from the exact solution"


def statement_of(report: Report) -> list[Row]:
    """Return the equation of a report and its data; for a study the exact solution; for a map alone an empty list."""
    section = reports.solved(report)
    rows = _poisson(section) if "poisson" in report else _elasticity(section) if "elasticity" in report else []
    return rows + ([("exact solution", _text(section["exact"]))] if section.get("exact") else [])


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


def _poisson(section: Report) -> list[Row]:
    has_reaction, given = section.get("reaction") is not None, _derived(section)
    faces, exchanges = _faces(section.get("neumann", ())), _faces(section.get("robin", ()))
    rows = [("equation", f"−∇·(κ ∇u){' + c u' if has_reaction else ''} = f"), ("κ", _text(section.get("kappa", "1")))]
    rows += [("c", _text(section["reaction"]))] if has_reaction else []
    rows += [("f", _text(section.get("source", given)))]
    rows += [_rest(section, "u", "boundary", "flux κ ∂u/∂n", [*faces, *exchanges])]
    rows += [(f"flux κ ∂u/∂n on {face}", data or FROM_EXACT) for face, data in faces]
    for face, data in exchanges:
        alpha, _, value = data.partition(":")
        rows.append((f"exchange on {face}", f"κ ∂u/∂n + α u = g, α = {alpha}, g = {value or FROM_EXACT}"))
    return rows


def _elasticity(section: Report) -> list[Row]:
    young, ratio = section.get("young", 1.0), section.get("poisson_ratio", 0.3)
    faces, given = _faces(section.get("traction", ())), _derived(section)
    return [
        ("equation", "−∇·σ = f,  σ = λ (∇·u) I + μ (∇u + ∇uᵀ)"),
        ("material", _material(young, ratio)),
        ("force f per volume", _text(section.get("body_force", given))),
        _rest(section, "displacement u", "displacement", "traction σ n", faces),
        *((f"traction σ n on {face}", data or FROM_EXACT) for face, data in faces),
    ]


def _material(young: float | str, ratio: float | str) -> str:
    """Return the material of a body; of patches with their own the texts that state them."""
    said = (f"{value:g}" if isinstance(value, float | int) else value for value in (young, ratio))
    words = "Young's modulus E = {}, Poisson's ratio ν = {}".format(*said)
    if isinstance(young, str) or isinstance(ratio, str):
        return words
    first, shear = young * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), young / (2.0 * (1.0 + ratio))
    return f"{words}; λ = {first:.6g}, μ = {shear:.6g}"


def _derived(section: Report) -> str:
    """Return the text for data that are not given."""
    return FROM_EXACT if section.get("exact") else "0"


def _rest(section: Report, essential: str, key: str, natural: str, faces: Sequence[Row]) -> Row:
    """Return the data on the rest of the boundary: natural data where regions are named, otherwise essential data.

    key: the key of the essential data in the section. faces: the faces that have data of their own.
    """
    if section.get("regions"):
        return f"{natural} outside the regions below", _derived(section)
    where = "elsewhere on the boundary" if faces else "on the boundary"
    return f"{essential} {where}", _text(section.get(key, _derived(section)))


def _faces(entries: Sequence[str]) -> list[Row]:
    """Return the face and the data of entries such as "u1=0;0;-1" and "v0"; the data are "" where they are absent."""
    return [(face, data) for face, _, data in (entry.partition("=") for entry in entries)]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else "" if value is None else str(value)
