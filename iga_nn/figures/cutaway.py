"""Cuts a body open: images of the cubes' faces and mid-sections without some of each cube's eight octants.

Of a volume one octant is left out, of several patches the octants on one side of a plane.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from parameterize.arrays import Array, Mask
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.interface import face_layer
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import AXES, FACE_NAMES

from .colors import face_colors
from .fields import PER_PATCH, ColoredField, Samples
from .render import Patch, View, plain_patch, view_of

Octant = tuple[int, int, int]  # its corner of the cube: the sides, 0 or 1, of u, of v and of w

INSIDE = "#e9e6df"  # colour of the sections, unlike the six colours of the faces


def patches_of(body: BodyLike, points: Sequence[Array], every: int = 0) -> list[Patch]:
    """Return the images of each patch's six faces, in their colours, and of u, v and w = 1/2, in one colour.

    points: on each (m, n, 3). every: as in Patch.
    """
    faces = np.reshape(face_colors(body), (-1, len(FACE_NAMES))).tolist()
    named = [color for each in faces for color in (*each, INSIDE, INSIDE, INSIDE)]
    return [plain_patch(where, color, every=every) for where, color in zip(points, named, strict=True)]


def colored(points: Sequence[Array], field: ColoredField, every: int = 0) -> list[Patch]:
    """Return the patches at points (m, n, 3) in the colours of a field, without shading: they match its bar."""
    return [
        Patch(where, field.limits.colors(values), lit=False, every=every)
        for where, values in zip(points, field.patches, strict=True)
    ]


def cut_of(body: BodyLike, faces: Sequence[Patch], points: Samples) -> tuple[Mask, View]:
    """Return the octants (patches, 2, 2, 2) that are left out, and the view that shows most of the cut.

    faces: the patches of the outer faces. points: of the body at rest. Of several patches the octants are left out that
    lie in the upper half and towards the viewer.
    """
    glued = as_body(body)
    if glued.is_single:
        octant, view = best_cut(faces, orientation(glued.only))
        return only(octant), view
    view = view_of(faces)
    return beyond(points, view.towards) & beyond(points, view.up), view


def only(octant: Octant) -> Mask:
    """Return the mask (1, 2, 2, 2) of one octant of a volume."""
    mask = np.zeros((1, 2, 2, 2), dtype=bool)
    mask[0][octant] = True
    return mask


def beyond(points: Samples, direction: Array) -> Mask:
    """Return the octants (patches, 2, 2, 2) whose middles lie in the farther half of all middles along a direction."""
    heights = np.stack([_middles(lattice) @ direction for lattice in points.lattices])
    return heights > 0.5 * (heights.min() + heights.max())


def _middles(lattice: Array) -> Array:
    """Return the middles (2, 2, 2, 3) of the octants in a lattice (n, n, n, 3)."""
    quarter, half = len(lattice) // 4, len(lattice) // 2
    return lattice[quarter::half, quarter::half, quarter::half]


def best_cut(faces: Sequence[Patch], hand: int = 1) -> tuple[Octant, View]:
    """Return the octant of a volume to leave out and the view that together show most of the cut.

    faces: six patches of m x m points, m odd. hand: the volume's orientation, 1 or -1.
    The boundary of an octant is closed, so the area of its cut planes that
    faces the viewer is, with sign, that of its outer faces turned away; these are known from the faces alone.
    """
    view, points = view_of(faces), [patch.points for patch in faces]
    choices = [(octant, side) for octant in product((0, 1), (0, 1), (0, 1)) for side in (view, view.turned())]
    return max(choices, key=lambda choice: hand * float(_outside(points, choice[0]) @ choice[1].towards))


def visible(body: BodyLike, patches: Sequence[Patch], left_out: Mask) -> list[Patch]:
    """Return what is seen of a body, of whose patches nine each are given, without some octants (patches, 2, 2, 2).

    Whole faces come first of each patch; faces and sections of which a part is seen are given in quarters.
    """
    shown = []
    for number, parts in enumerate(seen_quarters(body, left_out)):
        own = list(zip(patches[PER_PATCH * number : PER_PATCH * (number + 1)], parts, strict=True))
        shown += [patch for patch, part in own if part.all()]
        partly = ((patch, part) for patch, part in own if part.any() and not part.all())
        shown += [_quarter(patch, sides) for patch, part in partly for sides in np.argwhere(part).tolist()]
    return shown


def seen_quarters(body: BodyLike, left_out: Mask) -> Iterator[Mask]:
    """Yield for each patch which quarters (9, 2, 2) of its six faces and three mid-sections are seen.

    left_out: octants (patches, 2, 2, 2). A quarter of a face is seen where its octant is there and nothing lies behind
    it: the outside, or an octant of the patch it is glued to that is left out. A quarter of a section is seen between
    two octants of which one is left out.
    """
    behind = _behind(as_body(body), left_out)
    for number, own in enumerate(left_out):
        faces = [~face_layer(own, name) & behind.get((number, name), np.bool_(True)) for name in FACE_NAMES]
        sections = [np.take(own, 0, axis) != np.take(own, 1, axis) for axis in range(3)]
        yield np.stack([*faces, *sections])


def _behind(body: Body, left_out: Mask) -> dict[tuple[int, str], Mask]:
    """Return for each glued face whether the octants (2, 2) behind it are left out."""
    found = {}
    for interface in body.interfaces:
        (p, face_p), (q, face_q) = interface.first, interface.second
        places = interface.turned(np.arange(4).reshape(2, 2))  # of the second face's quarters, in the first's order
        first, second = face_layer(left_out[p], face_p), face_layer(left_out[q], face_q)
        found[p, face_p] = second.ravel()[places]
        found[q, face_q] = np.empty((2, 2), dtype=bool)
        found[q, face_q].ravel()[places.ravel()] = first.ravel()
    return found


def octant_label(octant: Octant) -> str:
    """Return the octant in words, such as "u < 1/2, v > 1/2, w < 1/2"."""
    return ", ".join(f"{axis} {'<>'[side]} 1/2" for axis, side in zip(AXES, octant, strict=True))


def _half(samples: int, side: int) -> slice:
    middle = samples // 2
    return slice(middle, None) if side else slice(middle + 1)


def _quarter(patch: Patch, sides: Sequence[int]) -> Patch:
    rows, columns = (_half(n, side) for n, side in zip(patch.points.shape[:2], sides, strict=True))
    return replace(patch, points=patch.points[rows, columns], colors=patch.colors[rows, columns])


def _outside(faces: Sequence[Array], octant: Octant) -> Array:
    """Return the vector area (3,) of the octant's three outer faces, outward on a right-handed volume."""
    total = np.zeros(3)
    for axis, side in enumerate(octant):
        points = faces[2 * axis + side]
        first, second = (end for a, end in enumerate(octant) if a != axis)
        quarter = points[_half(len(points), first), _half(len(points), second)]
        diagonals = quarter[1:, 1:] - quarter[:-1, :-1], quarter[:-1, 1:] - quarter[1:, :-1]
        area = 0.5 * np.cross(*diagonals).sum(axis=(0, 1))
        total += area if (side == 1) == (axis != 1) else -area  # across v the two directions are left-handed
    return total
