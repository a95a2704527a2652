"""Cuts a body open: images of the cubes' faces and mid-sections without some of each cube's eight octants.

Of a volume one octant is left out, of several patches the octants on one side of a plane.
"""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.interface_rows import kinds
from parameterize.spline.volume import AXES, FACE_NAMES

from .colors import face_colors
from .fields import PER_PATCH, ColoredField, Samples, hand_of, outer_faces
from .outline import is_by_face, smooth_colors
from .palette import rgb
from .render import TILT, Patch, View, widest_view

Octant = tuple[int, int, int]  # its corner of the cube: the sides, 0 or 1, of u, of v and of w

INSIDE = "#e9e6df"  # colour of the sections, unlike the six colours of the faces
WITH_OCTANTS = 5  # samples a direction of a lattice: with fewer, whole patches are left out of a body cut open


@dataclass(frozen=True, eq=False)
class Painted:
    """The faces and sections of all patches of a body in colours, of which figures take those that are seen.

    points: where they are drawn. colors: a field, whose colours have no shading; or red, green and blue (9 patches, 3).
    lines: spaces between the parameter lines of a patch, in both directions; 0 draws none.
    """

    points: Samples
    colors: ColoredField | Array
    lines: int = 0
    opacity: float = 1.0

    def at(self, places: IntArray) -> list[Patch]:
        """Return some places (k,) of all faces and sections as patches: one for all of equally many samples."""
        return [self._patch(part) for part in self.points.divided(places)]

    def _patch(self, places: IntArray) -> Patch:
        points = self.points.on(places)
        every = max(1, (points.shape[1] - 1) // self.lines) if self.lines else 0
        if isinstance(self.colors, ColoredField):
            return Patch(points, self.colors.limits.colors(self.colors.on(places)), lit=False, every=every)
        colors = np.broadcast_to(self.colors[places, None, None], points.shape)
        return Patch(points, colors, every=every, opacity=self.opacity)


def own_colors(body: BodyLike) -> Array:
    """Return the colours (9 patches, 3) of the images of each patch's six faces, and of u, v and w = 1/2, in one.

    Of very many patches the outer faces have a colour between sharp edges, and all inside is light.
    """
    if is_by_face(body):
        found = np.tile(rgb(INSIDE), (PER_PATCH * len(as_body(body)), 1))
        found[outer_faces(body)] = list(map(rgb, smooth_colors(body)))
        return found
    faces = np.reshape(face_colors(body), (-1, len(FACE_NAMES)))
    named = np.concatenate([faces, np.full((len(faces), len(AXES)), INSIDE)], axis=1)
    return np.array(list(map(rgb, named.ravel().tolist())))


def cut_of(body: BodyLike, drawn: Samples, points: Samples, view: View | None = None) -> tuple[Mask, View]:
    """Return the octants (patches, 2, 2, 2) that are left out, and the view that shows most of the cut.

    drawn: the points as they are drawn. points: those of the body at rest. Of several patches the octants are left out
    that lie in the upper half and towards the viewer. view: the one to take for several patches, by default the widest.
    """
    glued, outer = as_body(body), drawn.on(outer_faces(body))
    if glued.is_single:
        octant, best = best_cut(outer, hand_of(body))
        return only(octant), best
    view = view or widest_view(outer.reshape(-1, 3), TILT)
    return beyond(points, view.towards) & beyond(points, view.up), view


def only(octant: Octant) -> Mask:
    """Return the mask (1, 2, 2, 2) of one octant of a volume."""
    mask = np.zeros((1, 2, 2, 2), dtype=bool)
    mask[0][octant] = True
    return mask


def beyond(points: Samples, direction: Array) -> Mask:
    """Return the octants (patches, 2, 2, 2) whose middles lie in the farther half of all middles along a direction.

    Lattices that have no middle planes of their octants tell whole patches.
    """
    lattices = points.lattices
    count = 2 if lattices.shape[1] >= WITH_OCTANTS else 1
    half = (lattices.shape[1] - 1) // count
    heights = lattices[:, ::half, ::half, ::half] @ direction
    for axis in (1, 2, 3):
        heights = 0.5 * (np.take(heights, range(count), axis) + np.take(heights, range(1, count + 1), axis))
    heights = np.broadcast_to(heights, (len(heights), 2, 2, 2))
    return heights > 0.5 * (heights.min() + heights.max())


def best_cut(faces: Array, hand: int = 1) -> tuple[Octant, View]:
    """Return the octant of a volume to leave out and the view that together show most of the cut.

    faces: points (6, m, m, 3), m odd. hand: the volume's orientation, 1 or -1.
    The boundary of an octant is closed, so the area of its cut planes that
    faces the viewer is, with sign, that of its outer faces turned away; these are known from the faces alone.
    """
    view = widest_view(faces.reshape(-1, 3), TILT)
    choices = [(octant, side) for octant in product((0, 1), (0, 1), (0, 1)) for side in (view, view.turned())]
    return max(choices, key=lambda choice: hand * float(_outside(faces, choice[0]) @ choice[1].towards))


def visible(body: BodyLike, painted: Painted, left_out: Mask) -> list[Patch]:
    """Return what is seen of a body without some octants (patches, 2, 2, 2).

    Whole faces come first; faces and sections of which a part is seen are given in quarters.
    """
    seen = seen_quarters(body, left_out).reshape(-1, 2, 2)
    is_whole = seen.all(axis=(1, 2))
    shown = painted.at(np.flatnonzero(is_whole))
    for sides in np.ndindex(2, 2):
        partly = np.flatnonzero(seen[:, *sides] & ~is_whole)
        shown += [_quarter(patch, sides) for patch in painted.at(partly)]
    return shown


def seen_quarters(body: BodyLike, left_out: Mask) -> Mask:
    """Return which quarters (patches, 9, 2, 2) of each patch's six faces and three mid-sections are seen.

    left_out: octants (patches, 2, 2, 2). A quarter of a face is seen where its octant is there and nothing lies behind
    it: the outside, or an octant of the patch it is glued to that is left out. A quarter of a section is seen between
    two octants of which one is left out.
    """
    faces = np.stack([np.take(left_out, side, 1 + axis) for axis in range(3) for side in (0, 1)], axis=1)
    sections = [np.take(left_out, 0, 1 + axis) != np.take(left_out, 1, 1 + axis) for axis in range(3)]
    return np.concatenate([~faces & _behind(as_body(body), faces), np.stack(sections, axis=1)], axis=1)


def _behind(body: Body, faces: Mask) -> Mask:
    """Return whether the octants (patches, 6, 2, 2) behind each face are left out, those outside of the body included.

    faces: whether the octants at each face are left out.
    """
    behind = np.ones(faces.shape, dtype=bool).reshape(-1, len(FACE_NAMES), 4)
    quarters, rows = faces.reshape(behind.shape), body.interface_rows
    for kind, members in kinds(rows, np.zeros(len(body), dtype=np.int64)):
        p, face_p, q, face_q = rows[members, :4].T
        places = kind.turned(np.arange(4).reshape(2, 2)).ravel()  # of the second face's quarters, in the first's order
        behind[p, face_p] = quarters[q, face_q][:, places]
        behind[q[:, None], face_q[:, None], places] = quarters[p, face_p]
    return behind.reshape(faces.shape)


def octant_label(octant: Octant) -> str:
    """Return the octant in words, such as "u < 1/2, v > 1/2, w < 1/2"."""
    return ", ".join(f"{axis} {'<>'[side]} 1/2" for axis, side in zip(AXES, octant, strict=True))


def _half(samples: int, side: int) -> slice:
    middle = samples // 2
    return slice(middle, None) if side else slice(middle + 1)


def _quarter(patch: Patch, sides: tuple[int, ...]) -> Patch:
    rows, columns = (_half(n, side) for n, side in zip(patch.points.shape[-3:-1], sides, strict=True))
    return replace(patch, points=patch.points[..., rows, columns, :], colors=patch.colors[..., rows, columns, :])


def _outside(faces: Array, octant: Octant) -> Array:
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
