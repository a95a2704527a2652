"""Cuts the end of a flat part into strips, which go on in the limbs of a row, and all blocks that these pass."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...arrays import Array, IntArray
from ...spline.interface import Interface, axis_side, varying
from ..complex import Complex, Vertices
from ..skeleton.graph import Branch
from .clearance import SIGNS, Clearance, half_widths
from .frames import arc_lengths, at_lengths, unit

_WIDE = 0.8  # of the way to the surface: half the width of a stem's end, at most
_CLEAR = 0.5  # times the longer side of a limb's part of the stem's end: how far before it the limb has its own curve


@dataclass(frozen=True, eq=False)
class BlockCuts:
    """Where a block is cut across one of its directions.

    Attributes
    ----------
    axis : int
        The direction: 0, 1, 2 for u, v, w.
    shares : (n, 2) array
        Of the first and of the last corner along it at each cut, in ascending order of the last.
    """

    axis: int
    shares: Array

    def along(self, axis: int, flipped: bool) -> "BlockCuts":
        """Return the same cuts across a direction of a neighbour."""
        return BlockCuts(axis, self.shares[::-1, ::-1] if flipped else self.shares)

    def parts(self, face: Array) -> list[Array]:
        """Return the parts of a face, corners (2, 2, 3), in their order: of the same shape."""
        first, last = np.moveaxis(face, self.axis, 0)
        lines = [first, *(one * first + other * last for one, other in self.shares), last]
        return [np.stack(pair, axis=self.axis) for pair in pairwise(lines)]


class Crossing(ValueError):
    """Says that strips of two rows of limbs pass through the same block."""


def cut_into_strips(blocks: Complex, begun: Iterable[tuple[int, BlockCuts]]) -> tuple[Complex, IntArray]:
    """Return blocks cut into strips, and the number of the block to which each belonged.

    begun: the numbers of blocks and their cuts, which go on through glued faces.

    Raises
    ------
    Crossing
        If a block would be cut twice.
    """
    cuts: dict[int, BlockCuts] = {}
    for start in begun:
        waiting = [start]
        while waiting:
            number, own = waiting.pop()
            if number not in cuts:
                cuts[number] = own
                waiting += _beyond(number, own, blocks.interfaces)
            elif cuts[number].axis != own.axis or not np.array_equal(cuts[number].shares, own.shares):
                raise Crossing
    points, made = Vertices(blocks.points), dict[tuple[int, int], IntArray]()
    strips, owners = dict[str, IntArray](), []
    for number, name in enumerate(blocks.names):
        sections = blocks.sections(number)
        parts = _strips(sections, cuts[number], points, made) if number in cuts else [sections]
        names = [f"{name}, strip {k}" for k in range(len(parts))] if number in cuts else [name]
        strips |= zip(names, parts, strict=True)
        owners += [number] * len(parts)
    return Complex.of(points.array, strips, blocks.spans[owners]), np.array(owners)


def _beyond(number: int, cuts: BlockCuts, interfaces: Sequence[Interface]) -> Iterator[tuple[int, BlockCuts]]:
    """Yield the neighbours of a block through whose common face its cuts go on, and their cuts."""
    for interface in interfaces:
        for own, other in ((interface.first, interface.second), (interface.second, interface.first)):
            if own[0] == number and axis_side(own[1])[0] != cuts.axis:
                place = varying(own[1]).index(cuts.axis)
                there = 1 - place if interface.swapped else place
                of_first = place if own is interface.first else there
                yield other[0], cuts.along(varying(other[1])[there], interface.flipped[of_first])


def _strips(
    sections: IntArray, cuts: BlockCuts, points: Vertices, made: dict[tuple[int, int], IntArray]
) -> list[IntArray]:
    """Return the sections (2, 2, m) of each strip. Along w only a block of two sections is cut.

    made: the vertices on edges that are cut, by their ends; those that are missing are added.
    """
    first, last = np.moveaxis(sections, cuts.axis, 0)
    lines = np.empty((len(cuts.shares), *first.shape), dtype=np.int64)
    for place in np.ndindex(first.shape):
        a, b = int(first[place]), int(last[place])
        if (a, b) not in made:
            made[a, b] = points.add(cuts.shares[:, :1] * points[a] + cuts.shares[:, 1:] * points[b])
            made[b, a] = made[a, b][::-1]
        lines[:, *place] = made[a, b]
    rows = [first, *lines, last]
    return [np.stack(pair, axis=cuts.axis) for pair in pairwise(rows)]


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
