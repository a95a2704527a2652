"""Moves a closed curve to the middle of the body's sections: thinning leaves it anywhere in a flat ring."""

from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...surface.solid import Solid
from ..skeleton.graph import Branch, Skeleton
from .clearance import Clearance
from .frames import arc_lengths, at_lengths, parallel_transport, tangents, turned, unit

_ROUNDS = 6
_STEP = 0.5  # of the median radius: the distance of places where sections are taken
_FEWEST, _MOST = 16, 80  # of these places
_RAYS = 24  # in a section
_DEEP = 0.5  # of the way to the surface: no place moves farther in a round
_SHARES = 1.0, 0.5, 0.25  # of a step, until the curve stays inside


def centered(skeleton: Skeleton, body: Solid) -> Skeleton:
    """Return the skeleton of a ring with its curve through the centroids of the sections across it.

    Other skeletons are returned as they are: where branches meet, sections belong to several of them.
    """
    if skeleton.degrees != (2,):
        return skeleton
    for _ in range(_ROUNDS):
        skeleton = _moved(skeleton, body)
    return skeleton


def _moved(skeleton: Skeleton, body: Solid) -> Skeleton:
    """Return the skeleton after one step towards the middles, shorter where the curve would leave the body."""
    (branch,) = skeleton.branches
    count = int(np.clip(branch.length / (_STEP * float(np.median(branch.radii))), _FEWEST, _MOST))
    curve = _spaced(branch.points, count)
    shift, widths = _to_middles(curve, Clearance(skeleton, body))
    for share in _SHARES:
        points = _spaced(_smooth(curve + share * shift, widths * count / branch.length), count)
        if body.contains(points).all():
            radii = body.depths(points)
            return replace(skeleton, nodes=points[:1], radii=radii[:1], branches=(Branch((0, 0), points, radii),))
    return skeleton


def _spaced(curve: Array, count: int) -> Array:
    """Return count + 1 evenly spaced points of a curve (k, 3)."""
    return at_lengths(curve, np.linspace(0.0, float(arc_lengths(curve)[-1]), count + 1))


def _to_middles(curve: Array, room: Clearance) -> tuple[Array, Array]:
    """Return the vectors (k, 3) from points of a curve to the centroids of the sections there, and the mean widths."""
    along = tangents(curve)
    side = unit(np.cross(along[0], np.eye(3)[int(np.argmin(np.abs(along[0])))]))
    across = parallel_transport(side, along)
    angles = np.linspace(0.0, 2.0 * np.pi, _RAYS, endpoint=False)
    ways = np.stack([turned(across, along, np.full(len(along), angle)) for angle in angles], axis=1)  # (k, rays, 3)
    reach = room.rays(curve[:, None], ways)[..., None]
    shift = 2.0 / 3.0 * (reach**3 * ways).sum(axis=1) / np.maximum((reach**2).sum(axis=1), 1e-300)
    most = _DEEP * room.body.rays(curve, unit(shift))
    shift = shift * np.minimum(1.0, most / np.maximum(np.linalg.norm(shift, axis=1), 1e-300))[:, None]
    return shift, np.sqrt((reach[..., 0] ** 2).mean(axis=1))


def _smooth(points: Array, widths: Array) -> Array:
    """Return the closed curve (k, 3), its last point the first, that is near the points and bends little.

    It solves the equations of a beam on springs, so that waves shorter than the widths (k,) of the sections, in steps
    of the points, go.
    """
    one = np.eye(len(points) - 1)
    bends = widths[:-1, None] ** 2 * (np.roll(one, 1, axis=1) - 2.0 * one + np.roll(one, -1, axis=1))
    inside = np.linalg.solve(one + bends.T @ bends, points[:-1])
    return np.concatenate([inside, inside[:1]])
