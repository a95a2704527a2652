"""The shells of a body: the connected parts of its outer boundary, around the body or around a void inside of it.

A boundary that meets itself nowhere may still enclose a place twice: one body may lie inside another one, and a body
may wind twice around a line between two shells that both face outward (docs/certificate.md). Where the map of a body in
one part is one-to-one, exactly one shell faces outward.
"""

from collections.abc import Sequence

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..spline.body import Body, shared_numbers
from ..spline.interface import axis_side, face_layer
from ..spline.orientation import exact_rules, face_flux, orientation
from ..spline.volume import BSplineVolume
from ..surface.geometry import connected

_ROUNDING = 1e-9  # of the sum of their magnitudes: more than the integrals over faces can be off

BoundaryFace = tuple[int, int, int]  # the number of a patch, and the constant axis and the side of its face


def overlap(body: Body) -> bool | None:
    """Return whether the shells of a boundary that does not meet itself enclose a place twice; None where not known.

    body: near the origin; its patches have a det J of one sign and lie on opposite sides of their interfaces.
    """
    parts, shells = _parts(body), _shells(body)
    part_of_shell = np.array([parts[faces[0][0]] for faces in shells])
    outward = _outward(body, shells, np.bincount(part_of_shell)[part_of_shell] == 1)
    if outward is None:
        return None
    if np.any(np.bincount(part_of_shell[outward], minlength=parts.max() + 1) != 1):
        return True
    return any(_lies_in_another_part(body, parts, shells[i][0]) for i in np.flatnonzero(outward))


def _parts(body: Body) -> IntArray:
    """Return for each patch the number of the part that it belongs to: patches joined through interfaces."""
    return _groups(len(body), [(one.first[0], one.second[0]) for one in body.interfaces])


def _shells(body: Body) -> list[list[BoundaryFace]]:
    """Return the shells, each a list of its faces. Faces with a common edge are in one shell."""
    numbers, count = shared_numbers([(3, 3, 3)] * len(body), body.interfaces)  # a number for the middle of each edge
    faces = body.outer_faces
    pairs = [
        (i, len(faces) + edge) for i, (k, name) in enumerate(faces) for edge in face_layer(numbers[k], name).flat[1::2]
    ]
    groups = _groups(len(faces) + count, pairs)[: len(faces)]
    found = [(k, *axis_side(name)) for k, name in faces]
    return [[found[i] for i in np.flatnonzero(groups == group)] for group in np.unique(groups)]


def _groups(count: int, pairs: Sequence[tuple[int, int]]) -> IntArray:
    """Return the number (count,) of the connected group of each node of a graph, 0 to the number of groups - 1."""
    return connected(np.array(pairs, dtype=np.int64).reshape(-1, 2), count)


def _outward(body: Body, shells: Sequence[Sequence[BoundaryFace]], alone: Mask) -> Mask | None:
    """Return the mask of the shells that face outward; None where rounding hides it.

    alone: whether a shell is the only one of its part, which can but face outward.
    """
    outward = alone.copy()
    signs = [] if alone.all() else [orientation(patch) for patch in body]
    for i, faces in enumerate(shells):
        if alone[i]:
            continue
        terms = [signs[face[0]] * _flux(body, face) for face in faces]
        if abs(sum(terms)) <= _ROUNDING * sum(map(abs, terms)):
            return None
        outward[i] = sum(terms) > 0.0
    return outward


def _flux(body: Body, face: BoundaryFace) -> float:
    """Return the part of the volume that a face contributes where its patch is right-handed."""
    k, axis, side = face
    return face_flux(body.patches[k], exact_rules(body.patches[k]), axis, side, np.zeros(3))


def _lies_in_another_part(body: Body, parts: IntArray, face: BoundaryFace) -> bool:
    """Return whether a corner of a face is a point of another part."""
    k, axis, side = face
    corner = body.patches[k].face(axis, side)[0, 0]
    others = (patch for patch, part in zip(body, parts, strict=True) if part != parts[k])
    return any(_in_box(corner, patch) and bool(np.all(np.isfinite(patch.locate(corner)))) for patch in others)


def _in_box(point: Array, patch: BSplineVolume) -> bool:
    """Return whether a point (3,) lies in the box of a patch's control points."""
    net = patch.control_points
    return bool(np.all((point >= net.min(axis=(0, 1, 2))) & (point <= net.max(axis=(0, 1, 2)))))
