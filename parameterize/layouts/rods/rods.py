"""Lays sections across a branch: frames transported along it, the turn between its two ends spread out."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from .clearance import Clearance
from .frames import angle_about, arc_lengths, at_lengths, parallel_transport, tangents, turned, unit
from .widths import FLAT, THIN, half_widths

_STEP = 0.7  # of the median radius: the distance of sections
_FEWEST, _MOST = 4, 60  # sections of a branch
_BLEND = 1.5  # times half the width of a junction's face: over which sections take that of the branch
SIGNS = np.array([[[-1.0, -1.0], [-1.0, 1.0]], [[1.0, -1.0], [1.0, 1.0]]])  # (2, 2, 2) of u, v at the corners [u][v]


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


def ends_turned(first: Array, last: Array, curve: Array) -> Array:
    """Return the corners (2, 2, 3) of a rod's last face in the order, of four, that needs the least turn.

    first, last: (2, 2, 3) corners [u][v] of the first and the last face, right-handed with the curve (k, 3).
    """
    along = tangents(curve)
    across = parallel_transport(_side(first), along)[-1]
    ways = [np.rot90(last, k) for k in range(4)]
    return min(ways, key=lambda way: round(abs(angle_about(along[-1], across, _side(way))), 9))


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
