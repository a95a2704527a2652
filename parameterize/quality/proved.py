"""States what is proved of a volume, or of a body of several patches, for the section `parameterization`."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

from ..certificate.body import Certificate
from ..certificate.boundary import BoundaryCheck
from ..certificate.jacobian import PatchCertificate
from ..spline.body import Body, shared_numbers
from ..spline.interface import face_layer
from ..spline.volume import BSplineVolume

CELLS = (3, 3, 3)  # of a cube: its corners, the middles of its edges and faces, and its own


def proved(body: Body, certificate: Certificate, check: BoundaryCheck) -> dict[str, Any]:
    """Return the entries of a body that was certified: of several patches those of each under `patches`, too."""
    if body.is_single:
        return _of_patch(body.only, certificate.only, check.as_dict())
    return {
        "control_points": body.numbering[1],
        "bijective": certificate.verdict,
        **check.as_dict(),
        **({"overlap": True} if check.overlap else {}),
        "det_lower_bound": _finite(certificate.lower_bound),
        "outer_faces": sum(map(len, body.outer)),
        "euler_number": euler_number(body),
        "interfaces": [str(interface) for interface in body.interfaces],
        **({"misglued": [str(interface) for interface in certificate.misglued]} if certificate.misglued else {}),
        "patches": [_of_patch(patch, own, {}) for patch, own in zip(body, certificate.patches, strict=True)],
    }


def _of_patch(patch: BSplineVolume, certificate: PatchCertificate, checked: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of a patch. checked: those of its boundary check, none for one patch of several."""
    return {
        "control_points": list(patch.shape),
        "degrees": list(patch.degrees),
        "bijective": certificate.verdict,
        "orientation": certificate.orientation,
        **checked,
        "det_lower_bound": _finite(certificate.lower_bound),
        "witness": None if certificate.witness is None else list(certificate.witness),
    }


def _finite(bound: float) -> float | None:
    return bound if isfinite(bound) else None


def euler_number(body: Body) -> int:
    """Return corners minus edges plus faces of the outer boundary: 2 for a ball, 0 for a ring, -2 for two handles."""
    labels, _ = shared_numbers([CELLS] * len(body), body.interfaces)
    layers = [face_layer(label, name) for label, names in zip(labels, body.outer, strict=True) for name in names]
    corners = {int(label) for layer in layers for label in layer[::2, ::2].ravel()}
    edges = {int(label) for layer in layers for label in (*layer[1, ::2], *layer[::2, 1])}
    return len(corners) - len(edges) + len(layers)
