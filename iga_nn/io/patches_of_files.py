"""Makes volumes of the patches in files of other programs, and compares what a file says of interfaces with them."""

import logging
from collections.abc import Iterable, Sequence
from math import prod

import numpy as np

from parameterize.arrays import Array, listed
from parameterize.spline.body import FLAT, TOLERANCE, Body, net_area
from parameterize.spline.interface import Face, face_label, face_layer, orientations
from parameterize.spline.interface_rows import gaps, rows_of
from parameterize.spline.volume import LARGEST, BSplineVolume

log = logging.getLogger(__name__)

WEIGHTS_ALIKE = 1e-12  # relative
CLOSE = 0.01  # of the body's size: faces that are declared one and nearer than this were rounded or fitted apart


def patch_of(degrees: Sequence[int], knots: Sequence[Array], rows: Array, weights: Array | None) -> BSplineVolume:
    """Return the volume with these parts, its knots scaled to run from 0 to 1; the map stays.

    rows: control points (n_u n_v n_w, 3), u fastest. weights: (n_u n_v n_w,), None where all are 1; where they are
    alike the volume is polynomial. Raises ValueError where the parts do not fit together.
    """
    if min(degrees) < 1:
        raise ValueError(f"has the degree {min(degrees)}; a degree is 1 or larger")
    counts = [len(row) - degree - 1 for row, degree in zip(knots, degrees, strict=True)]
    if min(counts) < 1 or len(rows) != prod(counts):
        raise ValueError(f"has {len(rows)} control points; degrees and knots ask for {' x '.join(map(str, counts))}")
    if not all(np.all(np.abs(row) < LARGEST) and row[-1] - row[0] > 1.0 / LARGEST for row in knots):  # refuses NaN, too
        raise ValueError(f"knots must be finite and span an interval of {1.0 / LARGEST:g} to {LARGEST:g}")
    k_u, k_v, k_w = ((row - row[0]) / (row[-1] - row[0]) for row in knots)
    p_u, p_v, p_w = (int(p) for p in degrees)
    net = np.ascontiguousarray(rows.reshape(*reversed(counts), 3).transpose(2, 1, 0, 3))
    if weights is None or 0.0 < weights.max() <= (1.0 + WEIGHTS_ALIKE) * weights.min():  # polynomial
        return BSplineVolume((p_u, p_v, p_w), (k_u, k_v, k_w), net)
    return BSplineVolume((p_u, p_v, p_w), (k_u, k_v, k_w), net, weights.reshape(*reversed(counts)).transpose(2, 1, 0))


def projected(rows: Array, weights: Array) -> Array:
    """Return control points (n, 3) from homogeneous coordinates (n, 3) and weights (n,), which must be positive.

    Raises ValueError for other weights.
    """
    if not np.all(weights > 0.0):
        raise ValueError("weights must be positive")
    with np.errstate(over="ignore"):  # infinite control points are refused where the volume is made
        return rows / weights[:, None]


def fastest_first(net: Array) -> Array:
    """Return the coefficients (n_u, n_v, n_w, ...) as rows (n_u n_v n_w, components), u fastest."""
    return net.transpose(2, 1, 0, *range(3, net.ndim)).reshape(int(np.prod(net.shape[:3])), -1)


def as_text(rows: Array) -> str:
    """Return rows of numbers (n, k) as lines of text, with every digit."""
    return "\n".join(" ".join(map(repr, row)) for row in rows.tolist())


def body_of(
    patches: Sequence[BSplineVolume], declared: Iterable[tuple[Face, Face]] = (), tolerance: float = TOLERANCE
) -> Body:
    """Return the body of patches with the interfaces that their control points show.

    declared: pairs of faces that the file says are glued. tolerance: as in `Body.from_patches`. Raises ValueError
    where the two faces of a pair are apart, and where the patches do not fit together. Interfaces that the file does
    not name, though it names others, are glued with a notice.
    """
    if not patches:
        raise ValueError("holds no patch")
    body = Body.from_patches(patches, tolerance)
    _compare(body, [frozenset(pair) for pair in declared])
    return body


def _compare(body: Body, declared: Sequence[frozenset[Face]]) -> None:
    """Compare the interfaces of a body with those that its file declares."""
    found = {frozenset((interface.first, interface.second)) for interface in body.interfaces}
    for pair in declared:
        faces = sorted(pair)
        names = " = ".join(face_label(*face) for face in faces)
        if any(patch >= len(body) for patch, _ in faces):
            raise ValueError(f"interface {names}: there are {len(body)} patches, counted from 0")
        if pair not in found and all(_has_area(body, face) for face in faces):
            apart = gaps(body.groups, rows_of(orientations(faces[0], faces[-1]))).min()
            reason = "or weights do not fit together"
            if np.isfinite(apart):
                share = apart / body.size
                close = f"; load_volume(path, tolerance={1.1 * share:.1e}) makes them one" if share < CLOSE else ""
                reason = f"are {apart:.3g} apart, {share:.1e} of the body's size{close}"
            raise ValueError(f"interface {names}: the file says that they are one, but their control points {reason}")
    if declared and (more := found - set(declared)):
        names = listed([" = ".join(face_label(*face) for face in pair) for pair in sorted(map(sorted, more))])
        log.warning("%s: glued, for their control points are the same, though the file does not list them", names)


def _has_area(body: Body, face: Face) -> bool:
    """Return whether a face is a surface, and not shrunk to an edge or a point, where nothing is glued."""
    net = face_layer(body.patches[face[0]].control_points, face[1])
    return bool(net_area(net) > FLAT * body.size**2)
