"""Writes report.html: the content of report.json, the figures and a view, in one file without external files.

The template page.html lays out the page and escapes its content; this module chooses the content.
"""

import base64
import logging
from html import escape
from itertools import chain
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from parameterize.arrays import listed
from parameterize.files import save_text
from parameterize.old_names import ORIGINS

from ..errors import one_line
from ..level_table import TITLES, as_rows, capitalized
from ..rounding import EXACT, distance, distortion, rounded
from . import asked, balance, extremes
from . import document as reports
from .advice import in_words
from .artifacts import PAGE, REGIONS, SOLVED, figures_of
from .document import Report
from .sheet import sheet_of
from .statement import regions_of, statement_of

log = logging.getLogger(__name__)

ERRORS = (  # keys of a level: the absolute error, and the relative one that stands before it
    ("l2", "l2_relative"),
    ("h1_seminorm", "h1_relative"),
    ("error_estimate", "error_estimate_relative"),
)

MEANINGS = {
    "certified": "{claim} is proved on {whole}, rounding errors included.",
    "folded": "The map folds: det J has the wrong sign somewhere. Do not trust a solution on it.",
    "undecided": "Neither {claim} on {whole} nor a fold could be proved.",
}


def write(folder: Path, report: Report, scene: dict[str, Any] | None) -> None:
    """Write report.html atomically from a finished report and the figures in its folder.

    scene: the interactive view, None where it could not be drawn. Where the page cannot be laid out, a simple page with
    the text of report.json is written.
    """
    try:
        text = page(report, scene, folder)
    except Exception as error:
        log.warning("report.html shows report.json only, the page could not be laid out: %s", one_line(error))
        text = _bare(report, one_line(error))
    save_text(folder / PAGE, text)


def _bare(report: Report, reason: str) -> str:
    whole = escape(reports.as_json(report))
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>iga-nn</title>'
        f"<p>This page could not be laid out ({escape(reason)}); this is report.json:</p><pre>{whole}</pre></html>"
    )


def page(report: Report, scene: dict[str, Any] | None, folder: Path) -> str:
    """Return the page as text."""
    section = reports.solved(report)
    drawn = _drawn(report, folder)
    what = next((title for name, title in SOLVED.items() if name in report), "spline volume")
    return filled(
        "report/page.html",
        title=f"{name_of(report)}: {what}",
        report=report,
        verdicts=verdicts(report),
        sheet=sheet_of(report),
        files=[file for file, _, _ in drawn],
        asked=asked.facts(report),
        facts=_facts(report),
        scene=scene,
        advice=in_words(report),
        statement=statement_of(report),
        regions=regions_of(report),
        levels=_levels(section),
        extremes=extremes.table(section),
        patches=_patches(report["parameterization"]),
        patches_heading=reports.patches_heading(report["parameterization"]),
        notices=notices(report),
        figures=[one for one in drawn if one[0] != REGIONS],
        where=[one for one in drawn if one[0] == REGIONS],
        balance=balance.table(section),
        balance_heading=balance.heading(section),
        details=_details(report),
    )


def name_of(report: Report) -> str:
    """Return the name of the part, or of the volume's file where the part is not known."""
    return Path(report["input"].get("part") or report["input"]["file"]).name


def filled(template: str, **content: Any) -> str:
    """Return a template of this package filled with the content, which is escaped."""
    loader = PackageLoader("iga_nn", "")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters["rounded"] = rounded
    return environment.get_template(template).render(content)


