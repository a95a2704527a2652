"""States what is known of a body of several patches, for the section `parameterization` of report.json."""

from typing import Any

import numpy as np

from parameterize.certificate.body import BodyCertificate
from parameterize.certificate.boundary import BoundaryCheck
from parameterize.quality.quality import proved
from parameterize.spline.interface import face_layer
from parameterize.spline.multipatch import MultiPatch, shared_numbers

from .advice import unproved
from .document import Report

CELLS = (3, 3, 3)  # of a cube: its corners, the middles of its edges and faces, and its own


def proved_of(body: MultiPatch, certificate: BodyCertificate, check: BoundaryCheck) -> Report:
    """Return the entries of a body that was certified: those of the whole, and of each patch under `patches`."""
    each = [
        proved(patch.shape, patch.degrees, own) | unproved(patch, own)
        for patch, own in zip(body, certificate.patches, strict=True)
    ]
    bound = certificate.lower_bound
    return {
        "control_points": shared_numbers([patch.shape for patch in body], body.interfaces)[1],
        "bijective": certificate.verdict,
        **check.as_dict(),
        **({"overlap": True} if check.overlap else {}),
        "det_lower_bound": bound if np.isfinite(bound) else None,
        "outer_faces": sum(map(len, body.outer)),
        "euler_number": euler_number(body),
        "interfaces": [str(interface) for interface in body.interfaces],
        **({"misglued": [str(interface) for interface in certificate.misglued]} if certificate.misglued else {}),
        "patches": each,
    } | _unproved(each)


def _unproved(each: list[Report]) -> dict[str, Any]:
    """Return the number of spans without a proof on all patches, and a place of each patch that has some."""
    found = [own["unproved"] for own in each if "unproved" in own]
    if not found:
        return {}
    return {"unproved": {"spans": sum(own["spans"] for own in found), "places": [own["places"][0] for own in found]}}


def euler_number(body: MultiPatch) -> int:
    """Return corners minus edges plus faces of the outer boundary: 2 for a ball, 0 for a ring, -2 for two handles."""
    labels, _ = shared_numbers([CELLS] * len(body), body.interfaces)
    layers = [face_layer(label, name) for label, names in zip(labels, body.outer, strict=True) for name in names]
    corners = {int(label) for layer in layers for label in layer[::2, ::2].ravel()}
    edges = {int(label) for layer in layers for label in (*layer[1, ::2], *layer[::2, 1])}
    return len(corners) - len(edges) + len(layers)
