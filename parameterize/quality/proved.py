"""States what is proved of a volume, or of a body of several patches, for the section `parameterization`."""

from math import isfinite
from typing import Any

from ..certificate.body import BodyCertificate
from ..certificate.boundary import BoundaryCheck
from ..certificate.jacobian import Certificate
from ..spline.interface import face_layer
from ..spline.multipatch import MultiPatch, shared_numbers

CELLS = (3, 3, 3)  # of a cube: its corners, the middles of its edges and faces, and its own


def proved(
    shape: tuple[int, int, int],
    degrees: tuple[int, int, int],
    certificate: Certificate,
    check: BoundaryCheck | None = None,
) -> dict[str, Any]:
    """Return the section's entries for a volume that was certified.

    check: None for one patch of several, whose boundary is checked as a whole.
    """
    bound = certificate.lower_bound
    return {
        "control_points": list(shape),
        "degrees": list(degrees),
        "bijective": certificate.verdict,
        "orientation": certificate.orientation,
        **({} if check is None else check.as_dict()),
        "det_lower_bound": bound if isfinite(bound) else None,
        "witness": None if certificate.witness is None else list(certificate.witness),
    }


def proved_of(body: MultiPatch, certificate: BodyCertificate, check: BoundaryCheck) -> dict[str, Any]:
    """Return the entries of a body that was certified: those of the whole, and of each patch under `patches`."""
    bound = certificate.lower_bound
    return {
        "control_points": shared_numbers([patch.shape for patch in body], body.interfaces)[1],
        "bijective": certificate.verdict,
        **check.as_dict(),
        **({"overlap": True} if check.overlap else {}),
        "det_lower_bound": bound if isfinite(bound) else None,
        "outer_faces": sum(map(len, body.outer)),
        "euler_number": euler_number(body),
        "interfaces": [str(interface) for interface in body.interfaces],
        **({"misglued": [str(interface) for interface in certificate.misglued]} if certificate.misglued else {}),
        "patches": [
            proved(patch.shape, patch.degrees, own) for patch, own in zip(body, certificate.patches, strict=True)
        ],
    }


def euler_number(body: MultiPatch) -> int:
    """Return corners minus edges plus faces of the outer boundary: 2 for a ball, 0 for a ring, -2 for two handles."""
    labels, _ = shared_numbers([CELLS] * len(body), body.interfaces)
    layers = [face_layer(label, name) for label, names in zip(labels, body.outer, strict=True) for name in names]
    corners = {int(label) for layer in layers for label in layer[::2, ::2].ravel()}
    edges = {int(label) for layer in layers for label in (*layer[1, ::2], *layer[::2, 1])}
    return len(corners) - len(edges) + len(layers)
