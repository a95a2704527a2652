"""report.html: what report.json says, the figures and an interactive view, in one file that fetches nothing."""

from __future__ import annotations

import base64
import json
import logging
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from parameterize.files import save_text

from ..errors import one_line
from ..levels import TITLES
from . import document as reports
from .advice import in_words
from .artifacts import PAGE, figures_of
from .document import Report
from .viewer import Scene

log = logging.getLogger(__name__)

VERDICTS = {
    "certified": (
        "good",
        "Certified: free of folds",
        "det J > 0 is proved on the whole cube, rounding errors included.",
    ),
    "folded": (
        "bad",
        "Not certified: the map folds",
        "det J is negative somewhere; do not trust what is solved on it.",
    ),
    "undecided": ("unsure", "Not certified", "Neither det J > 0 on the whole cube nor a fold could be proved."),
    "overlapping": (
        "bad",
        "Nowhere folded, yet it meets itself",
        "det J > 0 is proved, but two parts of the boundary meet",
    ),
}


def write(folder: Path, report: Report, scene: Scene | None) -> None:
    """Write report.html from a finished report; its figures are taken from the folder, where they are. Atomic.

    scene: for the interactive view, where it could be drawn. A page that cannot be made is a bare one: report.json.
    """
    try:
        text = page(report, scene, folder)
    except Exception as error:
        log.warning("report.html is bare, it could not be laid out: %s", one_line(error))
        text = _bare(report, one_line(error))
    save_text(folder / PAGE, text)


def _bare(report: Report, reason: str) -> str:
    whole = escape(json.dumps(reports.plain(report), indent=2))
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>iga-nn</title>'
        f"<p>This page could not be laid out ({escape(reason)}); this is report.json:</p><pre>{whole}</pre></html>"
    )


def page(report: Report, scene: Scene | None, folder: Path) -> str:
    """The page as text."""
    here = files(__package__)
    skeleton, style, script = ((here / f).read_text(encoding="utf-8") for f in ("page.html", "page.css", "viewer.js"))
    name = Path(report["input"]["file"]).name
    sections = [
        _advice(report),
        _convergence(report),
        _notices(report),
        *_figures(report, folder),
        _command(report),
        _details(report),
    ]
    return Template(skeleton).substitute(
        title=f"{escape(name)}: {_heading(report)}",
        subtitle=f"iga-nn {escape(report['versions']['iga-nn'])}, {report['seconds']['total']:.1f} s",
        style=style,
        script=script,
        verdict=_verdict(report),
        facts=_facts(report),
        hidden="" if scene else "hidden",
        choices="".join(_choice(name) for name in ("faces", *_fields(scene))),
        scene=json.dumps(scene, ensure_ascii=False).replace("<", "\\u003c"),
        sections="\n".join(filter(None, sections)),
    )


def _heading(report: Report) -> str:
    solved = {"poisson": "Poisson's equation", "elasticity": "linear elasticity", "study": "convergence study"}
    return next((text for section, text in solved.items() if section in report), "spline volume")


def _verdict(report: Report) -> str:
    quality = report["parameterization"]
    overlapping = quality["bijective"] == "certified" and not reports.is_certified(report)
    kind, heading, meaning = VERDICTS["overlapping" if overlapping else quality["bijective"]]
    if overlapping:
        meaning += " at x, y, z = " + ", ".join(f"{value:.4g}" for value in quality["boundary_meeting"]["point"]) + "."
    elif quality["bijective"] == "certified" and quality.get("boundary_injective"):
        meaning += " Nor do its faces meet themselves: the map is one-to-one."
    if quality.get("witness"):
        meaning += " The worst place: u, v, w = " + ", ".join(f"{value:.4g}" for value in quality["witness"]) + "."
    found = f'<div class="verdict {kind}"><strong>{heading}</strong>{escape(meaning)}</div>'
    if not reports.is_meaningful(report):
        found += '<div class="verdict bad"><strong>The errors mean nothing</strong>The notices below say why.</div>'
    if not reports.is_converged(report):
        found += '<div class="verdict bad"><strong>A solve did not converge</strong>The last iterate is shown.</div>'
    return found


