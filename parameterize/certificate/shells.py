"""The shells of a body: the connected parts of its outer boundary, around the body or around a void inside of it.

A boundary that meets itself nowhere may still enclose a place twice: one body may lie inside another one, and a body
may wind twice around a line between two shells that both face outward (docs/certificate.md). Where the map of a body in
one part is one-to-one, exactly one shell faces outward.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays import Array, IntArray
from ..spline.interface import axis_side, face_layer
from ..spline.multipatch import MultiPatch, shared_numbers
from ..spline.orientation import exact_rules, face_flux, orientation

_ROUNDING = 1e-9  # of the sum of their magnitudes: more than the integrals over faces can be off


def overlap(body: MultiPatch) -> bool | None:
    """Return whether the shells of a boundary that does not meet itself enclose a place twice; None where not known.

    body: near the origin, of which each patch has a det J of one sign, on both sides of every interface.
    """
    parts, shells = _parts(body), _shells(body)
    part_of_shell = np.array([parts[faces[0][0]] for faces in shells])
    alone = np.bincount(part_of_shell, minlength=parts.max() + 1) == 1  # such a shell can but face outward
    outward = np.ones(len(shells), dtype=np.int64)
    doubtful = np.flatnonzero(~alone[part_of_shell])
    signs = [orientation(patch) for patch in body] if len(doubtful) else []
    for i in doubtful:
        value, error = _signed_volume(body, signs, shells[i])
        if abs(value) <= error:
            return None
        outward[i] = value > 0.0
    if np.any(np.bincount(part_of_shell, weights=outward, minlength=len(alone)) != 1):
        return True
    return None if _may_be_nested(body, parts) else False


def _parts(body: MultiPatch) -> IntArray:
    """Return for each patch the number of the part that it belongs to: patches joined through interfaces."""
    return _groups(len(body), [(one.first[0], one.second[0]) for one in body.interfaces])


def _shells(body: MultiPatch) -> list[list[tuple[int, int, int]]]:
    """Return the shells, each a list of its faces: patch, axis and side. Faces with a common edge are in one shell."""
    numbers, count = shared_numbers([(3, 3, 3)] * len(body), body.interfaces)  # a number for the middle of each edge
    faces = [(k, name) for k, names in enumerate(body.outer) for name in names]
    pairs = [
        (i, len(faces) + edge) for i, (k, name) in enumerate(faces) for edge in face_layer(numbers[k], name).flat[1::2]
    ]
    groups = _groups(len(faces) + count, pairs)[: len(faces)]
    found = [(k, *axis_side(name)) for k, name in faces]
    return [[found[i] for i in np.flatnonzero(groups == group)] for group in np.unique(groups)]


def _groups(count: int, pairs: Sequence[tuple[int, int]]) -> IntArray:
    """Return the number (count,) of the connected group of each node of a graph, 0 to the number of groups - 1."""
    i, j = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(i), dtype=np.int8), (i, j)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _signed_volume(
    body: MultiPatch, signs: Sequence[int], faces: Iterable[tuple[int, int, int]]
) -> tuple[float, float]:
    """Return the volume that a shell encloses, negative where it faces a void, and a bound of its rounding error.

    signs: of det J of each patch.
    """
    terms = [
        signs[k] * face_flux(body.patches[k], exact_rules(body.patches[k]), axis, side, np.zeros(3))
        for k, axis, side in faces
    ]
    return sum(terms), _ROUNDING * sum(map(abs, terms))


def _may_be_nested(body: MultiPatch, parts: IntArray) -> bool:
    """Return whether all corners of some part's patches lie within the box around another part's control points."""
    nets = [
        [patch.control_points for patch, part in zip(body, parts, strict=True) if part == k]
        for k in range(parts.max() + 1)
    ]
    boxes = [np.concatenate([net.reshape(-1, 3) for net in own]) for own in nets]
    corners = [np.concatenate([_corners(net) for net in own]) for own in nets]
    return any(
        bool(np.all((corner >= box.min(axis=0)) & (corner <= box.max(axis=0))))
        for i, corner in enumerate(corners)
        for j, box in enumerate(boxes)
        if i != j
    )


def _corners(net: Array) -> Array:
    """Return the control points (8, 3) of a patch's corners, which lie on the patch."""
    a, b, c = (n - 1 for n in net.shape[:3])
    return net[::a, ::b, ::c].reshape(8, 3)
