"""Keeps the table of a batch, one row a surface, and writes it as text, CSV, JSON and a page without external files."""

import base64
import functools
import io
import logging
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self, get_args
from urllib.parse import quote

from PIL import Image

from ..errors import one_line
from ..level_table import csv_text
from ..report import document as reports
from ..report.artifacts import PAGE
from ..report.html import filled
from ..rounding import distance, distortion, rounded
from ..version import __version__
from ..workflow.worker_run import Ended
from .surfaces import Entry, printable

log = logging.getLogger(__name__)

SCHEMA = 1

State = Literal["certified", "not the part", "not certified", "not solved", "refused", "failed", "waiting"]
FIGURES = {  # columns of batch.csv: their titles on the page
    "bijective": "det J > 0",
    "one_to_one": "one-to-one",
    "arap_mean": "ARAP mean",
    "arap_max": "ARAP max",
    "distance_rms": "distance / diagonal, rms",
    "distance_max": "largest",
    "dofs": "unknowns",
    "l2_relative": "relative L2 error",
    "error_estimate_relative": "estimated L2 error",
    "iterations": "iterations",
    "seconds": "seconds",
}
COLUMNS = ("surface", "folder", "state", *FIGURES, "line")

PICTURE = "faces.png"  # of an output folder
THUMBNAIL = (120, 90)  # pixels, at most
COLORS = 64
KINDS = {"certified": "good", "not solved": "unsure"}  # the others that are done are bad
KINDS |= dict.fromkeys(("not the part", "not certified", "refused", "failed"), "bad")
WHOLE = ("seconds", "dofs", "iterations")


@dataclass(frozen=True, eq=False)
class Row:
    """Hold the result of one surface.

    line: the reason of a refusal or failure.
    """

    entry: Entry
    state: State = "waiting"
    line: str = ""
    report: reports.Report | None = None

    def ended(self, how: Ended) -> Self:
        """Return the row of the surface after the end of its task."""
        if how.report is not None:
            return replace(self, state=reports.state(how.report), line="", report=how.report)
        state: State = "refused" if how.state == "refused" else "failed" if how.state == "failed" else "waiting"
        line = how.line.replace(self.entry.mesh, self.entry.name).removeprefix(f"{self.entry.name}: ")
        return replace(self, state=state, line=printable(line))

    def verdict(self) -> dict[str, Any]:
        """Return the verdict on the result, as `iga-nn run --json` prints it; empty without a result."""
        return reports.verdict(self.report, self.entry.folder) if self.report is not None else {}

    def figures(self) -> dict[str, Any]:
        """Return the numbers of the page, at volume 1 and on the finest mesh; None for an unknown number."""
        known = self.verdict()
        known |= (known.get("levels") or [{}])[-1]
        for key, value in known.get("arap", {}).get("unit_volume", {}).items():
            known[f"arap_{key}"] = value
        for key, value in known.get("surface_distance", {}).items():
            known[f"distance_{key}"] = value
        return {name: known.get(name) for name in FIGURES}

    def as_line(self) -> str:
        """Return the row as a line of the terminal."""
        figures = self.figures()
        facts: list[str] = [self.state, *filter(None, [self.line])]
        if self.report is not None:
            facts += [f"ARAP mean {figures['arap_mean']:.3f}", f"{rounded(figures['seconds'], 0)} s"]
        return f"{self.entry.name}: {', '.join(facts)}"


@dataclass(frozen=True, eq=False)
class Batch:
    """Hold all rows of a batch, in the order of the named surfaces, and the folder of its results."""

    folder: Path
    rows: tuple[Row, ...]

    @property
    def counts(self) -> dict[State, int]:
        """Return the number of surfaces by state, without states that have no surface."""
        found = Counter(row.state for row in self.rows)
        return {state: found[state] for state in get_args(State) if found[state]}

    @property
    def summary(self) -> str:
        """Return the counts in one line."""
        counts = ", ".join(f"{count} {state}" for state, count in self.counts.items())
        return f"{len(self.rows)} surface{'s' * (len(self.rows) != 1)}: {counts}"

    def with_row(self, number: int, row: Row) -> Self:
        """Return the batch with another row at position `number`."""
        return replace(self, rows=(*self.rows[:number], row, *self.rows[number + 1 :]))

    def as_dict(self) -> dict[str, Any]:
        """Return the content of batch.json: a surface's name, folder, state and line, and its verdict."""
        rows = [
            {"surface": row.entry.name, "state": row.state, "line": row.line}
            | row.verdict()
            | {"folder": printable(row.entry.folder.name)}
            for row in self.rows
        ]
        return {"schema": SCHEMA, "iga-nn": __version__, "counts": self.counts, "surfaces": rows}

    def as_csv(self) -> str:
        """Return batch.csv, with all digits."""
        rows = (
            {"surface": row.entry.name, "folder": printable(row.entry.folder.name), "state": row.state}
            | row.figures()
            | {"line": row.line}
            for row in self.rows
        )
        return csv_text(COLUMNS, rows)


def page(batch: Batch) -> str:
    """Return the page as text."""
    return filled(
        "batch/batch.html",
        title=batch.folder.name,
        version=__version__,
        summary=batch.summary,
        titles=list(FIGURES.values()),
        rows=[_row(row) for row in batch.rows],
    )


def _row(row: Row) -> dict[str, Any]:
    """Return the content of a row for the template; each figure has its text and the value by which it is sorted."""
    report = row.entry.folder / PAGE
    return {
        "name": row.entry.name,
        "state": row.state,
        "kind": KINDS.get(row.state, ""),
        "line": row.line,
        "link": quote(f"{row.entry.folder.name}/{PAGE}", errors="surrogateescape") if report.is_file() else "",
        "picture": _picture(row.entry.folder / PICTURE) if row.report is not None else "",
        "figures": [(_text(name, value), "" if value is None else value) for name, value in row.figures().items()],
    }


def _text(name: str, value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if name in WHOLE:
        return rounded(value, 0)
    return distortion(value, 3) if name.startswith("arap") else distance(value)


def _picture(path: Path) -> str:
    """Return a small picture in Base64, empty where there is none."""
    try:
        return _thumbnail(path, path.stat().st_mtime_ns)
    except FileNotFoundError:
        return ""  # nothing can be drawn on this machine
    except Exception as error:  # no picture ends a batch
        log.warning("%s: no thumbnail: %s", path, one_line(error))
        return ""


@functools.lru_cache(maxsize=4096)
def _thumbnail(path: Path, _written: int) -> str:
    """Return the thumbnail of a picture; each picture is read once, though the page is written many times."""
    stream = io.BytesIO()
    with Image.open(path) as image:
        small = image.convert("RGB")
        small.thumbnail(THUMBNAIL)
        small.quantize(COLORS).save(stream, "png", optimize=True)
    return base64.b64encode(stream.getvalue()).decode("ascii")
