"""Words the answer of a finished command, and chooses its exit code."""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from ..level_table import ESTIMATES, EXACT_ERRORS, TITLES
from ..report import advice, asked, balance, extremes
from ..report import document as reports
from ..report.artifacts import PAGE
from ..rounding import EXACT, distance, distortion, rounded
from ..workflow.output_folder import Outcome
from . import BAD_INPUT, DONE, NOT_CERTIFIED, NOT_SOLVED, NOT_THE_PART
from .facts import facts_in_words

if TYPE_CHECKING:
    from ..batch.table import Batch

CODES = {  # of a state
    "certified": DONE,
    "not the part": NOT_THE_PART,
    "not certified": NOT_CERTIFIED,
    "not solved": NOT_SOLVED,
}
SHOWN_ERRORS = (*EXACT_ERRORS, *ESTIMATES)


def exit_code(report: reports.Report) -> int:
    """Return the exit code of a finished report."""
    return CODES[reports.state(report)]


def batch_exit_code(batch: Batch) -> int:
    """Return the exit code of a batch: that of its worst surface."""
    codes = {CODES.get(state, BAD_INPUT) for state in batch.counts}
    return min(codes - {DONE}, default=DONE)


def verdict_in_words(outcome: Outcome) -> str:
    """Return a finished run as text for the terminal.

    The text has the numbers and the advice, and last the verdict, the error and the page to open.
    """
    verdict = reports.verdict(outcome.report, outcome.folder)
    far, unsolved = reports.not_the_part(outcome.report), outcome.report.get("not_solved")
    found = asked.lines(outcome.report)
    lines = [f"{first:16s} {line}" for first, line in zip_longest(["asked"][: len(found)], found, fillvalue="")]
    if refined := reports.solved(outcome.report).get("refinement"):
        lines.append(f"accuracy         {reports.accuracy_in_words(refined)}")
    lines += [f"NOT THE PART     {far}"] if far else []
    lines += [f"NOT SOLVED       {unsolved}"] if unsolved else []
    if cut := outcome.report.get("incomplete"):
        lines.append(f"CUT SHORT        {cut}; --resume goes on")
    measured = verdict.get("arap", {})
    if "patches" in outcome.report["parameterization"]:  # each against its own box: the unit changes nothing
        measured = {"own boxes": measured["as_given"]} if measured else {}
    for scale, arap in measured.items():
        mean, most = distortion(arap["mean"]), distortion(arap["max"])
        said = "exact: no distortion" if most == EXACT else f"ARAP {mean} mean, {most} max"
        lines.append(f"{scale:16s} {said}")
    if apart := verdict.get("surface_distance"):
        rms, most = distance(apart["rms"]), distance(apart["max"])
        said = "exact" if most == EXACT else f"rms {rms}, largest {most} of the box's diagonal"
        lines.append(f"distance         {said}; surface to spline and back")
    if volume := reports.volume_in_words(outcome.report):
        lines.append(f"volume           {', '.join(volume)}")
    if chosen := reports.control_points_in_words(outcome.report):
        lines.append(f"control points   {chosen}")
    levels = [_level(level) for level in verdict.get("levels", [])]
    section = reports.solved(outcome.report)
    for title, found in (("extremes", extremes.lines(section)), ("balance", balance.lines(section))):
        lines += [f"{first:16s} {line}" for first, line in zip_longest([title][: len(found)], found, fillvalue="")]
    lines += [*levels[:-1], f"{rounded(verdict['seconds'], 1)} s", *advice.in_words(outcome.report)]
    proved = f"{reports.claim(outcome.report)} {verdict['bijective']}; one-to-one: {verdict['one_to_one']}"
    proved = f"NOT THE PART; {proved}" if far else proved
    errors = any(level.get(key) is not None for level in verdict.get("levels", [])[-1:] for key in SHOWN_ERRORS)
    last = "error" if errors else "solved"  # of several blocks without an exact solution no error is known
    ending = {"verdict": proved, last: "".join(levels[-1:]), "open": str(outcome.folder / PAGE)}
    return "\n".join([*lines, *(f"{name:16s} {text}" for name, text in ending.items() if text)])


def _level(level: dict[str, Any]) -> str:
    """Return the errors of one mesh, its number of unknowns, and whether the numbers are to be trusted, as text."""
    errors = [f"{TITLES[key]} {level[key]:.3e}, " for key in SHOWN_ERRORS if level.get(key) is not None]
    end = ("" if level["converged"] else ", NOT CONVERGED") + ("" if level["meaningful"] else ", MEANINGLESS")
    return f"{''.join(errors)}{level['dofs']:,} unknowns, {level['iterations']} iterations{end}"


def volume_in_words(facts: reports.Report) -> str:
    """Return the facts of `check` about a volume as text, the verdicts first; of many patches the worst."""
    known = ("bijective", "boundary_injective", "patches", "solids", "not_the_part", "surface_distance", "volume")
    others = {key: value for key, value in facts.items() if key not in known}
    report = {"parameterization": facts}
    proved = {"NOT THE PART": far} if (far := reports.not_the_part(report)) else {}
    proved |= {reports.claim(report): facts["bijective"], "one-to-one": reports.one_to_one(report)}
    parts = [f"{f'{name}:':16s} {_patch(part)}" for name, part in reports.shown_patches(facts)]
    solids = [f"{'solid:':16s} {_solid(solid)}" for solid in facts.get("solids", ())]
    heading = [] if len(parts) == len(facts.get("patches", ())) else [reports.patches_heading(facts)]
    verdicts = (f"{name:16s} {text}" for name, text in proved.items())
    return "\n".join([*verdicts, facts_in_words(others), *solids, *heading, *parts])


def _solid(solid: reports.Report) -> str:
    """Return the facts of one solid of several as text."""
    return f"{solid['name']}, volume {solid['volume']:.6g}, {reports.patches_of_solid(solid)}"


def _patch(part: reports.Report) -> str:
    """Return the facts of one patch of several as text."""
    size, degrees = reports.size_in_words(part), ", ".join(map(str, part["degrees"]))
    hand = "" if part["orientation"] == "right-handed" else f", {part['orientation']}"
    return f"{part['bijective']}, {size} control points, degrees {degrees}{hand}"
