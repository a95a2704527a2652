"""The orientation of a volume: whether its parameter lines u, v, w form a right-handed or a left-handed system.

It follows from the volume that the six faces enclose, by the divergence theorem: no point inside is evaluated, and a
fold somewhere does not change it.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import ceil, log2
from weakref import WeakKeyDictionary

import numpy as np

from ..arrays import Array, IntArray
from .bspline import gauss_points
from .patch_groups import PatchGroup, group_of
from .volume import BSplineVolume

FACES = tuple(product(range(3), (0, 1)))  # axis and side
_FOUND: WeakKeyDictionary[PatchGroup, IntArray] = WeakKeyDictionary()  # orientations
RATIONAL_POINTS = 12  # measured on arcs of 90, 120 and 180 degrees


def face_vectors(
    volume: BSplineVolume | PatchGroup, rows: Sequence[Array], axis: int, side: int
) -> tuple[Array, Array]:
    """Return points on a face, and normals as long as the surface element: (3, q_b, q_c) each; (3, k, ..) of a group.

    rows: the three rows of parameters of a tensor grid in the cube; the row of `axis` is not read. The normals point
    outward on a right-handed volume, inward on a left-handed one.
    """
    u, v, w = (np.array([float(side)]) if a == axis else row for a, row in enumerate(rows))
    points = np.moveaxis(np.squeeze(volume.grid(u, v, w), axis - 4), -1, 0)
    jacobian = np.squeeze(volume.grid_jacobian(u, v, w), axis - 5)  # (.., q_b, q_c, 3, 3)
    area = np.moveaxis(np.cross(jacobian[..., (axis + 1) % 3], jacobian[..., (axis + 2) % 3]), -1, 0)
    return points, area if side else -area


def exact_points(volume: BSplineVolume | PatchGroup, parts: Sequence[int] = (1, 1, 1)) -> list[int]:
    """Return the numbers of Gauss points a direction for which integrals of det J and over faces are exact.

    They are exact for products of three splines, two of them differentiated. A rational volume has RATIONAL_POINTS
    more: the integrals are right to 1e-12 where its circles span up to 180 degrees a knot span, to rounding up to 120.
    parts: into how many parts the integral divides the volume's spans; smaller parts need fewer additional points.
    """
    counts = [(3 * degree + 1) // 2 for degree in volume.degrees]
    if volume.weights is None:
        return counts
    return [n + ceil(RATIONAL_POINTS / (1.0 + log2(k))) for n, k in zip(counts, parts, strict=True)]


def enclosed_volume(volume: BSplineVolume, middle: Array) -> float:
    """Return the integral of det J over the cube from the six faces, negative on a left-handed volume.

    It is exact up to rounding, of a rational volume as far as `exact_points` says. middle: a point (3,) near the body,
    about which the integrals are taken.
    """
    return float(enclosed_volumes(group_of(volume), middle)[0])


def enclosed_volumes(group: PatchGroup, middles: Array) -> Array:
    """Return what `enclosed_volume` does, of all patches of a group (k,); middles: (3,) or (k, 3)."""
    rules = exact_rules(group)
    total = np.zeros(len(group))
    for axis, side in FACES:
        total += face_flux(group, rules, axis, side, middles)
    return total


def exact_rules(volume: BSplineVolume | PatchGroup) -> list[tuple[Array, Array]]:
    """Return points and weights of each direction, with the numbers of `exact_points`."""
    return list(map(gauss_points, volume.knots, exact_points(volume)))


def face_flux(group: PatchGroup, rules: Sequence[tuple[Array, Array]], axis: int, side: int, middles: Array) -> Array:
    """Return the integral of (x - middle) . n / 3 over a face of each patch (k,): those of six faces sum to the volume.

    rules: from `exact_rules`. n points outward on a right-handed volume, inward on a left-handed one. middles: (3,) or
    (k, 3).
    """
    x, area = face_vectors(group, [points.ravel() for points, _ in rules], axis, side)
    b, c = (rules[a][1].ravel() for a in range(3) if a != axis)
    arms = np.moveaxis(x, 0, -1) - middles[..., None, None, :]
    return np.asarray(b @ (arms * np.moveaxis(area, 0, -1)).sum(axis=-1) @ c / 3.0)


def orientation(volume: BSplineVolume) -> int:
    """Return 1 for a right-handed volume, -1 for a left-handed one, whose det J is negative.

    Of a folded volume it is the sign of the larger part.
    """
    return int(orientations(group_of(volume))[0])


def hands_of(groups: Sequence[PatchGroup]) -> IntArray:
    """Return the orientation of each patch of a body (patches,), from the body's groups."""
    hands = np.empty(sum(map(len, groups)), dtype=np.int64)
    for group in groups:
        hands[group.numbers] = orientations(group)
    return hands


def orientations(group: PatchGroup) -> IntArray:
    """Return the orientation of each patch of a group (k,), see `orientation`; they are found once."""
    if group not in _FOUND:
        _FOUND[group] = _orientations(group)
    return _FOUND[group]


def _orientations(group: PatchGroup) -> IntArray:
    points = group.control_points
    low, high = points.min(axis=(1, 2, 3)), points.max(axis=(1, 2, 3))
    size = (high - low).max(axis=1)
    size[size == 0.0] = 1.0
    middle = (low + high) / 2.0  # size and place do not change the sign, but rounding and underflow would
    near = (1.0 / size)[:, None, None, None, None] * points + (-middle / size[:, None])[:, None, None, None]
    return np.where(enclosed_volumes(replace(group, control_points=near), np.zeros(3)) < 0.0, -1, 1)


def mirrored(volume: BSplineVolume) -> BSplineVolume:
    """Return the mirror image in x, whose det J is the negative of the volume's, exactly."""
    return replace(volume, control_points=volume.control_points * [-1.0, 1.0, 1.0])
