"""Fills a closed surface with the points of a lattice that have its topology.

The lattice is refined until its first Betti number is the genus of the surface. Where parts of the body nearly touch,
neighbouring points of two parts would be joined through the gap between them: the surface passes between these points,
and the one that is nearer to it is left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Floats, IntArray, Mask
from ...surface.solid import Solid, crossed_pairs, inside_of

FIRST_CELL = 0.04  # at volume 1: 16 000 cells inside, and limbs of a body have radii of .1 and more
FINER = 2.0**0.5
MOST_POINTS = 6_000_000  # of the box, at the last level: thinning and distances take some ten seconds there
MOST_FIRST = 24_000_000  # the same at the first level: frames of wire need it
LOST = 0.003  # share of the points: crumbs at sharp edges are below, and a part of the body that fell off is above
_OFFSET = np.array([2.512345, 2.498765, 2.543211])  # in cells: two layers of points outside, none on a model's faces
_TO_SURFACE = 0.5  # cells: the surface passes halfway between a point inside and the nearest one outside, on average
_ALL_NEIGHBOURS = np.ones((3, 3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class Lattice:
    """Points of a lattice inside a body.

    Attributes
    ----------
    inside : (n_x, n_y, n_z) array of bool
        The points that form the body: one piece, joined across corners, without cavities.
    low : (3,) array
        The point with index (0, 0, 0).
    cell : float
        The distance of neighbours.
    betti : int
        The first Betti number.
    lost : float
        The share of the points that are not joined to the others.
    """

    inside: Mask
    low: Array
    cell: float
    betti: int
    lost: float

    def places(self, index: Floats) -> Array:
        """Return the points (..., 3) of indices (..., 3), which need not be whole."""
        return np.asarray(self.low + self.cell * index)

    def has_topology(self, genus: int) -> bool:
        """Return whether the points hold all of a body with so many handles."""
        return self.betti == genus and self.lost < LOST


def lattices(vertices: Array, faces: IntArray, genus: int) -> Iterator[Lattice]:
    """Yield the lattices inside a surface of volume 1, coarse ones first.

    Gaps between parts are kept open where a lattice has not the body's topology without that. There is none of a
    body so thin, and so wide at volume 1, that even the first one has too many points.
    """
    cell = FIRST_CELL
    while True:
        low = vertices.min(axis=0) - cell * _OFFSET
        counts = np.ceil((vertices.max(axis=0) - low) / cell).astype(int) + 3
        if counts.prod(dtype=float) > (MOST_POINTS if cell < FIRST_CELL else MOST_FIRST):
            return
        corners = (vertices[faces] - low) / cell
        inside = inside_of(corners, (counts[0], counts[1], counts[2]))
        lattice = _in_one_piece(inside, low, cell)
        if not lattice.has_topology(genus):
            lattice = _in_one_piece(_parted(inside, corners, (vertices - low) / cell, faces), low, cell)
        yield lattice
        cell /= FINER


def _parted(inside: Mask, corners: Array, vertices: Array, faces: IntArray) -> Mask:
    """Return the points inside without those that would join two parts through a gap. Lengths are in cells."""
    pairs = np.concatenate([np.stack(pair, axis=1) for pair in crossed_pairs(corners, inside)])  # (k, 2, 3)
    parted = inside.copy()
    if len(pairs):
        keys, number = np.unique(np.ravel_multi_index(tuple(pairs.reshape(-1, 3).T), inside.shape), return_inverse=True)
        points = np.stack(np.unravel_index(keys, inside.shape), axis=1).astype(np.float64)
        squared = Solid(vertices, faces).squared_depths(points)
        nearer = np.argmin(squared[number].reshape(-1, 2), axis=1)
        parted[tuple(pairs[np.arange(len(pairs)), nearer].T)] = False
    return parted


def _in_one_piece(inside: Mask, low: Array, cell: float) -> Lattice:
    """Return the largest piece, its cavities filled."""
    from scipy import ndimage
    from skimage.measure import euler_number

    labels, count = ndimage.label(inside, _ALL_NEIGHBOURS)
    sizes = np.bincount(labels.ravel(), minlength=2)
    sizes[0] = 0
    piece = labels == np.argmax(sizes)
    filled = ndimage.binary_fill_holes(piece)
    total = max(int(sizes.sum()), 1)
    lost = (total - sizes.max() + np.count_nonzero(filled) - np.count_nonzero(piece)) / total
    return Lattice(filled, low, cell, 1 - int(euler_number(filled, connectivity=3)), float(lost))


class Depth:
    """The distance from the surface, in cells, at and between the points of a lattice."""

    def __init__(self, inside: Mask) -> None:
        """Compute the distance of each point inside, (n_x, n_y, n_z), from the nearest point outside."""
        from scipy.ndimage import distance_transform_edt

        self.inside = inside
        self.values: Array = distance_transform_edt(inside) - _TO_SURFACE * inside

    def at(self, points: Array) -> Array:
        """Return the distance (k,) at points (k, 3), by trilinear interpolation."""
        from scipy.ndimage import map_coordinates

        return np.asarray(map_coordinates(self.values, points.T, order=1))

    def uphill(self, points: Array) -> Array:
        """Return the direction (k, 3) in which the distance grows at points (k, 3), as long as its rate."""
        steps = 0.5 * np.eye(3)
        return np.stack([self.at(points + step) - self.at(points - step) for step in steps], axis=1)

    def deepest(self) -> IntArray:
        """Return the index (3,) of the point farthest from the surface."""
        return np.array(np.unravel_index(np.argmax(self.values), self.values.shape))
