"""Cuts the volume open: images of the cube's faces and mid-sections, with one of the eight octants left out."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import AXES

from .evaluate import FACE_COLORS
from .render import Patch, View, plain_patch, view_of

Octant = tuple[int, int, int]  # its corner of the cube: the sides, 0 or 1, of u, of v and of w

INSIDE = "#e9e6df"  # colour of the sections, unlike the six colours of the faces


def patches_of(points: Sequence[Array], every: int = 0) -> list[Patch]:
    """Return the images of the six faces, each in its colour, then those of u, v and w = 1/2, in one colour.

    points: on each (m, n, 3). every: as in Patch.
    """
    places = zip(points, (*FACE_COLORS, INSIDE, INSIDE, INSIDE), strict=True)
    return [plain_patch(where, color, every=every) for where, color in places]


def best_cut(faces: Sequence[Patch], hand: int = 1) -> tuple[Octant, View]:
    """Return the octant to leave out and the view that together show most of the cut.

    faces: six patches of m x m points, m odd. hand: the volume's orientation, 1 or -1.
    The boundary of an octant is closed, so the area of its cut planes that
    faces the viewer is, with sign, that of its outer faces turned away; these are known from the faces alone.
    """
    view, points = view_of(faces), [patch.points for patch in faces]
    choices = [(octant, side) for octant in product((0, 1), (0, 1), (0, 1)) for side in (view, view.turned())]
    return max(choices, key=lambda choice: hand * float(_outside(points, choice[0]) @ choice[1].towards))


def without_octant(patches: Sequence[Patch], octant: Octant) -> list[Patch]:
    """Return the visible parts of nine patches, the six faces and the three sections, without an octant.

    Three faces stay whole, three lose their quarter in the octant, and of each section only this quarter is seen.
    """
    shown = [patches[2 * axis + 1 - octant[axis]] for axis in range(3)]
    for axis in range(3):
        cut, section = patches[2 * axis + octant[axis]], patches[6 + axis]
        inside = _sides(axis, octant)
        shown += [_quarter(cut, sides) for sides in product((0, 1), (0, 1)) if sides != inside]
        shown.append(_quarter(section, inside))
    return shown


def octant_label(octant: Octant) -> str:
    """Return the octant in words, such as "u < 1/2, v > 1/2, w < 1/2"."""
    return ", ".join(f"{axis} {'<>'[side]} 1/2" for axis, side in zip(AXES, octant, strict=True))


def _sides(axis: int, octant: Octant) -> tuple[int, int]:
    """Return the octant's sides in the two directions of a patch normal to an axis."""
    first, second = (side for a, side in enumerate(octant) if a != axis)
    return first, second


def _half(samples: int, side: int) -> slice:
    middle = samples // 2
    return slice(middle, None) if side else slice(middle + 1)


def _quarter(patch: Patch, sides: tuple[int, int]) -> Patch:
    rows, columns = (_half(n, side) for n, side in zip(patch.points.shape[:2], sides, strict=True))
    return replace(patch, points=patch.points[rows, columns], colors=patch.colors[rows, columns])


def _outside(faces: Sequence[Array], octant: Octant) -> Array:
    """Return the vector area (3,) of the octant's three outer faces, outward on a right-handed volume."""
    total = np.zeros(3)
    for axis, side in enumerate(octant):
        points = faces[2 * axis + side]
        first, second = _sides(axis, octant)
        quarter = points[_half(len(points), first), _half(len(points), second)]
        diagonals = quarter[1:, 1:] - quarter[:-1, :-1], quarter[:-1, 1:] - quarter[1:, :-1]
        area = 0.5 * np.cross(*diagonals).sum(axis=(0, 1))
        total += area if (side == 1) == (axis != 1) else -area  # across v the two directions are left-handed
    return total
