"""The shells of a body: the connected parts of its outer boundary, around the body or around a void inside of it.

A boundary that meets itself nowhere may still enclose a place twice: one body may lie inside another one, and a body
may wind twice around a line between two shells that both face outward (docs/certificate.md). Where the map of a body in
one part is one-to-one, exactly one shell faces outward.
"""

from collections.abc import Sequence

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..spline.body import Body, numbers_of_classes, shared_numbers
from ..spline.interface import axis_side, face_layer
from ..spline.orientation import FACES, exact_rules, face_flux, orientations
from ..spline.volume import FACE_NAMES

_ROUNDING = 1e-9  # of the sum of their magnitudes: more than the integrals over faces can be off
_EDGES = np.array([face_layer(np.arange(27).reshape(3, 3, 3), name).ravel()[1::2] for name in FACE_NAMES])  # middles


def overlap(body: Body) -> bool | None:
    """Return whether the shells of a boundary that does not meet itself enclose a place twice; None where not known.

    body: near the origin; its patches have a det J of one sign and lie on opposite sides of their interfaces.
    """
    parts, shells = _parts(body), _shells(body)
    part_of_shell = np.array([parts[faces[0] // len(FACE_NAMES)] for faces in shells])
    outward = _outward(body, shells, np.bincount(part_of_shell)[part_of_shell] == 1)
    if outward is None:
        return None
    if np.any(np.bincount(part_of_shell[outward], minlength=parts.max() + 1) != 1):
        return True
    return any(_lies_in_another_part(body, parts, shells[i][0]) for i in np.flatnonzero(outward).tolist())


def _parts(body: Body) -> IntArray:
    """Return for each patch the number of the part that it belongs to: patches joined through interfaces."""
    return numbers_of_classes(len(body), body.interface_rows[:, [0, 2]].T)


def _shells(body: Body) -> list[IntArray]:
    """Return the shells, each as its faces' numbers, 6 * patch + face. Faces with a common edge are in one shell."""
    labels, count = shared_numbers([(3, 3, 3)] * len(body), body.interfaces)  # a number for the middle of each edge
    outer = np.flatnonzero(~body.glued)
    patches, faces = np.divmod(outer, len(FACE_NAMES))
    edges = np.stack(labels).reshape(-1, 27)[patches[:, None], _EDGES[faces]]  # (outer faces, 4)
    links = np.stack([np.repeat(np.arange(len(outer)), 4), len(outer) + edges.ravel()])
    shells = numbers_of_classes(len(outer) + count, links)[: len(outer)]
    return [outer[shells == shell] for shell in range(shells.max() + 1)]


def _outward(body: Body, shells: Sequence[IntArray], alone: Mask) -> Mask | None:
    """Return the mask of the shells that face outward; None where rounding hides it.

    alone: whether a shell is the only one of its part, which can but face outward.
    """
    outward = alone.copy()
    fluxes = np.empty(0) if alone.all() else _fluxes(body)
    for i in np.flatnonzero(~alone).tolist():
        terms = fluxes[shells[i]]
        if abs(terms.sum()) <= _ROUNDING * np.abs(terms).sum():
            return None
        outward[i] = terms.sum() > 0.0
    return outward


def _fluxes(body: Body) -> Array:
    """Return the part of the volume that each face contributes if its patch is right-handed, six a patch."""
    fluxes = np.empty((len(body), len(FACE_NAMES)))
    for group in body.groups:
        rules, signs = exact_rules(group), orientations(group)
        for face, (axis, side) in enumerate(FACES):
            fluxes[group.numbers, face] = signs * face_flux(group, rules, axis, side, np.zeros(3))
    return fluxes.ravel()


def _lies_in_another_part(body: Body, parts: IntArray, face: int) -> bool:
    """Return whether a corner of a face is a point of another part."""
    k, number = divmod(face, len(FACE_NAMES))
    corner = body.patches[k].face(*axis_side(FACE_NAMES[number]))[0, 0]
    others = np.flatnonzero(_in_boxes(corner, body) & (parts != parts[k]))
    return any(np.isfinite(body.patches[other].locate(corner)).all() for other in others)


def _in_boxes(point: Array, body: Body) -> Mask:
    """Return whether a point (3,) lies in the box of the control points of each patch, (patches,)."""
    inside = np.empty(len(body), dtype=bool)
    for group in body.groups:
        low, high = (pick(group.control_points, axis=(1, 2, 3)) for pick in (np.min, np.max))
        inside[group.numbers] = ((point >= low) & (point <= high)).all(axis=1)
    return inside
