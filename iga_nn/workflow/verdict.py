"""Finds the verdict on a volume for `check`, the report and the terminal."""

import hashlib
import logging
from pathlib import Path
from typing import Any

from parameterize.arrays import in_brackets
from parameterize.certificate.body import certify
from parameterize.certificate.boundary import check_boundary
from parameterize.compilation import compilation_told
from parameterize.quality.proved import proved, proved_of
from parameterize.spline.multipatch import MultiPatch
from parameterize.spline.volume import BSplineVolume

from ..options import MapOptions
from ..report import advice
from ..report import document as reports
from ..report.patches import with_unproved
from .output_folder import RunFolder

log = logging.getLogger(__name__)


def certified_facts(body: BSplineVolume | MultiPatch) -> dict[str, Any]:
    """Certify a body and return the section `parameterization` of report.json."""
    with compilation_told():
        if isinstance(body, MultiPatch):
            whole = certify(body)
            return with_unproved(proved_of(body, whole, check_boundary(body)), body, whole)
        certificate = certify(body)
        facts = proved(body.shape, body.degrees, certificate, check_boundary(body))
    return with_unproved(facts, body, certificate)


def write_certificate(state: RunFolder, path: Path, body: BSplineVolume | MultiPatch, command: str) -> None:
    """Certify a saved body, and write the sections of report.json about the input and the proof."""
    with state.timed("certify"):
        facts = certified_facts(body)
    state.write(
        command=command,
        input={"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()},
        versions=reports.versions(),
        parameterization=facts,
    )
    tell(state)


def tell(state: RunFolder, mapping: MapOptions | None = None) -> None:
    """Log the verdict of the report; where the map is not certified, add the remedies to the report.

    mapping: the options of the map, where they are known.
    """
    quality = state.report["parameterization"]
    log.info("certificate: %s", quality["bijective"])
    if meeting := quality["boundary_meeting"]:  # not one-to-one, although perhaps nowhere folded
        place = in_brackets(meeting["point"])
        log.warning("the volume overlaps itself: its boundary passes through %s twice", place)
    if remedies := advice.what_to_try(state.report, mapping):
        state.write(advice=remedies)
