"""Convergence studies as tables, CSV and rows of numbers."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

from ..levels import ESTIMATES, TITLES

if TYPE_CHECKING:
    from ..figures.curves import Study

COLUMNS = (*(key for key in TITLES if key not in ESTIMATES), "converged", "meaningful", "setup", "solve")


def rows_of(study: Study) -> list[dict[str, Any]]:
    """One entry a level with the names of COLUMNS; what is not known is None. Seconds are process CPU seconds."""
    found = []
    for degree, levels in study.items():
        for level in levels:
            given = level.report.as_dict() | level.report.seconds
            given |= {"degree": degree, "rate_l2": level.rate_l2, "rate_h1": level.rate_h1}
            found.append({name: given.get(name) for name in COLUMNS})
    return found


def as_csv(study: Study) -> str:
    """Comma-separated, all digits, first row the names."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows_of(study))
    return stream.getvalue()


def as_table(study: Study) -> str:
    """Columns for a reader."""
    keys = [key for key in COLUMNS if key in TITLES and key != "h"]
    lines = [[*(TITLES[key] for key in keys), "seconds"]]
    for row in rows_of(study):
        lines.append([*(_number(key, row[key]) for key in keys), f"{row['setup'] + row['solve']:.2f}"])
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in lines)


def _number(key: str, value: float | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, int):
        return str(value)
    return f"{value:.2f}" if key.startswith("rate") else f"{value:.3e}"
