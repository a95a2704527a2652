"""Titles of the numbers of a level, which is one solve on one mesh, and the tables of levels as text and CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .rounding import rounded

if TYPE_CHECKING:
    from solve import ConvergenceRow

Study = Mapping[int, Sequence["ConvergenceRow"]]  # degree -> its levels, coarsest first

TITLES = {  # keys of report.json and study.csv, in the order they are shown
    "degree": "degree",
    "elements": "elements",
    "dofs": "unknowns",
    "h": "h",
    "l2_relative": "relative L2 error",
    "l2": "L2 error",
    "rate_l2": "rate",
    "h1_relative": "relative H1 error",
    "h1_seminorm": "H1 error",
    "rate_h1": "rate",
    "error_estimate_relative": "estimated relative L2 error",
    "error_estimate": "estimated L2 error",
    "error_estimate_energy_relative": "estimated relative energy error",
    "iterations": "iterations",
}
ESTIMATES = tuple(key for key in TITLES if key.startswith("error_estimate"))
EXACT_ERRORS = tuple(key for key in TITLES if key.startswith(("l2", "h1")))  # known with an exact solution
COLUMNS = (*(key for key in TITLES if key not in ESTIMATES), "converged", "meaningful", "setup", "solve")


def capitalized(title: str) -> str:
    """Return the title with a capital letter first; the others stay."""
    return title[0].upper() + title[1:]


def number(key: str, value: float | None) -> str:
    """Return the number of that key as text, a dash where it is not known."""
    if value is None:
        return "–"
    if isinstance(value, int):
        return f"{value:,}"
    if key == "h":
        return f"{value:.4g}"
    return f"{value:.2f}" if key.startswith("rate") else f"{value:.3e}"


def rows_of(study: Study) -> list[dict[str, Any]]:
    """Return one entry a level with the names of COLUMNS; an unknown number is None. Seconds are CPU seconds."""
    found = []
    for degree, levels in study.items():
        for level in levels:
            given = level.report.as_dict() | level.report.seconds
            given |= {"degree": degree, "rate_l2": level.rate_l2, "rate_h1": level.rate_h1}
            found.append({name: given.get(name) for name in COLUMNS})
    return found


def as_rows(levels: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return the titles of the numbers that are known of some levels, then a row of texts a level; none for none."""
    keys = [key for key in TITLES if any(level.get(key) is not None for level in levels)]
    rows = [[number(key, level.get(key)) for key in keys] for level in levels]
    return [[TITLES[key] for key in keys], *rows] if rows else []


def as_csv(study: Study) -> str:
    """Return the study as comma-separated values with all digits; the first row holds the names."""
    return csv_text(COLUMNS, rows_of(study))


def csv_text(columns: Iterable[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows as comma-separated values with all digits; the first row holds the names, and None stays empty."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(columns), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def as_table(study: Study) -> str:
    """Return the study as a table for a reader, its columns aligned."""
    keys = [key for key in COLUMNS if key in TITLES and key != "h"]
    lines = [[*(TITLES[key] for key in keys), "seconds"]]
    for row in rows_of(study):
        lines.append([*(number(key, row[key]) for key in keys), rounded(row["setup"] + row["solve"], 2)])
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in lines)
