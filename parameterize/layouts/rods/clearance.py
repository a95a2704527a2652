"""How wide a section of a body may be: up to the surface, or to where another branch is nearer."""

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array
from ...surface.solid import Solid
from ..skeleton.graph import Skeleton
from .frames import unit

_OWN = 0.75  # of the distance from its place that a point on a ray has from all curves, at least, to belong to it
_STEPS = 16  # places along a ray at which this is asked
THIN = 0.55  # of the way to the surface: half the width of a section, and of a junction's block
_CORNER = 0.8  # of the way to the surface: where a section's corners lie at most
FLAT = 4.0  # times the shorter way to the surface: so far blocks reach also where another branch is nearer
_NARROWER = 0.85  # a factor of the longer side of a section whose corners lie too near the surface
_TRIES = 30  # of it: a section a hundred times as wide as thick becomes square
_BEND = 0.6  # of the radius of curvature: half the width at most, or sections would meet at the centre of a bend
SIGNS = np.array([[[-1.0, -1.0], [-1.0, 1.0]], [[1.0, -1.0], [1.0, 1.0]]])  # (2, 2, 2) of u, v at the corners [u][v]


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


def half_widths(
    points: Array, across: Array, beside: Array, curvature: Array, room: Clearance, flat: float = FLAT
) -> Array:
    """Return half the widths (k, 2) of sections at points (k, 3) inside a body.

    across, beside: (k, 3) the unit vectors along the two sides of each section. curvature: (k, 3) the curvature
    vectors of the curve. flat: times the shorter way to the surface, so far sections reach also where another curve is
    nearer. A section fits its neighbours: each width is at most the mean of theirs and its own.
    """
    axes = np.stack([across, beside], axis=1)  # (k, 2, 3)
    ways, own = (
        np.minimum(rays(points[:, None], axes), rays(points[:, None], -axes)) for rays in (room.body.rays, room.rays)
    )
    half = THIN * np.minimum(ways, np.maximum(own, flat * ways.min(axis=1, keepdims=True)))
    bends = np.abs(np.einsum("kda,ka->kd", axes, curvature))
    half = np.minimum(half, _BEND / np.maximum(bends, 1e-12))
    half = _corners_inside(points, axes, half, room)
    padded = np.pad(half, ((1, 1), (0, 0)), mode="edge")
    return np.asarray(np.minimum(half, (padded[:-2] + half + padded[2:]) / 3.0))


def _corners_inside(points: Array, axes: Array, half: Array, room: Clearance) -> Array:
    """Return widths (k, 2) whose sections have their corners inside: the longer sides become shorter first."""
    for _ in range(_TRIES):
        offsets = np.einsum("cd,kd,kda->kca", SIGNS.reshape(4, 2), half, axes)  # (k, 4, 3)
        reach = room.body.rays(points[:, None], unit(offsets)) / np.maximum(np.linalg.norm(offsets, axis=-1), 1e-300)
        share = _CORNER * reach.min(axis=1)
        if (share >= 1.0).all():
            break
        share = np.minimum(share, 1.0)[:, None]
        longest = half.max(axis=1, keepdims=True)
        longer = np.where(half == longest, np.maximum(share, _NARROWER), 1.0)
        half = half * np.where(half.min(axis=1, keepdims=True) < _NARROWER * longest, longer, share)
    return half