def verdicts(report: Report) -> list[tuple[str, str, str]]:
    """Return the verdicts that decide whether the result can be used: colour, heading and meaning of each."""
    quality, answer = report["parameterization"], reports.one_to_one(report)
    claim = reports.claim(report)
    whole = "every patch" if "patches" in quality else "the whole cube"
    meaning = MEANINGS[quality["bijective"]].format(claim=claim, whole=whole)
    if misglued := quality.get("misglued"):
        meaning += f" Two patches lie on the same side of {listed(misglued)}."
    if quality.get("overlap"):
        meaning += " Parts of the body overlap."
    if quality.get("orientation") == "left-handed":
        meaning += " The parameters u, v, w are a left-handed system, which changes no result."
    if meeting := quality.get("boundary_meeting"):
        meaning += f" Two parts of the boundary meet at x, y, z = {_point(meeting['point'])}."
    elif answer == "yes":
        meaning += " Its faces do not meet themselves either: the map is one-to-one."
    if flat := quality.get("unproved", {}).get("flat"):
        meaning += f" det J is zero, up to rounding, at x, y, z = {_point(flat)}."
    if quality.get("witness"):
        meaning += f" The worst place is u, v, w = {_point(quality['witness'])}."
    color = "good" if reports.is_certified(report) else "bad" if answer == "no" else "unsure"
    found = [(color, f"{claim}: {quality['bijective']}; one-to-one: {answer}", meaning)]
    if far := reports.not_the_part(report):
        found.insert(0, ("bad", "This is not the part", f"{far[0].upper()}{far[1:]}. What follows holds for the map."))
    if "not_solved" in report:
        what = "A level was not solved" if reports.solved(report) else "The problem was not solved"
        found.append(("bad", what, report["not_solved"]))
    if "incomplete" in report:
        found.append(("unsure", "The run was cut short", f"{report['incomplete']}; --resume goes on."))
    if not reports.is_meaningful(report):
        found.append(("bad", "The errors mean nothing", "The notices below say why."))
    if not reports.is_converged(report):
        found.append(("bad", "A solve did not converge", "The last iterate is shown."))
    return found


