"""Where a rod ends in the tip of a limb."""

import numpy as np

from ...surface.solid import Solid
from ..skeleton.graph import Branch
from .frames import arc_lengths, at_lengths, unit

_DEPTH = 0.8  # radii of the limb: from the last section to the surface in front of it
_BACK = 1.5  # radii: how far before the end of the branch the limb's direction is taken
_ROOM = 0.2  # radii: a limb so short still gets a section beyond that place


def tip(branch: Branch, end: int, body: Solid) -> float:
    """Return the length from a branch's end (0 or 1) back to the last section of its rod; negative beyond the end.

    The branch may end at the surface or well before it: what counts is the surface in front of it.
    """
    step = 1 if end else -1
    points, radii = branch.points[::step], branch.radii[::step]
    along = arc_lengths(points)
    outer = along >= 0.5 * along[-1]
    radius = float(np.median(radii[outer]))
    base = max(0.5 * along[-1], along[-1] - _BACK * radius)
    place = at_lengths(points, np.array([base]))[0]
    reach = float(body.rays(place, unit(points[-1] - place)))
    return float(along[-1] - base - max(_ROOM * radius, reach - _DEPTH * radius))
