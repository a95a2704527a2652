"""Places the corners of a junction's block: between the branches that leave it through neighbouring faces."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...spline.interface import axis_side
from ...spline.volume import FACE_NAMES
from ..skeleton.graph import Skeleton
from .clearance import FLAT, THIN, Clearance
from .frames import arc_lengths, rotated, tangents
from .splitting import NORMALS, End, junction_at, stub

_SHARE = 0.35  # of a branch, at most: what a junction takes at each of its ends
_CORNERS = 2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0  # (8, 3), -1 or 1


@dataclass(frozen=True, eq=False)
class Junction:
    """A block where branches meet.

    Attributes
    ----------
    center : (3,) array
    axes : (3, 3) array
        The directions of u, v, w in space, one a row, orthonormal.
    half : (3,) array
        Half the widths along them.
    exits : mapping of (int, int) to Exit
        Where each branch end leaves it.
    """

    center: Array
    axes: Array
    half: Array
    exits: Mapping[End, "Exit"]

    def corners(self, regular: float) -> Array:
        """Return the corners (2, 2, 2, 3), [u][v][w].

        Each is the mean of the places where the branches of its faces would have it. regular: the share, 0 to 1, of a
        plain box in the result.
        """
        box = self.center + (_CORNERS * self.half) @ self.axes  # (8, 3)
        sums, counts = np.zeros((8, 3)), np.zeros(8)
        for leave in self.exits.values():
            axis, side = axis_side(leave.face)
            there = _CORNERS[:, axis] == (1.0 if side else -1.0)
            frame = rotated(self.axes, NORMALS[FACE_NAMES.index(leave.face)] @ self.axes, leave.tangent)
            spread = _CORNERS * self.half
            spread[:, axis] = 0.0
            sums[there] += (leave.point + spread @ frame)[there]
            counts[there] += 1.0
        placed = np.where(counts[:, None] > 0.0, sums / np.maximum(counts, 1.0)[:, None], box)
        return np.asarray(((1.0 - regular) * placed + regular * box).reshape(2, 2, 2, 3))


@dataclass(frozen=True, eq=False)
class Exit:
    """Where a branch leaves a junction: the face, the length of the branch inside, the point and the tangent there."""

    face: str
    length: float
    point: Array
    tangent: Array


def junction(skeleton: Skeleton, node: int, room: Clearance, size: float) -> Junction:
    """Return the block at a node of three to six branches. size: a factor of its widths."""
    ends, assignment = junction_at(skeleton, node)
    center, radius = skeleton.nodes[node], float(skeleton.radii[node])
    free = np.setdiff1d(np.arange(len(NORMALS)), assignment.faces)
    reach = np.full(len(NORMALS), FLAT * radius)
    ways = NORMALS[free] @ assignment.axes
    reach[free] = np.minimum(
        room.body.rays(center, ways), np.maximum(reach[free], room.rays(np.tile(center, (len(ways), 1)), ways))
    )
    for (i, _), face in zip(ends, assignment.faces, strict=True):
        reach[face] = min(reach[face], _SHARE / THIN * skeleton.branches[i].length)
    half = size * THIN * reach.reshape(3, 2).min(axis=1)
    exits = {
        end: _exit(stub(skeleton.branches[end[0]], end[1]), FACE_NAMES[face], center, float(half[face // 2]))
        for end, face in zip(ends, assignment.faces.tolist(), strict=True)
    }
    return Junction(center, assignment.axes, half, exits)


def _exit(points: Array, face: str, center: Array, distance: float) -> Exit:
    """Return where a curve (k, 3) first is at a distance from the center, at most half its length along it."""
    away, along = np.linalg.norm(points - center, axis=1), arc_lengths(points)
    beyond = np.flatnonzero((away >= distance) | (along >= 0.5 * along[-1]))
    k = max(1, int(beyond[0]))
    share = np.clip((distance - away[k - 1]) / max(away[k] - away[k - 1], 1e-300), 0.0, 1.0)
    point = points[k - 1] + share * (points[k] - points[k - 1])
    slopes = tangents(points)
    tangent = (1.0 - share) * slopes[k - 1] + share * slopes[k]
    length = float(along[k - 1] + share * (along[k] - along[k - 1]))
    return Exit(face, length, point, tangent / np.linalg.norm(tangent))
