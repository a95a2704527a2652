"""Lays stubs of handles on the faces of a body: the body is cut into blocks so that each stub covers a whole face."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray
from ...spline.bspline import breakpoints
from ...spline.interface import face_layer, outward
from ...spline.volume import FACE_NAMES, BSplineVolume
from ..complex import Complex, Vertices
from ..rods.along_skeleton import LayoutError
from ..rods.clearance import Clearance
from ..rods.frames import arc_lengths, at_lengths
from ..rods.rods import quarter_turns, rod
from .handles import Handle

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


def stub_blocks(
    volume: BSplineVolume, ends: list[tuple[Footprint, Footprint]], handles: tuple[Handle, ...], room: Clearance
) -> tuple[Complex, tuple[BSplineVolume, ...]]:
    """Return the handles' rods, then the body's blocks; and the map of each of these.

    volume: the map of the body, with uniform knots. ends: the footprints of each handle at its first and last end.
    Raises LayoutError where two of them are the same.
    """
    ends_of_spans = breakpoints(volume.knots[0])
    spans = len(ends_of_spans) - 1
    feet = [one for pair in ends for one in pair]
    starts = [_apart([one.first[one.axes.index(axis)] for one in feet if axis in one.axes]) for axis in range(3)]
    cuts = [sorted({0, spans, *row, *(first + ACROSS for first in row)}) for row in starts]
    parts = volume.divided(*(ends_of_spans[row[1:-1]] for row in cuts))  # type: ignore[arg-type]
    cells = list(np.ndindex(*(len(row) - 1 for row in cuts)))
    vertices = np.arange(np.prod([len(row) for row in cuts])).reshape([len(row) for row in cuts])
    hexahedra = {cell: vertices[tuple(slice(k, k + 2) for k in cell)] for cell in cells}
    points = np.empty((vertices.size, 3))
    for cell, part in zip(cells, parts, strict=True):
        points[hexahedra[cell]] = part.control_points[np.ix_((0, -1), (0, -1), (0, -1))]
    faces = [_face(one, starts, cuts, hexahedra) for one in feet]
    if len({face.tobytes() for face in faces}) < len(faces):
        raise LayoutError("handles leave the body at nearly the same place: no stubs fit beside each other there")
    made, sections, counts = Vertices(points), dict[str, IntArray](), []
    for number, (handle, first, last) in enumerate(zip(handles, faces[::2], faces[1::2], strict=True)):
        sections[f"handle {number}"], along = _rod(handle, first, last.swapaxes(0, 1), made, room)
        counts.append((ACROSS, ACROSS, along))
    for cell, part in zip(cells, parts, strict=True):
        sections[f"body {'.'.join(map(str, cell))}"] = hexahedra[cell]
        counts.append(tuple(len(breakpoints(row)) - 1 for row in part.knots))  # type: ignore[arg-type]
    return Complex.of(made.array, sections, counts), parts


def _apart(firsts: list[int]) -> list[int]:
    """Return where intervals begin that do not overlap: of those that do, one takes the place of all."""
    groups: list[list[int]] = []
    for first in sorted(firsts):
        if groups and first < float(np.mean(groups[-1])) + ACROSS:
            groups[-1].append(first)
        else:
            groups.append([first])
    return [round(float(np.mean(group))) for group in groups]


def _face(
    one: Footprint, starts: list[list[int]], cuts: list[list[int]], hexahedra: dict[tuple[int, ...], IntArray]
) -> IntArray:
    """Return the vertices (2, 2) of the block's face below a stub, right-handed with its outward normal."""
    axis, side = divmod(one.face, 2)
    cell = [0, 0, 0]
    cell[axis] = len(cuts[axis]) - 2 if side else 0
    for first, own in zip(one.first, one.axes, strict=True):
        cell[own] = cuts[own].index(min(starts[own], key=lambda start: abs(start - first)))
    name = FACE_NAMES[one.face]
    return outward(face_layer(hexahedra[cell[0], cell[1], cell[2]], name), name)


def _rod(handle: Handle, below: IntArray, above: IntArray, made: Vertices, room: Clearance) -> tuple[IntArray, int]:
    """Return the vertices (2, 2, m) and the spans along a rod along the curve of a handle; those inside are added.

    below, above: the vertices (2, 2) of the faces between which it lies, both right-handed with it.
    """
    first, last = made.array[below], made.array[above]
    bends = np.concatenate([first.mean(axis=(0, 1))[None], handle.curve, last.mean(axis=(0, 1))[None]])
    length = float(arc_lengths(bends)[-1])
    curve = at_lengths(bends, np.linspace(0.0, length, _PLACES))
    turns = quarter_turns(first, last, curve)
    laid = rod(curve, np.full(_PLACES, handle.radius), (0.0, length), first, np.rot90(last, turns), room)
    inside = made.add(laid.sections(np.ones(len(laid.centers)))[1:-1])
    along = int(np.clip(round(ACROSS * length / (2.0 * _STRETCH * handle.radius)), *_ALONG))
    return np.stack([below, *inside, np.rot90(above, turns)], axis=-1), along
