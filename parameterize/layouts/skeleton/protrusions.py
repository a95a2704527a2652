"""Finds the limbs of a body: the parts that stick out from its core by about as much as they are wide.

The distance inside the body from its core divides it into slabs, whose connected pieces form a graph (G. Reeb). The
points beyond a distance form pieces, too: seen from far to near, one begins at each farthest point and ends where it
meets a piece that reaches farther. A corner of a plate begins such a piece as well, but is wider than long.
"""

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Floats, IntArray, Mask
from ...surface.geometry import connected
from ...surface.solid import DIRECTIONS

SLAB = 2.0  # cells: more than the longest step between neighbours, so no step leaps over a slab
SLENDER = 0.75  # length over width: a rod that sticks out by less is pulled out of a block's face as well
WEDGE = 2.0  # how often the excess of the width near the root counts as width: a corner of a plate is a limb where its
# angle is below 60 degrees
HOLLOW = 0.5  # share of a limb's slabs whose middles may lie outside the body: walls of cups and pipes have all there


@dataclass(frozen=True)
class Protrusion:
    """A limb by the index (3,) of the point farthest from the core, and its length in cells."""

    tip: tuple[int, int, int]
    length: float


def protrusions(inside: Mask, distance: Array, least: float) -> list[Protrusion]:
    """Return the limbs of a body, the longest first.

    Parameters
    ----------
    inside : (n_x, n_y, n_z) array of bool
        The lattice points of the body.
    distance : (n_x, n_y, n_z) array
        How far the points inside are from the core, along paths in the body, in cells.
    least : float
        The length of the shortest limb, in cells.
    """
    points = np.argwhere(inside)
    far = distance[inside]
    slab = np.floor(far / SLAB).astype(np.int64)
    links = _links(inside)
    level = slab[links]
    piece = connected(links[level[:, 0] == level[:, 1]], len(points))
    middle, width = _middles_and_widths(points, piece)
    hollow = ~inside[tuple(np.rint(middle).astype(np.int64).T)]
    pieces = piece[links[level[:, 0] != level[:, 1]]]
    peak = _farthest(far, piece)  # the point of each piece
    found = _BodyPieces(width, hollow, far[peak], slab[peak] * SLAB, least)
    neighbours = _neighbours(pieces, len(width))
    for own in np.lexsort([np.arange(len(width)), -slab[peak]]).tolist():
        found.add(own, [other for other in neighbours[own] if slab[peak[other]] > slab[peak[own]]])
    limbs = [Protrusion(_triple(points[peak[own]]), length) for own, length in found.limbs.items()]
    return sorted(limbs, key=lambda limb: (-limb.length, limb.tip))


class _BodyPieces:
    """The pieces beyond a distance that falls: each is known by the slab's piece in which it begins."""

    def __init__(self, width: Floats, hollow: Mask, peak: Floats, base: Floats, least: float) -> None:
        """Store the slabs' pieces, and the least length of a limb.

        These are their widths, whether their middles lie outside the body, their greatest and least distances, each
        (pieces,). The dictionary `limbs` has the lengths of the limbs, by the slab's piece with the tip.
        """
        self.width, self.hollow, self.peak, self.base, self.least = width, hollow, peak, base, least
        self.root = np.arange(len(width))
        self.begin: dict[int, int] = {}
        self.slabs: dict[int, list[int]] = {}
        self.limbs: dict[int, float] = {}

    def add(self, own: int, beyond: list[int]) -> None:
        """Add a slab's piece, which joins the pieces beyond it that it touches."""
        roots = sorted({self._root(other) for other in beyond})
        begins = [self.begin[root] for root in roots] or [own]
        elder = max(begins, key=lambda begin: (self.peak[begin], -begin))
        self.root[roots] = own
        self.begin[own] = elder
        slabs = self.slabs.setdefault(elder, [])
        slabs.append(own)
        length = float(self.peak[elder] - self.base[own])
        is_slender = length >= max(self.least, SLENDER * _effective_width(self.width[slabs]))
        if is_slender and self.hollow[slabs].mean() <= HOLLOW:
            self.limbs[elder] = length

    def _root(self, own: int) -> int:
        while self.root[own] != own:
            self.root[own] = self.root[self.root[own]]
            own = int(self.root[own])
        return own


def _effective_width(widths: Floats) -> float:
    """Return the mean of the widths (k,) from a tip to its root, and more of a part that narrows to its tip."""
    mean, root = (float(np.mean(part)) for part in (widths, widths[-((len(widths) + 2) // 3) :]))
    return mean + WEDGE * max(root - mean, 0.0)


def _links(inside: Mask) -> IntArray:
    """Return the pairs (k, 2) of neighbouring points inside, by their numbers."""
    padded = np.full(tuple(n + 2 for n in inside.shape), -1, dtype=np.int64)
    padded[1:-1, 1:-1, 1:-1][inside] = np.arange(np.count_nonzero(inside))
    points = np.argwhere(padded >= 0)
    number = padded[tuple(points.T)]
    links = []
    for direction in DIRECTIONS:
        other = padded[tuple((points + direction).T)]
        links.append(np.stack([number, other], axis=1)[other >= 0])
    return np.concatenate(links)


def _middles_and_widths(points: IntArray, piece: IntArray) -> tuple[Array, Array]:
    """Return the middles (pieces, 3) and the widths (pieces,) of pieces, in cells.

    The width is that of a rod whose points vary as much in their widest direction.
    """
    count = np.bincount(piece).astype(np.float64)
    mean = np.stack([np.bincount(piece, weights=column) for column in points.T], axis=1) / count[:, None]
    offset = points - mean[piece]
    covariance = np.empty((len(count), 3, 3))
    for i in range(3):
        for j in range(3):
            covariance[:, i, j] = np.bincount(piece, weights=offset[:, i] * offset[:, j]) / count
    return mean, np.asarray(np.sqrt(12.0 * np.maximum(np.linalg.eigvalsh(covariance)[:, -1], 0.0)) + 1.0)


def _farthest(far: Array, piece: IntArray) -> IntArray:
    """Return the point of each piece that is farthest from the core."""
    order = np.lexsort([far, piece])
    return order[np.append(np.flatnonzero(np.diff(piece[order])), len(order) - 1)]


def _neighbours(pairs: IntArray, count: int) -> list[list[int]]:
    """Return the pieces that touch each piece, in ascending order."""
    both = np.unique(np.concatenate([pairs @ (count, 1), pairs @ (1, count)]))
    split = np.searchsorted(both, np.arange(1, count) * count)
    return [part.tolist() for part in np.split(both % count, split)]


def _triple(index: IntArray) -> tuple[int, int, int]:
    x, y, z = (int(i) for i in index)
    return x, y, z
