"""Recognises a stack of extrusions: every triangle of the surface lies across one axis or along it.

Between two neighbouring heights of the faces across the axis the body is a slab over a profile, a plane polygon that
may have holes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray
from ...surface.geometry import doubled_areas, signed_volume
from ...surface.plane_faces import FLAT
from ..planar.plane_warp import PlaneWarp
from ..planar.polygons import area_of

_MOST_AXES = 6  # that are tried: the normals with the most area
_ALIKE = 1e-3  # the normals in one cell of this size are one direction
_CELLS = round(4.0 / _ALIKE)  # more than there are in a direction
SAME = 1e-5  # relative: the volume of the slabs is that of the surface
MOST_SLABS = 12  # a body of more is round along the axis, too

Loop = Array  # the corners (k, 2) of a polygon


@dataclass(frozen=True, eq=False)
class Stack:
    """Slabs over profiles.

    Attributes
    ----------
    frame : (3, 3) array
        Its rows are two directions across the axis, and the axis; right-handed.
    heights : (k + 1,) array
        Of the faces across the axis, and of the corners of sides that lean, ascending.
    profiles : tuple of k tuples of (m, 2) arrays
        Of each slab the polygons that bound it, as the section of the surface has them: outer ones counterclockwise.
    near : float
        Points nearer to each other are one.
    fields : tuple of k + 1 PlaneWarp
        How the plane at each height is moved, so that sides lean; () for upright ones.
    """

    frame: Array
    heights: Array
    profiles: tuple[tuple[Loop, ...], ...]
    near: float
    fields: tuple[PlaneWarp, ...] = ()

    @property
    def volume(self) -> float:
        """Return the volume of the upright slabs."""
        areas = np.array([sum(area_of(loop) for loop in loops) for loops in self.profiles])
        return float(areas @ np.diff(self.heights))

    def in_space(self, points: Array, level: int) -> Array:
        """Return points (..., 2) of the plane at a height, by its number: (..., 3)."""
        return np.asarray(points @ self.frame[:2] + self.heights[level] * self.frame[2])


def stack_of(vertices: Array, faces: IntArray) -> Stack | None:
    """Return a closed surface, vertices (n, 3) and faces (m, 3), as a stack of extrusions; None where it is none.

    Vertices may be off by FLAT of the diagonal, as in planes.
    """
    near = nearness(vertices)
    volume = signed_volume(vertices, faces)
    for axis in axes_of(doubled_areas(vertices, faces)):
        heights = _levels(vertices, faces, axis, near)
        if heights is None:
            continue
        frame = frame_of(axis)
        profiles = tuple(
            tuple(_profile(vertices @ frame.T, faces, low, high))
            for low, high in zip(heights, heights[1:], strict=False)
        )
        stack = Stack(frame, heights, profiles, near)
        if abs(stack.volume - volume) <= SAME * volume:
            return stack
    return None


def nearness(vertices: Array) -> float:
    """Return the distance within which points of a surface (n, 3) are one."""
    return 4.0 * FLAT * float(np.linalg.norm(np.ptp(vertices, axis=0)))


def axes_of(areas: Array) -> Iterator[Array]:
    """Yield the unit normals with the most area, from the doubled areas (m, 3), each direction once."""
    sizes = np.linalg.norm(areas, axis=1)
    rows, sizes = areas[sizes > 0.0], sizes[sizes > 0.0]
    largest = np.abs(rows).argmax(axis=1)
    rows = rows * np.sign(rows[np.arange(len(rows)), largest])[:, None]
    places = np.round(rows / sizes[:, None] / _ALIKE).astype(np.int64)
    _, cells = np.unique(places @ (_CELLS ** np.array([2, 1, 0])), return_inverse=True)
    sums = np.stack([np.bincount(cells, column) for column in rows.T], axis=1)
    lengths = np.linalg.norm(sums, axis=1)
    for cell in np.argsort(-lengths, kind="stable")[:_MOST_AXES]:
        yield sums[cell] / lengths[cell]


def _levels(vertices: Array, faces: IntArray, axis: Array, near: float) -> Array | None:
    """Return the heights of the faces across an axis; None where a triangle is neither across nor along the axis."""
    heights = vertices @ axis
    first, second, third = heights[faces.T]
    across = np.maximum(np.maximum(first, second), third) - np.minimum(np.minimum(first, second), third) <= near
    if not np.any(across):
        return None
    flat = vertices - heights[:, None] * axis
    sides = np.linalg.norm(flat[faces] - flat[np.roll(faces, 1, axis=1)], axis=2).max(axis=1)
    widths = np.abs(doubled_areas(vertices, faces) @ axis) / np.maximum(sides, 1e-300)  # seen along the axis
    if np.any(~across & (widths > near)):
        return None
    levels = np.sort(heights[faces[across]].ravel())
    groups = np.split(levels, np.flatnonzero(np.diff(levels) > near) + 1)
    return np.array([row.mean() for row in groups]) if 2 <= len(groups) <= MOST_SLABS + 1 else None


def frame_of(axis: Array) -> Array:
    """Return two directions across an axis and the axis as rows (3, 3); coordinate axes stay such."""
    first = np.eye(3)[(int(np.abs(axis).argmax()) + 1) % 3]
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first), axis])


def _profile(points: Array, faces: IntArray, low: float, high: float) -> Iterator[Loop]:
    """Yield the polygons (k, 2) in which a surface, points (n, 3), is cut between two heights.

    The body lies on their left. The cut is where no vertex is near.
    """
    inner = points[(points[:, 2] > low) & (points[:, 2] < high), 2]
    levels = np.unique(np.concatenate([inner, [low, high]]))
    gap = int(np.diff(levels).argmax())
    height = 0.5 * (levels[gap] + levels[gap + 1])
    for edges in section(points, faces, height):
        ends = points[edges]  # (k, 2, 3)
        share = ((height - ends[:, 0, 2]) / (ends[:, 1, 2] - ends[:, 0, 2]))[:, None]
        yield (1.0 - share) * ends[:, 0, :2] + share * ends[:, 1, :2]


def section(points: Array, faces: IntArray, height: float) -> Iterator[IntArray]:
    """Yield the closed chains of edges (k, 2) that cross a height at which no vertex of a surface lies.

    The body lies on the left of each.
    """
    above = points[:, 2] > height
    ahead: dict[tuple[int, int], tuple[int, int]] = {}
    for row in faces[np.ptp(above[faces].astype(int), axis=1) > 0].tolist():
        edges = [(a, b) for a, b in zip(row, row[1:] + row[:1], strict=True) if above[a] != above[b]]
        up = next(edge for edge in edges if above[edge[1]])
        down = next(edge for edge in edges if above[edge[0]])
        ahead[_key(down)] = _key(up)
    while ahead:
        first, edge = ahead.popitem()
        chain = [first]
        while edge != first:
            chain.append(edge)
            edge = ahead.pop(edge)
        yield np.array(chain)


def _key(edge: tuple[int, int]) -> tuple[int, int]:
    return (min(edge), max(edge))
