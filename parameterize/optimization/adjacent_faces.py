"""Finds, for each edge of each face on a body's boundary, the face of the boundary on the other side of the edge.

Around an edge the faces of blocks follow one another: a block's other face at this edge, then, where that face is
glued, the face on the other side of the interface, and so on until a face belongs to the boundary.
"""

from functools import lru_cache

import numpy as np

from ..arrays import Array, IntArray
from ..spline.interface import Interface, axis_side
from ..spline.spline_map import ControlNets

Edges = tuple[IntArray, Array]  # the table of `next_faces`, and the side lengths (blocks, 3) of the blocks


@lru_cache(maxsize=4)
def next_faces(nets: ControlNets) -> IntArray:
    """Return a table (6 blocks, 3, 2, 4) of what lies beyond the edge of a face, at the side 0 or 1 of a direction.

    An entry holds the number of the next face, the direction and the side of the edge on that face, and whether the two
    faces run in opposite ways along the edge. Entries of glued faces, and of the direction in which a face is constant,
    are not used.
    """
    crossings = {}
    for interface in nets.interfaces:
        crossings.update(_crossings(interface))
    table = np.zeros((6 * len(nets.knots), 3, 2, 4), dtype=np.int64)
    for face in np.flatnonzero(nets.exposed):
        for direction in range(3):
            for side in range(2):
                if direction != face % 6 // 2:
                    table[face, direction, side] = _beyond(int(face), direction, side, nets, crossings)
    return table


def _beyond(
    face: int,
    direction: int,
    side: int,
    nets: ControlNets,
    crossings: dict[tuple[int, int, int], tuple[int, int, int, int]],
) -> tuple[int, int, int, int]:
    """Return an entry of the table: walk around the edge, from face to face, until one belongs to the boundary."""
    reverse = 0
    while True:
        block, inside = divmod(face, 6)
        other, at = 6 * block + 2 * direction + side, (inside // 2, inside % 2)
        if nets.exposed[other]:
            return other, *at, reverse
        face, direction, side, turned = crossings[other, *at]
        reverse ^= turned


def _crossings(interface: Interface) -> dict[tuple[int, int, int], tuple[int, int, int, int]]:
    """Return for each edge of both faces the same edge on the other face, and whether the faces run in opposite ways.

    An edge is a face, a direction and a side; a value has these three, and 1 where the two edges have opposite ways.
    """
    found = {}
    (p, name), (q, other_name) = interface.first, interface.second
    (axis, end), (other_axis, other_end) = axis_side(name), axis_side(other_name)
    first, second = 6 * p + 2 * axis + end, 6 * q + 2 * other_axis + other_end
    for k, (direction, partner, flip) in enumerate(interface.directions):
        turned = int(interface.flipped[1 - k])
        for side in range(2):
            across = side ^ int(flip)
            found[first, direction, side] = second, partner, across, turned
            found[second, partner, across] = first, direction, side, turned
    return found
