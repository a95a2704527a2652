"""Convergence studies as tables, CSV and rows of numbers."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..figures.curves import Study

COLUMNS = (
    "degree", "elements", "dofs", "h", "l2_relative", "l2", "rate_l2", "h1_relative", "h1_seminorm", "rate_h1",
    "iterations", "converged", "meaningful", "setup", "solve",
)  # fmt: skip


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
    head = ("degree", "elements", "dofs", "relative L2", "L2 error", "rate", "relative H1", "H1 error", "rate",
            "iterations", "seconds")  # fmt: skip
    errors = ("l2_relative", "l2", "rate_l2", "h1_relative", "h1_seminorm", "rate_h1")
    lines: list[tuple[str, ...]] = [head]
    for row in rows_of(study):
        counts = [str(row[name]) for name in ("degree", "elements", "dofs")]
        numbers = [_number(name, row[name]) for name in errors]
        lines.append((*counts, *numbers, str(row["iterations"]), f"{row['setup'] + row['solve']:.2f}"))
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    return "\n".join("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in lines)


def _number(name: str, value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.2f}" if name.startswith("rate") else f"{value:.3e}"
