"""Adds the places without a proof to the section `parameterization` of report.json, of a volume or several patches."""

from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.certificate.body import BodyCertificate
from parameterize.certificate.jacobian import Certificate
from parameterize.spline.multipatch import MultiPatch
from parameterize.spline.volume import BSplineVolume

from .advice import span_places, unproved
from .document import Report


def with_unproved(
    section: Report, body: BSplineVolume | MultiPatch, certificate: Certificate | BodyCertificate
) -> Report:
    """Return a section with the places without a proof: of a volume, or of each patch under `patches` and in all."""
    if isinstance(certificate, Certificate):
        assert isinstance(body, BSplineVolume)
        return section | unproved(body, certificate)
    assert isinstance(body, MultiPatch)
    parts = zip(section["patches"], body, certificate.patches, strict=True)
    each = [known | unproved(patch, own) for known, patch, own in parts]
    return section | {"patches": each} | _in_all(each)


def _in_all(each: list[Report]) -> dict[str, Any]:
    """Return the number of spans without a proof on all patches, and a place of each patch that has some."""
    found = [own["unproved"] for own in each if "unproved" in own]
    if not found:
        return {}
    return {"unproved": {"spans": sum(own["spans"] for own in found), "places": [own["places"][0] for own in found]}}


def unproved_places(body: BSplineVolume | MultiPatch, certificate: Certificate | BodyCertificate) -> Array:
    """Return the images (k, 3) of the midpoints of all spans without a proof, in the body's units."""
    if isinstance(certificate, Certificate):
        assert isinstance(body, BSplineVolume)
        return span_places(body, certificate.unproved)
    assert isinstance(body, MultiPatch)
    parts = zip(body, certificate.patches, strict=True)
    return np.concatenate([span_places(patch, own.unproved) for patch, own in parts])
