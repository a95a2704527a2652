"""How far the room of a branch reaches across it: to the surface, or to where another branch is nearer."""

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array
from ...surface.solid import Solid
from ..skeleton.graph import Skeleton

_OWN = 0.75  # of the distance from its place that a point on a ray has from all curves, at least, to belong to it
_STEPS = 16  # places along a ray at which this is asked


class Clearance:
    """The body, divided among the curves of its skeleton.

    Parameters
    ----------
    skeleton : Skeleton
    body : Solid
    """

    def __init__(self, skeleton: Skeleton, body: Solid) -> None:
        self.body = body
        self._curves = cKDTree(np.concatenate([skeleton.nodes, *(branch.points for branch in skeleton.branches)]))

    def rays(self, points: Array, directions: Array) -> Array:
        """Return how far rays (..., 3) from places (..., 3) near the curves go on in the part of their own place."""
        reach = self.body.rays(points, directions)
        lengths = reach[..., None] * np.arange(1, _STEPS + 1) / _STEPS  # (..., k)
        places = points[..., None, :] + lengths[..., None] * directions[..., None, :]
        own = np.asarray(self._curves.query(places)[0]) >= _OWN * lengths
        inner = np.minimum.accumulate(own, axis=-1).sum(axis=-1)  # the number of places before the first one beyond
        return np.asarray(reach * inner / _STEPS)
