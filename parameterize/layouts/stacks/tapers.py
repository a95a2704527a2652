"""Recognises a stack of slabs whose sides may lean: cones, chamfers around a shaft, countersinks, drafts.

Between two levels the sides are ruled: the profile at each height lies between those at the two levels. Such a stack is
an image of a stack of extrusions, in which each side stands upright over one of its sections; at each level a
smooth field moves the plane so that all sections come to their places.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray
from ...surface.features import SHARP
from ...surface.geometry import doubled_areas, signed_volume
from ..planar.plane_warp import PlaneWarp
from ..planar.polygons import area_of, straightened
from .stack import MOST_SLABS, SAME, Loop, Stack, axes_of, frame_of, nearness, section

_MOST_HEIGHTS = 40  # of a surface's vertices: others are no outlines with straight lines between them
_LEAST = 1e-3  # of a section's width, from one end of a slab to the other: a side that closes to a tip has no outline

_LEANS = 1e-6  # of a section's width, from one end of a slab to the other: less is upright

Side = list[tuple[int, tuple[Loop, Loop]]]  # the numbers of slabs that follow each other, and a loop's ends in each


@dataclass(frozen=True, eq=False)
class _Slab:
    """The body between two heights; of each loop the corners (k, 2) at the lower and at the upper end."""

    low: float
    high: float
    loops: tuple[tuple[Loop, Loop], ...]

    @property
    def volume(self) -> float:
        """Return the volume, by Simpson's rule, which is exact here."""
        ends = [(area_of(a), area_of(0.5 * (a + b)), area_of(b)) for a, b in self.loops]
        return (self.high - self.low) * sum(a + 4.0 * m + b for a, m, b in ends) / 6.0


def tapered_stack_of(vertices: Array, faces: IntArray, sharp: float = SHARP) -> Stack | None:
    """Return a closed surface, vertices (n, 3), faces (m, 3), as a stack with leaning sides; None where it is none.

    A coarse mesh of a smooth body of revolution is none: most rims of a stack are sharper than `sharp`, in degrees.
    """
    near, volume = nearness(vertices), signed_volume(vertices, faces)
    for axis in axes_of(doubled_areas(vertices, faces)):
        frame = frame_of(axis)
        points = vertices @ frame.T
        slabs = _slabs(points, faces, near)
        if slabs is None or abs(sum(slab.volume for slab in slabs) - volume) > SAME * volume:
            continue
        sides = _sides(slabs, near)
        if _rims_are_sharp(slabs, sides, sharp) and (stack := _upright(slabs, sides, frame, near)) is not None:
            return stack
    return None


def _slabs(points: Array, faces: IntArray, near: float) -> list[_Slab] | None:
    """Return the slabs between the heights of corners; None for too many of them, and for sides that close to a tip."""
    order = np.sort(points[:, 2])
    parts = np.flatnonzero(np.diff(order) > near) + 1
    if len(parts) >= _MOST_HEIGHTS:
        return None
    heights = [float(row.mean()) for row in np.split(order, parts)]
    slabs: list[_Slab] = []
    for low, high in zip(heights, heights[1:], strict=False):
        slab = _Slab(low, high, tuple(_ruled(points, faces, low, high, near)))
        if not slab.loops or any(
            min(_width(a), _width(b)) <= _LEAST * max(_width(a), _width(b)) for a, b in slab.loops
        ):
            return None
        whole = _as_one(slabs[-1], slab, near) if slabs else None
        slabs[-1:] = [*slabs[-1:], slab] if whole is None else [whole]
    return slabs if len(slabs) <= MOST_SLABS else None


def _width(loop: Loop) -> float:
    return float(np.ptp(loop, axis=0).max())


