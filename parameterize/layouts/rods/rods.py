"""Lays sections across a branch or a ring, with frames transported along it, and says which pieces are folded."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Mask
from ...surface.solid import Solid
from ..skeleton.graph import Branch
from .clearance import FLAT, SIGNS, THIN, Clearance, half_widths
from .frames import angle_about, arc_lengths, at_lengths, parallel_transport, tangents, turned, unit

_STEP = 0.7  # of the median radius: the distance of sections
_FEWEST, _MOST = 4, 60  # sections of a branch
_BLEND = 1.5  # times half the width of a junction's face: over which sections take that of the branch
PARTS = 4  # blocks of a ring: none is glued to itself, and none turns by more than a quarter of a circle
_FEWEST_PIECES, _MOST_PIECES = 3, 15  # of a part
_OVERLAP = 3  # sections beyond the beginning and the end, so that both are treated as all others
_DEPTH = 0.8  # radii of the limb: from the last section to the surface in front of it
_BACK = 1.5  # radii: how far before the end of the branch the limb's direction is taken
_ROOM = 0.2  # radii: a limb so short still gets a section beyond that place
_TO_BERNSTEIN = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])  # from values at 0, 1/2, 1, degree 2
_LEAST = 0.02  # of the largest det J of a piece: a piece flatter than this counts as folded
_PLACES = np.array([0.0, 0.5, 1.0])


@dataclass(frozen=True, eq=False)
class Rod:
    """Sections across a curve, before they are made thinner.

    Attributes
    ----------
    centers : (m, 3) array
    offsets : (m, 2, 2, 3) array
        From the centers to the corners [u][v].
    radius : float
        The median distance of the curve from the surface.
    """

    centers: Array
    offsets: Array
    radius: float

    def sections(self, shrink: Array) -> Array:
        """Return the corners (m, 2, 2, 3) of sections whose widths are multiplied by factors (m,)."""
        return np.asarray(self.centers[:, None, None] + shrink[:, None, None, None] * self.offsets)

    @property
    def length(self) -> float:
        """Return the length of the curve through the centers."""
        return float(arc_lengths(self.centers)[-1])

    @property
    def body_width(self) -> float:
        """Return the mean width that the body has in the directions of the sections' sides."""
        sides = self.offsets[:, 1] - self.offsets[:, 0], self.offsets[:, :, 1] - self.offsets[:, :, 0]
        return float(np.mean([np.linalg.norm(side, axis=-1).mean() for side in sides])) / THIN


def quarter_turns(first: Array, last: Array, curve: Array) -> int:
    """Return by how many quarters a rod's last face is turned, as by np.rot90, for the least turn along the rod.

    first, last: (2, 2, 3) corners [u][v] of the first and the last face, right-handed with the curve (k, 3).
    """
    along = tangents(curve)
    across = parallel_transport(_side(first), along)[-1]
    return min(range(4), key=lambda k: round(abs(angle_about(along[-1], across, _side(np.rot90(last, k)))), 9))


def rod(
    points: Array,
    radii: Array,
    span: tuple[float, float],
    first: Array | None,
    last: Array | None,
    room: Clearance,
    flat: float = FLAT,
) -> Rod:
    """Return the sections across a curve (k, 3) between two arc lengths, which may lie beyond its ends.

    radii: (k,) its distances from the surface. first, last: (2, 2, 3) corners [u][v] of given faces at its ends,
    right-handed with the curve; None at the tip of a limb. flat: as in `half_widths`.
    """
    radius = float(np.median(radii))
    if first is not None and last is not None and span[1] - span[0] < _reach(first) + _reach(last):
        return ruled(first, last, radius)
    count = int(np.clip(np.ceil((span[1] - span[0]) / (_STEP * radius)) + 1, _FEWEST, _MOST))
    lengths = np.linspace(*span, count)
    centers = at_lengths(points, lengths)
    along = tangents(centers)
    if first is None and last is not None:
        across = parallel_transport(_side(last), along[::-1])[::-1]
    else:
        across = parallel_transport(flattest(centers, along, room) if first is None else _side(first), along)
    if first is not None and last is not None:
        turn = angle_about(along[-1], across[-1], _side(last))
        across = turned(across, along, np.linspace(0.0, turn, count))
    offsets = plain_offsets(centers, along, across, room, flat)
    for face, place in ((first, 0), (last, -1)):
        if face is not None:
            away = np.abs(lengths - lengths[place])
            share = np.clip(away / min(max(_reach(face), radius), 0.5 * float(away.max())), 0.0, 1.0)
            own = share**2 * (3.0 - 2.0 * share)
            middle = face.mean(axis=(0, 1))
            centers = centers + (1.0 - own)[:, None] * (middle - centers[place])
            offsets = own[:, None, None, None] * offsets + (1.0 - own)[:, None, None, None] * (face - middle)
    return Rod(centers, offsets, radius)


