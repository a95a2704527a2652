"""What a report says of a volume: the certificate, the boundary, where it is not proved and what to try."""

from __future__ import annotations

import hashlib
import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any

from parameterize.arrays import in_brackets

from ..report import advice
from ..report import document as reports

if TYPE_CHECKING:
    from parameterize.spline.volume import BSplineVolume

    from ..options import MapOptions
    from .output_folder import RunFolder

log = logging.getLogger(__name__)


def certified_facts(volume: BSplineVolume) -> dict[str, Any]:
    """What the section `parameterization` of report.json says of a volume alone."""
    from parameterize.certificate.boundary import check_boundary
    from parameterize.certificate.jacobian import certify

    certificate = certify(volume)
    return {
        "control_points": list(volume.shape),
        "degrees": list(volume.degrees),
        "bijective": certificate.verdict,
        **check_boundary(volume).as_dict(),
        "det_lower_bound": certificate.lower_bound,
        "witness": certificate.witness,
        **advice.unproved(volume, certificate),
    }


def write_certificate(state: RunFolder, path: Path, volume: BSplineVolume, command: str) -> None:
    """Certify a saved volume, and write the sections of report.json that say what was given."""
    with state.timed("certify"):
        facts = certified_facts(volume)
    state.write(
        command=command,
        input={"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()},
        versions=reports.versions(),
        parameterization=facts,
    )
    tell(state)


def tell(state: RunFolder, options: MapOptions | None = None) -> None:
    """Say the verdict that the report has; where the map is not certified, write what to try.

    options: those the map was made with, where they are known.
    """
    quality = state.report["parameterization"]
    log.info("certificate: %s", quality["bijective"])
    if meeting := quality["boundary_meeting"]:  # not one-to-one, although perhaps nowhere folded
        place = in_brackets(meeting["point"])
        log.warning("the volume overlaps itself: its boundary passes twice through %s", place)
    if remedies := advice.what_to_try(state.report, options):
        state.write(advice=remedies)
