"""Finds the limbs of a body: the parts that stick out from its core by more than they are wide at their root.

The distance inside the body from its core divides it into slabs, whose connected pieces form a graph (G. Reeb). The
points beyond a distance form pieces, too: seen from far to near, one begins at each farthest point and ends where it
meets a piece that reaches farther. A corner of a plate begins such a piece as well, but is wider than long.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, Floats, IntArray, Mask
from ..surface.geometry import connected
from .crossings import DIRECTIONS

SLAB = 2.0  # cells: more than the longest step between neighbours, so no step leaps over a slab
SLENDER = 0.8  # length over width: a rod that sticks out by less is pulled out of a block's face as well
WEDGE = 2.0  # a part that narrows to its tip counts as so many times wider as its width falls, on average, below the
# greatest: a corner of a plate, whose mean is half, needs an angle below 45 degrees


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
        Of the points inside from the core, along paths in the body, in cells.
    least : float
        The length of the shortest limb, in cells.
    """
    points = np.argwhere(inside)
    far = distance[inside]
    slab = np.floor(far / SLAB).astype(np.int64)
    links = _links(inside)
    level = slab[links]
    piece = connected(links[level[:, 0] == level[:, 1]], len(points))
    width = _widths(points, piece)
    pieces = piece[links[level[:, 0] != level[:, 1]]]
    peak = _farthest(far, piece)  # the point of each piece
    found = _Pieces(width, far[peak], slab[peak] * SLAB, least)
    neighbours = _neighbours(pieces, len(width))
    for own in np.lexsort([np.arange(len(width)), -slab[peak]]).tolist():
        found.add(own, [other for other in neighbours[own] if slab[peak[other]] > slab[peak[own]]])
    limbs = [Protrusion(_triple(points[peak[own]]), length) for own, length in found.limbs()]
    return sorted(limbs, key=lambda limb: (-limb.length, limb.tip))


class _Pieces:
    """The pieces beyond a distance that falls: each is known by the slab's piece in which it begins."""

    def __init__(self, width: Floats, peak: Floats, base: Floats, least: float) -> None:
        """Store widths, greatest and least distances (pieces,) of the slabs' pieces, and the least length of a limb."""
        self.width, self.peak, self.base, self.least = width, peak, base, least
        self.root = np.arange(len(width))
        self.begin: dict[int, int] = {}
        self.widths: dict[int, list[float]] = {}
        self.longest: dict[int, float] = {}

    def add(self, own: int, beyond: list[int]) -> None:
        """Add a slab's piece, which joins the pieces beyond it that it touches."""
        roots = sorted({self._root(other) for other in beyond})
        begins = [self.begin[root] for root in roots] or [own]
        elder = max(begins, key=lambda begin: (self.peak[begin], -begin))
        self.root[roots] = own
        self.begin[own] = elder
        widths = self.widths.setdefault(elder, [])
        widths.append(float(self.width[own]))
        length = float(self.peak[elder] - self.base[own])
        widest = max(widths)  # near the core a slab is small again, and the part beyond it is not
        if length >= max(self.least, SLENDER * (widest + (WEDGE - 1.0) * (widest - sum(widths) / len(widths)))):
            self.longest[elder] = length

    def limbs(self) -> list[tuple[int, float]]:
        """Return the limbs by the slab's piece with the tip, and their lengths where they are still slender."""
        return list(self.longest.items())

    def _root(self, own: int) -> int:
        while self.root[own] != own:
            self.root[own] = self.root[self.root[own]]
            own = int(self.root[own])
        return own


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


def _widths(points: IntArray, piece: IntArray) -> Array:
    """Return the widths of pieces, in cells: that of a rod whose points vary as much in their widest direction."""
    count = np.bincount(piece).astype(np.float64)
    mean = np.stack([np.bincount(piece, weights=column) for column in points.T], axis=1) / count[:, None]
    offset = points - mean[piece]
    covariance = np.empty((len(count), 3, 3))
    for i in range(3):
        for j in range(3):
            covariance[:, i, j] = np.bincount(piece, weights=offset[:, i] * offset[:, j]) / count
    return np.asarray(np.sqrt(12.0 * np.maximum(np.linalg.eigvalsh(covariance)[:, -1], 0.0)) + 1.0)


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