def _point(coordinates: list[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in coordinates)


def _facts(report: Report) -> list[tuple[str, str, str]]:
    """Return the most important numbers: the name of each, the number and a remark."""
    quality = report["parameterization"]
    facts = []
    if "arap" in quality:
        arap = quality["arap"]["unit_volume"]
        measured = "each block in its own box" if "patches" in quality else "at volume 1"
        mean, most = distortion(arap["mean"]), distortion(arap["max"])
        remark = measured if most == EXACT else f"largest {most}; {measured}"
        facts.append(("ARAP distortion, mean", "none" if most == EXACT else mean, remark))
    if apart := reports.surface_distance(report):
        rms, most = distance(apart["rms"]), distance(apart["max"])
        remark = "surface to spline and back"
        if most != EXACT:
            remark = f"rms over the box's diagonal, {remark}; largest {most}"
        facts.append(("Distance to the surface", rms, remark))
    if volume := reports.volume_in_words(report):
        number, beside = volume
        facts.append(("Volume", number, beside))
    facts += [
        (f"Volume of {solid['name']}", reports.cubic(solid["volume"], report), reports.patches_of_solid(solid))
        for solid in quality.get("solids", ())
    ]
    if levels := reports.solved(report).get("levels"):
        finest = levels[-1]
        facts += [_error_fact(finest, *keys) for keys in ERRORS if finest.get(keys[0]) is not None]
        facts.append(("Unknowns", f"{finest['dofs']:,}", f"{finest['iterations']} iterations"))
    if vibration := report.get("modes"):
        facts += [(f"Mode {i}", f"{f:.4g}", "frequency") for i, f in enumerate(vibration["frequencies"], start=1)]
    facts += _sizes(quality)
    if "origin" in quality:
        facts.append(("The map comes from", *_source(quality["origin"])))
    if refinement := quality.get("refinement"):
        facts.append(("Control points chosen", refinement["stopped"], reports.control_points_in_words(report)))
    return facts


def _source(origin: str) -> tuple[str, str]:
    """Return the source of a map, and how it is made, in words, for its origin in report.json."""
    from parameterize.ways.strategy import WAYS

    words = {way.origin: way.comes_from for way in WAYS}
    return words.get(ORIGINS.get(origin, origin), (origin, ""))


def _sizes(quality: Report) -> list[tuple[str, str, str]]:
    """Return the numbers of patches and of control points."""
    points = reports.size_in_words(quality)
    if "patches" not in quality:
        return [("Control points", points, "degrees " + ", ".join(map(str, quality["degrees"])))]
    found = reports.summarized(quality)["summary"]
    glued = f"{found['interfaces']:,} interfaces, {quality['outer_faces']:,} outer faces"
    said = f"shared ones once; degrees {', '.join(map(str, found['degrees']))}"
    return [("Patches", f"{found['patches']:,}", glued), ("Control points", points, said)]


def _error_fact(level: Report, absolute: str, relative: str) -> tuple[str, str, str]:
    """Return the relative error with the absolute error as the remark; for a zero solution the absolute error alone."""
    if level.get(relative) is None:
        return capitalized(TITLES[absolute]), f"{level[absolute]:.3e}", "on the finest mesh"
    return capitalized(TITLES[relative]), f"{level[relative]:.3e}", f"absolute {level[absolute]:.3e}"


def _levels(section: Report) -> list[list[str]]:
    """Return the table of levels: the titles of the known numbers, then a row a level."""
    levels = section.get("levels", [])
    rates = {f"rate_{norm}": [None, *values] for norm, values in section.get("rates", {}).items()}
    rows = as_rows([level | {name: values[i] for name, values in rates.items()} for i, level in enumerate(levels)])
    if rows and (unit := section.get("unit")):
        rows[0] = [f"h [{unit}]" if title == TITLES["h"] else title for title in rows[0]]
    return rows


def _patches(quality: Report) -> list[list[str]]:
    """Return the table of several patches: the titles of what is known, then a row a patch; no row for a volume.

    Of many patches the worst are shown.
    """
    rows = [{"patch": name, **_patch(patch)} for name, patch in reports.shown_patches(quality)]
    return [list(rows[0]), *(list(row.values()) for row in rows)] if rows else []


def _patch(patch: Report) -> dict[str, str]:
    """Return what is proved of a patch and, where it was measured against its own box, how much it distorts this."""
    bound = patch["det_lower_bound"]
    proof = "–" if patch["bijective"] != "certified" or bound is None else f"≥ {bound:.3g} of its mean"
    found = {"control points": reports.size_in_words(patch), "det J": patch["bijective"], "|det J|": proof}
    if "own_box" not in patch:
        return found
    return found | {
        "own box": " × ".join(f"{side:.3g}" for side in patch["own_box"]),
        "ARAP, mean": distortion(patch["arap"]["mean"], 3),
        "largest": distortion(patch["arap"]["max"], 3),
        "least scaled det J": f"{patch['scaled_jacobian']:.3g}",
    }


def notices(report: Report) -> list[str]:
    """Return the notices of the surface and of the solves, and the missing figures with the reasons."""
    missing: dict[str, list[str]] = {}
    for name, reason in report.get("not_drawn", {}).items():
        missing.setdefault(reason, []).append(name)
    undrawn = [f"{', '.join(names)} could not be drawn: {reason}" for reason, names in missing.items()]
    found = (
        section.get("notices", []) for section in (report["input"], reports.solved(report), report.get("modes", {}))
    )
    return [*chain.from_iterable(found), *undrawn]


def figures(report: Report, folder: Path) -> list[tuple[str, str]]:
    """Return the headings and the pictures, in Base64, of the figures of this report whose files exist."""
    return [(heading, image) for _, heading, image in _drawn(report, folder)]


def _drawn(report: Report, folder: Path) -> list[tuple[str, str, str]]:
    """Return the file names, the headings and the pictures, in Base64, of this report's figures that exist."""
    there = [figure for figure in figures_of(report) if (folder / figure.file).is_file()]
    return [
        (each.file, capitalized(each.shows), base64.b64encode((folder / each.file).read_bytes()).decode("ascii"))
        for each in there
    ]


def _details(report: Report) -> dict[str, dict[str, Any]]:
    """Return the input, the seconds of each step, and the versions of the packages."""
    given = {name: value for name, value in report["input"].items() if name in ("file", "sha256", "vertices", "faces")}
    given |= {name: report[name] for name in ("seed", "device") if name in report}
    if "config" in report:
        given["preset"] = report["config"]["name"]
    seconds = {name: rounded(value, 2) for name, value in report["seconds"].items()}
    return {"Input": given, "Seconds": seconds, "Versions": report["versions"]}
