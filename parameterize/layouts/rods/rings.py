"""Lays sections around a circle: the frame comes back to itself, or to itself after quarter turns."""

import numpy as np

from ...arrays import Array
from .clearance import Clearance
from .frames import angle_about, arc_lengths, at_lengths, parallel_transport, turned, unit
from .rods import Rod, flattest, plain_offsets

PARTS = 4  # blocks of a ring: none is glued to itself, and none turns by more than a quarter of a circle
_STEP = 0.7  # of the median radius: the distance of sections
_FEWEST, _MOST = 3, 15  # pieces of a part
_OVERLAP = 3  # sections beyond the beginning and the end, so that both are treated as all others


def ring(points: Array, radii: Array, room: Clearance) -> tuple[Rod, int]:
    """Return the sections around a closed curve (k, 3), whose last point is its first, and the quarter turns.

    The last section is the first one, turned by that many quarters: its corners are np.rot90 of the first's.
    radii: (k,) the distances of the curve from the surface.
    """
    radius, total = float(np.median(radii)), float(arc_lengths(points)[-1])
    pieces = PARTS * int(np.clip(np.ceil(total / (PARTS * _STEP * radius)), _FEWEST, _MOST))
    round_twice = np.concatenate([points[:-1], points[:-1], points])
    numbers = np.arange(-_OVERLAP - 1, pieces + _OVERLAP + 2)
    centers = at_lengths(round_twice, total * (1.0 + numbers / pieces))
    along = unit(centers[2:] - centers[:-2])
    centers, numbers = centers[1:-1], numbers[1:-1]
    inner = slice(_OVERLAP, _OVERLAP + pieces + 1)
    start = parallel_transport(flattest(centers[inner], along[inner], room), along[inner])
    turn = angle_about(along[inner][0], start[-1], start[0])
    quarters = int(np.round(turn / (0.5 * np.pi)))
    rest = turn - 0.5 * np.pi * quarters
    before = parallel_transport(start[0], along[: _OVERLAP + 1][::-1])[::-1]
    after = parallel_transport(start[-1], along[_OVERLAP + pieces :])
    across = turned(np.concatenate([before[:-1], start, after[1:]]), along, rest * numbers / pieces)
    offsets = plain_offsets(centers, along, across, room)[inner]
    offsets[-1] = np.rot90(offsets[0], quarters)
    centers = centers[inner]
    centers[-1] = centers[0]
    return Rod(centers, offsets, radius), quarters
