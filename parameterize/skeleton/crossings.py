"""Finds where the lines of a lattice cross a closed surface, in the thirteen directions between neighbouring points."""

from collections.abc import Iterator
from itertools import product

import numpy as np

from ..arrays import Array, IntArray, Mask

# Of the 26 directions to the neighbours of a lattice point one of each pair of opposite ones: its first part is 1.
DIRECTIONS = [(x, y, z) for x, y, z in product((0, 1, -1), repeat=3) if (x, y, z) > (0, 0, 0)]


def inside_of(corners: Array, shape: tuple[int, int, int]) -> Mask:
    """Return which lattice points lie inside the surface, (n_x, n_y, n_z): whose winding number is above 0.

    Parameters
    ----------
    corners : (m, 3, 3) array
        Of triangles that are wound outward, in cells: lattice points have whole coordinates from 0.
    shape : three int
        The numbers of lattice points.
    """
    links, signs = crossed_links(corners, (1, 0, 0))
    change = np.zeros(shape, dtype=np.int16)
    np.add.at(change, (links[:, 0] + 1, links[:, 1], links[:, 2]), signs)
    return np.cumsum(change, axis=0, dtype=np.int16) > 0


def crossed_pairs(corners: Array, inside: Mask) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield, for each direction, the pairs (k, 3), (k, 3) of neighbours inside between which the surface passes."""
    for direction in DIRECTIONS:
        first = crossed_links(corners, direction)[0]
        second = first + np.array(direction)
        both = inside[tuple(first.T)] & inside[tuple(second.T)]
        yield first[both], second[both]


def crossed_links(corners: Array, direction: tuple[int, int, int]) -> tuple[IntArray, IntArray]:
    """Return the links that the surface crosses by their first points (k, 3), and the senses of the crossings (k,).

    A link leads from a lattice point to the next one along the direction, whose first component that is not 0 is 1.
    The sense is 1 where it leads into the body. Each triangle is divided into lines of the lattice as in the drawing
    of polygons on a screen: half-open intervals, whose ends are computed alike for both triangles of an edge, so no
    line slips through between two triangles.
    """
    pivot = direction.index(1)
    others = [axis for axis in range(3) if axis != pivot]
    along = corners[:, :, pivot]
    across = np.stack([corners[:, :, axis] - direction[axis] * along for axis in others], axis=-1)  # (m, 3, 2)
    owner, row = _numbered(np.ceil(across[:, :, 0].min(axis=1)), np.ceil(across[:, :, 0].max(axis=1)))
    low, high = _interval(across[owner], row)
    part, column = _numbered(np.ceil(low), np.ceil(high))
    owner, row = owner[part], row[part]
    a, b, c = np.moveaxis(across[owner], 1, 0)
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    x, y = row - a[:, 0], column - a[:, 1]
    safe = np.where(doubled == 0.0, 1.0, doubled)
    to_b = (x * (c[:, 1] - a[:, 1]) - y * (c[:, 0] - a[:, 0])) / safe
    to_c = (y * (b[:, 0] - a[:, 0]) - x * (b[:, 1] - a[:, 1])) / safe
    heights = along[owner]
    place = heights[:, 0] + to_b * (heights[:, 1] - heights[:, 0]) + to_c * (heights[:, 2] - heights[:, 0])
    place = np.clip(place, heights.min(axis=1), heights.max(axis=1))  # slivers: rounding does not lead away
    first = np.empty((len(row), 3), dtype=np.int64)
    first[:, pivot] = np.floor(place)
    for axis, line in zip(others, (row, column), strict=True):
        first[:, axis] = line + direction[axis] * first[:, pivot]
    turn = -1 if pivot != 1 else 1  # the others, in ascending order, are right-handed about the axis unless it is y
    return first, (turn * np.sign(doubled)).astype(np.int64)


def _numbered(begin: Array, end: Array) -> tuple[IntArray, IntArray]:
    """Return the whole numbers of half-open intervals [begin, end), (k,), with the interval of each."""
    first = begin.astype(np.int64)
    counts = np.maximum(end.astype(np.int64) - first, 0)
    owner = np.repeat(np.arange(len(first)), counts)
    return owner, first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


def _interval(triangles: Array, row: IntArray) -> tuple[Array, Array]:
    """Return where the lines x = row (k,) of the plane enter and leave triangles (k, 3, 2)."""
    low, high = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        p, q = triangles[:, i], triangles[:, j]
        swap = (p[:, 0] > q[:, 0])[:, None]
        p, q = np.where(swap, q, p), np.where(swap, p, q)
        meets = (np.ceil(p[:, 0]) <= row) & (row < np.ceil(q[:, 0]))
        width = np.where(meets, q[:, 0] - p[:, 0], 1.0)
        y = p[:, 1] + (row - p[:, 0]) / width * (q[:, 1] - p[:, 1])
        low = np.where(meets, np.minimum(low, y), low)
        high = np.where(meets, np.maximum(high, y), high)
    return low, high
