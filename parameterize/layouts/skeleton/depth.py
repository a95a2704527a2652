"""Defines Depth: how far the lattice points inside a body are from its surface."""

import numpy as np
from scipy import ndimage

from ...arrays import Array, IntArray, Mask

_TO_SURFACE = 0.5  # cells: the surface passes halfway between a point inside and the nearest one outside, on average


class Depth:
    """The distance from the surface, in cells, at and between the points of a lattice."""

    def __init__(self, inside: Mask) -> None:
        """Compute the distance of each point inside, (n_x, n_y, n_z), from the nearest point outside."""
        self.inside = inside
        self.values: Array = ndimage.distance_transform_edt(inside) - _TO_SURFACE * inside

    def at(self, points: Array) -> Array:
        """Return the distance (k,) at points (k, 3), by trilinear interpolation."""
        return np.asarray(ndimage.map_coordinates(self.values, points.T, order=1))

    def uphill(self, points: Array) -> Array:
        """Return the direction (k, 3) in which the distance grows at points (k, 3), as long as its rate."""
        steps = 0.5 * np.eye(3)
        return np.stack([self.at(points + step) - self.at(points - step) for step in steps], axis=1)

    def deepest(self) -> IntArray:
        """Return the index (3,) of the point farthest from the surface."""
        return np.array(np.unravel_index(np.argmax(self.values), self.values.shape))
