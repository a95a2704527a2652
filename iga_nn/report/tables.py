"""Writes convergence studies as tables, as CSV and as rows of numbers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..levels import ESTIMATES, TITLES, number

if TYPE_CHECKING:
    from ..figures.curves import Study

COLUMNS = (*(key for key in TITLES if key not in ESTIMATES), "converged", "meaningful", "setup", "solve")


def rows_of(study: Study) -> list[dict[str, Any]]:
    """Return one entry a level with the names of COLUMNS; what is not known is None. Seconds are CPU seconds."""
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
        lines.append([*(number(key, row[key]) for key in keys), f"{row['setup'] + row['solve']:.2f}"])
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in lines)