def _ruled(points: Array, faces: IntArray, low: float, high: float, near: float) -> list[tuple[Loop, Loop]]:
    """Return the corners of each loop at two heights without vertices between them: the same sides are cut at both."""
    loops = []
    for edges in section(points, faces, 0.5 * (low + high)):
        a, b = points[edges[:, 0]], points[edges[:, 1]]
        ends = []
        for height in (low, 0.5 * (low + high), high):
            share = ((height - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None]
            ends.append((1.0 - share) * a[:, :2] + share * b[:, :2])
        kept = straightened(ends[1], near)
        loops.append((ends[0][kept], ends[2][kept]))
    return loops


def _as_one(below: _Slab, above: _Slab, near: float) -> _Slab | None:
    """Return two slabs as one, where all sides go on straight; None where not."""
    share = (below.high - below.low) / (above.high - below.low)
    loops = []
    for one in below.loops:
        other = _following(one[1], [loop[0] for loop in above.loops], near)
        if other is None:
            return None
        number, order = other
        last = above.loops[number][1][order]
        if np.abs((1.0 - share) * one[0] + share * last - one[1]).max() > near:
            return None
        loops.append((one[0], last))
    return _Slab(below.low, above.high, tuple(loops)) if len(loops) == len(above.loops) else None


def _following(loop: Loop, others: Sequence[Loop], near: float) -> tuple[int, IntArray] | None:
    """Return which of other loops has the same corners as a loop (k, 2), and the order in which it has them."""
    for number, other in enumerate(others):
        if len(other) == len(loop):
            far, order = cKDTree(other).query(loop)
            if np.max(far) <= 4.0 * near and len(np.unique(order)) == len(loop):
                return number, np.asarray(order)
    return None


def _rims_are_sharp(slabs: Sequence[_Slab], sides: Sequence[Side], sharp: float) -> bool:
    """Return whether most of the rims at which sides end, by length, turn into a level by more than an angle."""
    total = kept = 0.0
    for side in sides:
        for k, loops, end in ((*side[0], 0), (*side[-1], 1)):
            length = float(np.linalg.norm(np.diff(loops[end], axis=0, append=loops[end][:1]), axis=1).sum())
            lean = float(np.linalg.norm(loops[1] - loops[0], axis=1).mean())
            total += length
            kept += length * bool(np.degrees(np.arctan2(slabs[k].high - slabs[k].low, lean)) > sharp)
    return kept > 0.5 * total


def _upright(slabs: Sequence[_Slab], sides: Sequence[Side], frame: Array, near: float) -> Stack | None:
    """Return the stack of extrusions and the fields at its levels; None where two sides would need different ones."""
    heights = np.array([slabs[0].low, *(slab.high for slab in slabs)])
    profiles: list[list[Loop]] = [[] for _ in slabs]
    moved: list[list[tuple[Loop, Loop]]] = [[] for _ in heights]  # of each level, loops and where they belong
    for side in sides:
        upright = _reference([(slabs[k], *loops) for k, loops in side])
        for k, (low, high) in side:
            profiles[k].append(upright)
            moved[k].append((upright, low))
            moved[k + 1].append((upright, high))
    fields = [PlaneWarp.of(row, near) for row in moved]
    if any(field is None for field in fields):
        return None
    return Stack(
        frame, heights, tuple(map(tuple, profiles)), near, tuple(field for field in fields if field is not None)
    )


def _sides(slabs: Sequence[_Slab], near: float) -> list[Side]:
    """Return the sides: loops that follow each other from slab to slab, with their corners in one order."""
    done: list[Side] = []
    open_: list[Side] = []
    for k, slab in enumerate(slabs):
        left = list(slab.loops)
        going: list[Side] = []
        for side in open_:
            above = _following(side[-1][1][1], [loop[0] for loop in left], near)
            if above is None:
                done.append(side)
                continue
            low, high = left.pop(above[0])
            going.append([*side, (k, (low[above[1]], high[above[1]]))])
        open_ = going + [[(k, loops)] for loops in left]
    return done + open_


def _reference(side: Sequence[tuple[_Slab, Loop, Loop]]) -> Loop:
    """Return the section of a side that stands for all: of its highest upright part, or its first one."""
    upright = [
        (slab.high - slab.low, low) for slab, low, high in side if np.abs(high - low).max() <= _LEANS * _width(low)
    ]
    return max(upright, key=lambda row: row[0])[1] if upright else side[0][1]
