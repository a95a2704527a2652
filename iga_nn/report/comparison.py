"""Puts two finished runs side by side: their verdicts, numbers with ratios, and figures, as text and as one page."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..level_table import TITLES, number
from ..rounding import rounded
from ..version import __version__
from . import asked, extremes, html
from . import document as reports

Cell = tuple[float | None, str]  # the number, None for a text, and its text


@dataclass(frozen=True)
class Run:
    """Hold an output folder and its report."""

    folder: Path
    report: reports.Report

    @classmethod
    def of(cls, folder: str | Path) -> "Run":
        """Return the run of an output folder. Raises InputError where the folder contains no finished run."""
        path = Path(folder)
        report = reports.read(path)
        if report is None or "parameterization" not in report:
            raise InputError(f"{path}: is no output folder of a run: its report.json is missing, damaged or unfinished")
        if not reports.is_finished(report):
            raise InputError(f"{path}: the run in this folder is not finished; compare it after its end")
        return cls(path, report)

    def cells(self) -> dict[str, dict[str, Cell]]:
        """Return the run's numbers in groups, each number by its name."""
        section = reports.solved(self.report)
        finest = section["levels"][-1] if section.get("levels") else {}
        return {
            "Asked quantities": asked.cells(self.report),
            "The map": _of_map(self.report),
            "The finest solve": {
                _titled(key, section): (float(finest[key]), number(key, finest[key]))
                for key in TITLES
                if finest.get(key) is not None and not key.startswith("rate")
            },
            "Largest and smallest values": dict(extremes.finest(section)),
            "Forces and flows": _of_regions(finest),
            "Seconds": {name: (value, rounded(value, 1)) for name, value in self.report["seconds"].items()},
        }


def _of_map(report: reports.Report) -> dict[str, Cell]:
    quality = report["parameterization"]
    found: dict[str, Cell] = {"control points": (None, reports.size_in_words(quality))}
    if arap := quality.get("arap", {}).get("unit_volume"):
        where = " of own boxes" if "patches" in quality else ""
        found |= {f"ARAP distortion{where}, {name}": (arap[name], f"{arap[name]:.4g}") for name in ("mean", "max")}
    distance = reports.surface_distance(report)
    return found | {
        f"distance / box's diagonal, {name}": (distance[name], f"{distance[name]:.3g}")
        for name in ("rms", "max")
        if name in distance
    }


def _titled(key: str, section: Mapping[str, Any]) -> str:
    unit = section.get("unit") if key == "h" else None
    return f"{TITLES[key]} [{unit}]" if unit else TITLES[key]


def _of_regions(level: Mapping[str, Any]) -> dict[str, Cell]:
    """Return the reactions of each region, by their lengths, and the load that they balance."""
    given = {f"reaction on {region}": values for region, values in (level.get("reactions") or {}).items()}
    given |= {"load": level["load"]} if level.get("load") else {}
    return {name: (math.hypot(*values), ", ".join(f"{x:.4g}" for x in values)) for name, values in given.items()}


def rows(one: Run, other: Run) -> dict[str, list[list[str]]]:
    """Return a table for each group: the name of each number, its two values and the ratio of the second to the first.

    A dash is written for a number that a run lacks, and for a ratio to zero.
    """
    left, right = one.cells(), other.cells()
    found = {}
    for group in left:
        names = list(dict.fromkeys([*left[group], *right[group]]))
        missing: Cell = (None, "–")
        pairs = [(name, left[group].get(name, missing), right[group].get(name, missing)) for name in names]
        found[group] = [[name, a[1], b[1], _ratio(a[0], b[0])] for name, a, b in pairs]
    return {group: table for group, table in found.items() if table}


def _ratio(one: float | None, other: float | None) -> str:
    return "–" if one is None or other is None or one == 0.0 else f"{other / one:.4g}"


def as_text(one: Run, other: Run) -> str:
    """Return the verdicts and the tables for a terminal, their columns aligned."""
    head = ["", str(one.folder), str(other.folder), "ratio"]
    states = ["verdict", *(reports.state(run.report) for run in (one, other)), ""]
    lines = [head, states, *(row for table in rows(one, other).values() for row in table)]
    widths = [max(len(line[i]) for line in lines) for i in range(4)]
    row = f"{{:<{widths[0]}}}  {{:>{widths[1]}}}  {{:>{widths[2]}}}  {{:>{widths[3]}}}"
    return "\n".join(row.format(*line).rstrip() for line in lines)


def page(one: Run, other: Run) -> str:
    """Return the page as text: the verdicts, the tables, the figures side by side, and the commands."""
    runs = (one, other)
    drawn = [dict(html.figures(run.report, run.folder)) for run in runs]
    return html.filled(
        "report/compare.html",
        title=f"{one.folder} and {other.folder}",
        version=__version__,
        names=[str(run.folder) for run in runs],
        verdicts=[html.verdicts(run.report) for run in runs],
        notices=[html.notices(run.report) for run in runs],
        tables=rows(one, other),
        figures={heading: [each.get(heading) for each in drawn] for heading in dict.fromkeys([*drawn[0], *drawn[1]])},
        commands=[run.report.get("command", "") for run in runs],
    )
