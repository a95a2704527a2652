"""The end of a flat part where a row of limbs begins: its corners, and how it is shared among the limbs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ..skeleton.graph import Branch
from .clearance import Clearance
from .frames import arc_lengths, at_lengths, unit
from .rods import SIGNS
from .strips import BlockCuts
from .widths import half_widths

_WIDE = 0.8  # of the way to the surface: half the width of a stem's end, at most
_CLEAR = 0.5  # times the longer side of a limb's part of the stem's end: how far before it the limb has its own curve


def row_face(place: Array, limbs: Sequence[Array], room: Clearance, size: float) -> Array:
    """Return the corners (2, 2, 3) [u][v] of a stem's end at a place (3,), right-handed outward, u along the row.

    limbs: the points (k, 3) of each limb outward, in order. size: a factor of the widths.
    """
    begins = np.array([limb[0] for limb in limbs])
    ways = unit(np.array([limb[len(limb) // 3] - limb[0] for limb in limbs])).mean(axis=0)
    across = unit(begins[-1] - begins[0])
    outward = unit(ways - across * (across @ ways))
    axes = np.stack([across, np.cross(outward, across)])
    half = half_widths(place[None], axes[:1], axes[1:], np.zeros((1, 3)), room)[0]
    along = (begins - place) @ across
    middles = 0.5 * (along[1:] + along[:-1])
    wanted = max(middles[0] - 2.0 * along[0], 2.0 * along[-1] - middles[-1])
    reach = min(float(way) for way in room.body.rays(place, np.array([across, -across])))
    half[0] = max(half[0], min(wanted, _WIDE * reach))
    return np.asarray(place + np.einsum("uvd,d,da->uva", SIGNS, size * half, axes))


def begun_at(face: Array, limb: Branch) -> Branch:
    """Return a limb of a row that begins in the middle of its part (2, 2, 3) of the stem's end, which faces outward."""
    middle = face.mean(axis=(0, 1))
    sides = (face[1] - face[0]).mean(axis=0), (face[:, 1] - face[:, 0]).mean(axis=0)
    ahead = (limb.points - middle) @ unit(np.cross(*sides))
    beyond = ahead >= _CLEAR * max(np.linalg.norm(side) for side in sides)
    first = min(int(np.argmax(beyond)), len(beyond) - 2)
    points = np.concatenate([middle[None], limb.points[first:]])
    along = arc_lengths(points)
    even = np.linspace(0.0, along[-1], len(points))
    radii = np.interp(even, along, limb.radii[[first, *range(first, len(limb.radii))]])
    return replace(limb, points=at_lengths(points, even), radii=radii)


def strip_cuts(face: Array, begins: Array) -> tuple[BlockCuts, list[int]]:
    """Return the cuts of a face (2, 2, 3) into one part for each limb of a row, and the limb of each part in order.

    begins: (n, 3) where the limbs begin, in order. A cut lies between two of these.
    """
    row = unit(begins[-1] - begins[0])
    sides = [(face[1] - face[0]).mean(axis=0) @ row, (face[:, 1] - face[:, 0]).mean(axis=0) @ row]
    axis = int(np.argmax(np.abs(sides)))
    order = np.arange(len(begins))[:: 1 if sides[axis] > 0.0 else -1]
    along = begins[order] @ row * np.sign(sides[axis])
    middles = 0.5 * (along[1:] + along[:-1])
    first, last = along[0] - (middles[0] - along[0]), along[-1] + (along[-1] - middles[-1])
    shares = (middles - first) / (last - first)
    return BlockCuts(axis, np.stack([1.0 - shares, shares], axis=1)), order.tolist()