def ruled(first: Array, last: Array, radius: float) -> Rod:
    """Return the straight piece between two faces (2, 2, 3)."""
    faces = np.stack([first, last])
    centers = faces.mean(axis=(1, 2))
    return Rod(centers, faces - centers[:, None, None], radius)


def _reach(face: Array) -> float:
    """Return the length over which sections part from the shape of a junction's face (2, 2, 3)."""
    return _BLEND * float(np.linalg.norm(face - face.mean(axis=(0, 1)), axis=-1).max())


def plain_offsets(centers: Array, along: Array, across: Array, room: Clearance, flat: float = FLAT) -> Array:
    """Return the offsets (m, 2, 2, 3) of the corners of sections as wide as the body allows."""
    beside = np.cross(along, across)
    steps = np.maximum(np.gradient(arc_lengths(centers)), 1e-300)
    curvature = np.gradient(along, axis=0) / steps[:, None]
    half = half_widths(centers, across, beside, curvature, room, flat)
    axes = np.stack([across, beside], axis=1)
    return np.einsum("uvd,kd,kda->kuva", SIGNS, half, axes)


def flattest(centers: Array, along: Array, room: Clearance) -> Array:
    """Return the vector (3,) across the first tangent whose parallel_transport copies are farthest from the surface.

    Along it the sections of a flat body are wide.
    """
    start = unit(np.cross(along[0], np.eye(3)[int(np.argmin(np.abs(along[0])))]))
    frame = parallel_transport(start, along)
    angles = np.linspace(0.0, np.pi, 12, endpoint=False)
    ways = np.stack([turned(frame, along, np.full(len(along), angle)) for angle in angles])
    widths = np.minimum(room.body.rays(centers, ways), room.body.rays(centers, -ways))
    return np.asarray(ways[int(np.argmax(np.median(widths, axis=1).round(9))), 0])


def _side(corners: Array) -> Array:
    """Return the mean direction (3,) of u on a face."""
    return unit((corners[1] - corners[0]).mean(axis=0))


def ring(points: Array, radii: Array, room: Clearance) -> tuple[Rod, int]:
    """Return the sections around a closed curve (k, 3), whose last point is its first, and the quarter turns.

    The last section is the first one, turned by that many quarters: its corners are np.rot90 of the first's.
    radii: (k,) the distances of the curve from the surface.
    """
    radius, total = float(np.median(radii)), float(arc_lengths(points)[-1])
    pieces = PARTS * int(np.clip(np.ceil(total / (PARTS * _STEP * radius)), _FEWEST_PIECES, _MOST_PIECES))
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


def folded(sections: Array) -> Mask:
    """Return which pieces between sections (m, 2, 2, 3) are not proved to have det J > 0: (m - 1,).

    det J of a trilinear piece is a polynomial of degree 2 in each direction; its Bernstein coefficients bound it.
    """
    corners = np.stack([sections[:-1], sections[1:]], axis=3)  # (m - 1, 2, 2, 2, 3), [u][v][w]
    even = np.stack([1.0 - _PLACES, _PLACES], axis=-1)  # (3, 2)
    ways = [
        np.einsum("nuvwx,bv,cw->nbcx", corners[:, 1:] - corners[:, :1], even, even)[:, None],
        np.einsum("nuvwx,au,cw->nacx", corners[:, :, 1:] - corners[:, :, :1], even, even)[:, :, None],
        np.einsum("nuvwx,au,bv->nabx", corners[..., 1:, :] - corners[..., :1, :], even, even)[:, :, :, None],
    ]
    columns = np.broadcast_arrays(*ways)  # (m - 1, 3, 3, 3, 3)
    values = np.einsum("...x,...x->...", np.cross(columns[0], columns[1]), columns[2])
    bounds = np.einsum("nabc,ia,jb,kc->nijk", values, *[_TO_BERNSTEIN] * 3)
    size = np.abs(values).max(axis=(1, 2, 3))
    return np.asarray(bounds.min(axis=(1, 2, 3)) <= _LEAST * size)
