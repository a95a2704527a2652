"""Puts finished runs side by side: their verdicts, numbers with ratios, and figures, as text and as one page."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from parameterize.arrays import listed

from ..errors import InputError
from ..level_table import TITLES, number
from ..rounding import EXACT, distance, distortion, rounded
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
        found |= {
            f"ARAP distortion{where}, {name}": _shown(arap[name], distortion(arap[name])) for name in ("mean", "max")
        }
    apart = reports.surface_distance(report)
    return found | {
        f"distance / box's diagonal, {name}": _shown(apart[name], distance(apart[name]))
        for name in ("rms", "max")
        if name in apart
    }


def _shown(value: float, text: str) -> Cell:
    """Return a number and its text; rounding errors have no ratio."""
    return (None if text == EXACT else value), text


def _titled(key: str, section: Mapping[str, Any]) -> str:
    unit = section.get("unit") if key == "h" else None
    return f"{TITLES[key]} [{unit}]" if unit else TITLES[key]


def _of_regions(level: Mapping[str, Any]) -> dict[str, Cell]:
    """Return the reactions of each region, by their lengths, and the load that they balance."""
    given = {f"reaction on {region}": values for region, values in (level.get("reactions") or {}).items()}
    given |= {"load": level["load"]} if level.get("load") else {}
    return {name: (math.hypot(*values), ", ".join(f"{x:.4g}" for x in values)) for name, values in given.items()}


def rows(runs: Sequence[Run]) -> dict[str, list[list[str]]]:
    """Return a table for each group: the name of each number, its values, and the ratios to that of the first run.

    A dash is written for a number that a run lacks, and for a ratio to zero.
    """
    each, missing = [run.cells() for run in runs], (None, "–")
    found = {}
    for group in each[0]:
        names = dict.fromkeys(name for cells in each for name in cells[group])
        lines = [(name, [cells[group].get(name, missing) for cells in each]) for name in names]
        found[group] = [
            [name, *(text for _, text in cells), *(_ratio(cells[0][0], value) for value, _ in cells[1:])]
            for name, cells in lines
        ]
    return {group: table for group, table in found.items() if table}


def _ratio(one: float | None, other: float | None) -> str:
    return "–" if one is None or other is None or one == 0.0 else f"{other / one:.4g}"


def names_of(runs: Sequence[Run]) -> list[str]:
    """Return the shortest endings of the folders' paths that tell the runs apart."""
    parts = [run.folder.resolve().parts for run in runs]
    for count in range(1, max(map(len, parts)) + 1):
        names = [str(Path(*row[-count:])) for row in parts]
        if len(set(names)) == len(names):
            return names
    return [str(run.folder) for run in runs]  # a folder beside itself


def _heads(runs: Sequence[Run]) -> list[str]:
    """Return the heads of the columns: the runs, and the ratios of all but the first."""
    names = names_of(runs)
    return [*names, *(["ratio"] if len(runs) == 2 else [f"{name}, ratio" for name in names[1:]])]


def as_text(runs: Sequence[Run]) -> str:
    """Return the verdicts and the tables for a terminal, their columns aligned."""
    head = ["", *_heads(runs)]
    states = ["verdict", *(reports.state(run.report) for run in runs)]
    lines = [head, states + [""] * (len(head) - len(states)), *(row for table in rows(runs).values() for row in table)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    first, *others = widths
    row = "  ".join([f"{{:<{first}}}", *(f"{{:>{width}}}" for width in others)])
    return "\n".join(row.format(*line).rstrip() for line in lines)


def page(runs: Sequence[Run]) -> str:
    """Return the page as text: the verdicts, the tables, the figures side by side, and the commands."""
    drawn, names = [dict(html.figures(run.report, run.folder)) for run in runs], names_of(runs)
    headings = dict.fromkeys(heading for each in drawn for heading in each)
    return html.filled(
        "report/compare.html",
        title=listed(names),
        version=__version__,
        names=names,
        heads=_heads(runs),
        verdicts=[html.verdicts(run.report) for run in runs],
        notices=[html.notices(run.report) for run in runs],
        tables=rows(runs),
        figures={heading: [each.get(heading) for each in drawn] for heading in headings},
        commands=[run.report.get("command", "") for run in runs],
    )
