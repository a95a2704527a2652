"""Lays stubs of handles on the faces of a body: the body is cut into blocks so that each stub covers a whole face."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray
from ...spline.bspline import breakpoints
from ...spline.interface import outward
from ...spline.volume import FACE_NAMES, BSplineVolume
from ..rods.along_skeleton import BlockLayout, LayoutError
from ..rods.block import Block
from ..rods.clearance import Clearance
from ..rods.frames import arc_lengths, at_lengths
from ..rods.rods import ends_turned, rod
from .pieces import Handle

ACROSS = 3  # spans of the body's map that a stub covers in both directions
_ALONG = 4, 24  # the fewest and the most spans along a stub
_STRETCH = 2.0  # how long a span along a stub is, over one across it
_PLACES = 100  # points of a stub's curve


@dataclass(frozen=True)
class Footprint:
    """The part of a face of the cube that a stub covers.

    face: the number of the cube's face. first: the numbers of the first spans that it covers in the face's directions.
    """

    face: int
    first: tuple[int, int]

    @property
    def axes(self) -> tuple[int, int]:
        """Return the two directions of the face."""
        one, other = (axis for axis in range(3) if axis != self.face // 2)
        return one, other


def footprint(parameters: Array, faces: IntArray, spans: int) -> Footprint:
    """Return the footprint below a rim, whose points lie at parameters (k, 3) on faces (k,) of the cube.

    It lies on the face that most of the points are on, around their middle, and not at the edges of the cube. spans: of
    the body's map in each direction.
    """
    face = int(np.bincount(faces).argmax())
    own = np.delete(parameters[faces == face], face // 2, axis=1)
    middle = 0.5 * (own.min(axis=0) + own.max(axis=0))
    first, second = np.clip(np.rint(spans * middle - 0.5 * ACROSS), 1, spans - 1 - ACROSS).astype(int).tolist()
    return Footprint(face, (first, second))


def stub_layout(
    volume: BSplineVolume, ends: list[tuple[Footprint, Footprint]], handles: tuple[Handle, ...], room: Clearance
) -> tuple[BlockLayout, tuple[BSplineVolume, ...]]:
    """Return the layout of the handles' rods, then the body's blocks; and the map of each of these.

    volume: the map of the body, with uniform knots. ends: the footprints of each handle at its first and last end.
    Raises LayoutError where two of them are the same.
    """
    ends_of_spans = breakpoints(volume.knots[0])
    spans = len(ends_of_spans) - 1
    feet = [one for pair in ends for one in pair]
    starts = [_apart([one.first[one.axes.index(axis)] for one in feet if axis in one.axes]) for axis in range(3)]
    cuts = [sorted({0, spans, *row, *(first + ACROSS for first in row)}) for row in starts]
    parts = volume.divided(*(ends_of_spans[row[1:-1]] for row in cuts))  # type: ignore[arg-type]
    cells = np.ndindex(*(len(row) - 1 for row in cuts))
    pieces = {cell: _piece(cell, part) for cell, part in zip(cells, parts, strict=True)}
    faces = [_face(one, starts, cuts, pieces) for one in feet]
    if len({face.tobytes() for face in faces}) < len(faces):
        raise LayoutError("handles leave the body at nearly the same place: no stubs fit beside each other there")
    rods = []
    for number, (handle, first, last) in enumerate(zip(handles, faces[::2], faces[1::2], strict=True)):
        rods.append(_rod(f"handle {number}", handle, first, last.swapaxes(0, 1), room))
    return BlockLayout.from_blocks([*rods, *pieces.values()]), parts


def _apart(firsts: list[int]) -> list[int]:
    """Return where intervals begin that do not overlap: of those that do, one takes the place of all."""
    groups: list[list[int]] = []
    for first in sorted(firsts):
        if groups and first < float(np.mean(groups[-1])) + ACROSS:
            groups[-1].append(first)
        else:
            groups.append([first])
    return [round(float(np.mean(group))) for group in groups]


def _piece(cell: tuple[int, ...], part: BSplineVolume) -> Block:
    """Return the block between the corners of a part of the body."""
    corners = part.control_points[np.ix_((0, -1), (0, -1), (0, -1))]
    u, v, w = (len(breakpoints(row)) - 1 for row in part.knots)
    return Block(f"body {'.'.join(map(str, cell))}", np.moveaxis(corners, 2, 0), (u, v, w))


def _face(
    one: Footprint, starts: list[list[int]], cuts: list[list[int]], pieces: dict[tuple[int, ...], Block]
) -> Array:
    """Return the corners (2, 2, 3) of the block's face below a stub, right-handed with its outward normal."""
    axis, side = divmod(one.face, 2)
    cell = [0, 0, 0]
    cell[axis] = len(cuts[axis]) - 2 if side else 0
    for first, own in zip(one.first, one.axes, strict=True):
        cell[own] = cuts[own].index(min(starts[own], key=lambda start: abs(start - first)))
    name = FACE_NAMES[one.face]
    return outward(pieces[cell[0], cell[1], cell[2]].face(name), name)


def _rod(name: str, handle: Handle, first: Array, last: Array, room: Clearance) -> Block:
    """Return the rod along the curve of a handle between two faces (2, 2, 3), both right-handed with it."""
    bends = np.concatenate([first.mean(axis=(0, 1))[None], handle.curve, last.mean(axis=(0, 1))[None]])
    length = float(arc_lengths(bends)[-1])
    curve = at_lengths(bends, np.linspace(0.0, length, _PLACES))
    last = ends_turned(first, last, curve)
    laid = rod(curve, np.full(_PLACES, handle.radius), (0.0, length), first, last, room)
    sections = laid.sections(np.ones(len(laid.centers)))
    sections[0], sections[-1] = first, last
    along = int(np.clip(round(ACROSS * length / (2.0 * _STRETCH * handle.radius)), *_ALONG))
    return Block(name, sections, (ACROSS, ACROSS, along))
