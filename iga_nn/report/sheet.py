"""Makes the sheet of a report: one page to print and to sign, with what was solved, on which proof, and the results."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parameterize.arrays import listed

from ..rounding import distance
from . import asked, balance, extremes
from . import document as reports
from .document import Report
from .statement import regions_of, statement_of

MOST_ROWS = 8  # of a table: the sheet is one page
LONGEST = 160  # letters of a cell
MOST_NOTES, LONGEST_NOTE = 8, 260  # lines below the results, and letters of one

Row = tuple[str, ...]


@dataclass(frozen=True)
class SignedSheet:
    """Hold the tables of a sheet, each with its head first.

    subject: the part's file and its hash, and the volume's. proof: what is proved of the map, and how near it is to the
    part. problem: equation and material. conditions: supports and loads. results: the answers with their intervals, or
    the largest values without. notes: what the results rest on, notices of the solve, and what the supports answer.
    """

    subject: list[Row]
    proof: list[Row]
    problem: list[Row]
    conditions: list[Row]
    results: list[Row]
    notes: list[str]


def sheet_of(report: Report) -> SignedSheet:
    """Return the sheet of a finished report."""
    problem, conditions = _cut(statement_of(report)), _cut(regions_of(report))
    return SignedSheet(_subject(report), _proof(report), problem, conditions, _results(report), _notes(report))


def _subject(report: Report) -> list[Row]:
    given = report["input"]
    rows = [("part", Path(given["part"]).name)] if given.get("part") else []
    rows += [("file", str(given["file"])), ("its SHA-256", str(given.get("sha256", "–")))]
    return [*rows, ("computed by", f"iga-nn {report['versions']['iga-nn']}")]


def _proof(report: Report) -> list[Row]:
    quality = report["parameterization"]
    rows = [(reports.claim(report), _bounded(quality)), ("one-to-one", reports.one_to_one(report))]
    if apart := reports.surface_distance(report):
        rows.append(("largest distance to the part", f"{distance(apart['max'])}{_of_box(apart['max'])}"))
    if volume := reports.volume_in_words(report):
        rows.append(("volume", ", ".join(volume)))
    count = reports.summarized(quality)["summary"]["patches"] if "patches" in quality else 1
    points = reports.size_in_words(quality)
    return [*rows, ("blocks, control points", f"{count:,}, {points}")]


def _bounded(quality: Report) -> str:
    """Return the verdict on det J with its proved bound."""
    bound = quality.get("det_lower_bound")
    proved = quality["bijective"] == "certified" and bound is not None
    return f"{quality['bijective']}{f', at least {bound:.3g} of its mean' if proved else ''}"


def _of_box(largest: float) -> str:
    return "" if distance(largest) == "exact" else " of the box's diagonal"


def _results(report: Report) -> list[Row]:
    section = reports.solved(report) or report.get("modes", {})
    if answers := asked.rows(section):
        return _cut([("quantity", "value", "interval"), *((ask, value, within) for ask, value, within, _ in answers)])
    found = extremes.finest(section) if section.get("levels") else {}
    rows = [(name, text, "no interval") for name, (_, text) in found.items()]
    frequencies = enumerate(section.get("frequencies", ()), start=1)
    rows += [(f"mode {number}", f"{hertz:.4g} Hz", "no interval") for number, hertz in frequencies]
    return _cut([("quantity", "value", "interval"), *rows]) if rows else []


def _notes(report: Report) -> list[str]:
    """Return what must be known beside the results, the most important first."""
    section = reports.solved(report)
    levels = section.get("levels") or [{}]
    notes = [*levels[-1].get("notices", ()), *extremes.lines(section)[:2]]
    notes += [f"{ask}: {why}" for ask, _, _, why in asked.rows(section) if why]
    notes += [f"Balance: {line}" for line in balance.lines(section)[:3]]
    left = len(notes) - MOST_NOTES
    short = [text if len(text) <= LONGEST_NOTE else f"{text[: LONGEST_NOTE - 1]}…" for text in notes[:MOST_NOTES]]
    return [*short, f"and {left} more in the report"] if left > 0 else short


def _cut(rows: list[Any]) -> list[Row]:
    """Return the first rows of a table, with short cells, and a last one on what is left out."""
    short = [tuple(text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…" for text in row) for row in rows]
    if len(short) <= MOST_ROWS + 1:
        return short
    left = [row[1] if len(row) > 2 else row[0] for row in short[MOST_ROWS:]]
    return [*short[:MOST_ROWS], (f"and {len(left)} more", listed(left, 3), *[""] * (len(short[0]) - 2))]
