"""Finds the verdict on a volume for `check`, the report and the terminal."""

import logging
from pathlib import Path
from typing import Any

from parameterize.arrays import in_brackets
from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.compilation import compilation_told
from parameterize.files import digest
from parameterize.quality.quality import proved
from parameterize.spline.body import BodyLike, as_body

from ..options import MapOptions
from ..report import advice
from ..report import document as reports
from .output_folder import RunFolder

log = logging.getLogger(__name__)


def certified_facts(volume: BodyLike) -> dict[str, Any]:
    """Certify a body and return the section `parameterization` of report.json."""
    body = as_body(volume)
    with compilation_told():
        certificate = certify(body)
        facts = proved(body, certificate, check_boundary(body))
    return advice.with_unproved(facts, body, certificate)


def write_certificate(
    state: RunFolder, path: Path, body: BodyLike, command: str, identity: dict[str, Any] | None = None
) -> None:
    """Certify a saved body, and write the sections of report.json about the input and the proof.

    identity: of a run that others may resume.
    """
    with state.timed("certify"):
        facts = facts_of_file(path, body)
    state.write(
        command=command,
        **({} if identity is None else {"identity": identity}),
        input={"file": str(path), "sha256": digest(path), **_of_part(path)},
        versions=reports.versions(),
        parameterization=facts,
    )
    tell(state)


def _of_part(path: Path) -> dict[str, Any]:
    """Return the unit of the part that a saved volume was made of, and the part's file, where its run is at hand."""
    report = reports.read(path.parent) if path.name == "volume.npz" else None
    known = (report or {}).get("input", {})
    found = {"unit": known.get("unit"), "part": known.get("part") or known.get("file")}
    return {name: value for name, value in found.items() if value}


def facts_of_file(path: Path, body: BodyLike) -> dict[str, Any]:
    """Certify a saved body; return the section `parameterization`, with how far it is from the surface of its run."""
    facts = certified_facts(body)
    return facts | _measured_beside(path, facts)


def _measured_beside(path: Path, facts: dict[str, Any]) -> dict[str, Any]:
    """Return how far a saved volume is from its surface, by the report of the run in its folder; else nothing."""
    report = reports.read(path.parent) if path.name == "volume.npz" else None
    known = (report or {}).get("parameterization", {})
    if any(known.get(name) != reports.plain(facts[name]) for name in ("control_points", "det_lower_bound")):
        return {}  # not the volume of that report
    return {name: known[name] for name in ("surface_distance", "volume", "not_the_part") if name in known}


def stays_unsolved(state: RunFolder, anyway: bool) -> bool:
    """Return whether nothing is solved on the map of a report; then the log and the report say why.

    anyway: whether the user asks for the solve on any map.
    """
    reason = reports.why_not_solved(state.report)
    if anyway or not reason:
        return False
    state.write(not_solved=f"{reason}; --solve-anyway --force solves on it all the same")
    log.warning("nothing is solved: %s", state.report["not_solved"])
    return True


def tell(state: RunFolder, mapping: MapOptions | None = None) -> None:
    """Log the verdict of the report; where the map is not certified, add the remedies to the report.

    mapping: the options of the map, where they are known.
    """
    quality = state.report["parameterization"]
    if far := reports.not_the_part(state.report):
        log.warning("the map is NOT THE PART: %s", far)
    log.info("certificate: %s", quality["bijective"])
    if meeting := quality["boundary_meeting"]:  # not one-to-one, although perhaps nowhere folded
        place = in_brackets(meeting["point"])
        log.warning("the volume overlaps itself: its boundary passes through %s twice", place)
    if remedies := advice.what_to_try(state.report, mapping):
        state.write(advice=remedies)