def _facts(report: Report) -> str:
    """The numbers that matter, each with what it is and a remark."""
    quality = report["parameterization"]
    facts = []
    if "arap" in quality:
        arap, boundary = quality["arap"]["unit_volume"], quality["boundary"]
        facts.append(("ARAP distortion, mean", f"{arap['mean']:.4g}", f"largest {arap['max']:.4g}; at volume 1"))
        given = f"rms at volume 1; {boundary['as_given']['rms']:.3g} as given"
        facts.append(("Boundary distance", f"{boundary['unit_volume']['rms']:.3g}", given))
    levels = reports.solved(report).get("levels", [])
    if levels:
        finest = levels[-1]
        facts += [_error_fact(finest, key) for key in ("l2", "error_estimate") if finest.get(key) is not None]
        facts.append(("Unknowns", f"{finest['dofs']:,}", f"{finest['iterations']} iterations"))
    points = " × ".join(map(str, quality["control_points"]))
    facts.append(("Control points", points, "degrees " + ", ".join(map(str, quality["degrees"]))))
    rows = (
        f"<div><dt>{name}</dt><dd>{escape(value)}</dd><small>{escape(remark)}</small></div>"
        for name, value, remark in facts
    )
    return f'<dl class="facts">{"".join(rows)}</dl>'


def _error_fact(level: Report, key: str) -> tuple[str, str, str]:
    """The relative error, and the absolute one as the remark; that alone where the solution is zero."""
    relative = level.get(f"{key}_relative")
    if relative is None:
        return _capitalized(TITLES[key]), f"{level[key]:.3e}", "on the finest mesh"
    return _capitalized(TITLES[f"{key}_relative"]), f"{relative:.3e}", f"absolute {level[key]:.3e}"


def _capitalized(title: str) -> str:
    return title[0].upper() + title[1:]


def _fields(scene: Scene | None) -> list[str]:
    return [field["name"] for field in scene["fields"]] if scene else []


def _choice(name: str) -> str:
    return f'<label><input type="radio" name="field" value="{name}"> {name}</label>'


def _convergence(report: Report) -> str:
    """A row a level, the columns that are known."""
    section = reports.solved(report)
    if not section:
        return ""
    levels = _with_rates(section)
    keys = [key for key in TITLES if any(level.get(key) is not None for level in levels)]
    body = [[_number(key, level.get(key)) for key in keys] for level in levels]
    formula = f'<p class="soft">exact solution {escape(str(section["exact"]))}</p>' if section.get("exact") else ""
    return f"<h2>Convergence</h2>{formula}{_table([TITLES[key] for key in keys], body)}"


def _with_rates(section: Report) -> list[dict[str, Any]]:
    rates = section.get("rates", {})
    columns = {f"rate_{norm}": [None, *rates[norm]] for norm in rates}
    return [
        {**level, **{name: values[i] for name, values in columns.items()}} for i, level in enumerate(section["levels"])
    ]


def _number(key: str, value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.2f}" if key.startswith("rate") else f"{value:.3e}" if key != "h" else f"{value:.4g}"


def _advice(report: Report) -> str:
    """Where the map is not certified: the places, and what to try."""
    lines = in_words(report)
    return f"<h2>Not certified: where, and what to try</h2>{_items(lines)}" if lines else ""


def _items(texts: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"


def _notices(report: Report) -> str:
    notices = [*report["input"].get("notices", []), *reports.solved(report).get("notices", [])]
    notices += [f"{name} could not be drawn: {why}" for name, why in report.get("not_drawn", {}).items()]
    if not notices:
        return ""
    return f"<h2>Notices</h2>{_items(notices)}"


def _figures(report: Report, folder: Path) -> Iterable[str]:
    """The figures of the sections this report has."""
    for figure in figures_of(report):
        path = folder / figure.file
        if path.is_file():
            data = base64.b64encode(path.read_bytes()).decode("ascii")
            image = f'<img src="data:image/png;base64,{data}" alt="{figure.title}">'
            yield f"<h2>{figure.title}</h2><figure>{image}</figure>"


def _command(report: Report) -> str:
    return f"<h2>The command that repeats this</h2><pre>{escape(report['command'])}</pre>"


def _details(report: Report) -> str:
    """What was given, how long each step took, which versions did it."""
    given = {name: value for name, value in report["input"].items() if name in ("file", "sha256", "vertices", "faces")}
    given |= {name: report[name] for name in ("seed", "device") if name in report}
    if "config" in report:
        given["preset"] = report["config"]["name"]
    seconds = {name: f"{value:.2f}" for name, value in report["seconds"].items()}
    tables = {"Input": given, "Seconds": seconds, "Versions": report["versions"]}
    blocks = (
        f"<div><h2>{title}</h2>{_table((), [list(map(str, row)) for row in rows.items()], 'named')}</div>"
        for title, rows in tables.items()
    )
    return f'<div class="columns">{"".join(blocks)}</div>'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], kind: str = "") -> str:
    first = f"<tr>{''.join(f'<th>{escape(text)}</th>' for text in head)}</tr>" if head else ""
    body = "".join(f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in row)}</tr>" for row in rows)
    return f'<div class="wide"><table class="{kind}">{first}{body}</table></div>'
