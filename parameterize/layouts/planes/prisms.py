"""Divides a body between two faces, over which all other faces are quadrangles: columns over quadrangles of a polygon.

Extrusions, also those that are cut obliquely or whose sides lean, are such bodies.
"""

from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ..complex import Complex
from ..planar.polygons import edges_of
from ..planar.quadrangles import Quadrangles, quadrangles_of
from .hexahedra import column
from .polyhedron import Polyhedron

MOST_CORNERS = 40  # of a face that is divided: round outlines have more


def prisms(body: Polyhedron) -> Iterator[Complex]:
    """Yield the decompositions of a body into columns between two of its faces."""
    for low, mates in _ends(body):
        corners = [vertex for loop in body.loops[low] for vertex in loop]
        if len(corners) > MOST_CORNERS:
            continue
        flat = _in_plane(body.vertices[corners], body.planes.normals[low])
        number = {vertex: k for k, vertex in enumerate(corners)}
        loops = [tuple(number[vertex] for vertex in loop) for loop in body.loops[low]]
        quadrangles = quadrangles_of(flat, sorted(loops, key=lambda loop: -_area(flat, loop)))
        if quadrangles is not None:
            yield _over(quadrangles, flat, body.vertices[corners], body.vertices[[mates[vertex] for vertex in corners]])


def _ends(body: Polyhedron) -> Iterator[tuple[int, dict[int, int]]]:
    """Yield the first of each two faces between which all others are quadrangles, and the other end of each edge there.

    Such an edge leads from a vertex of the first face to one of the second.
    """
    members = [{vertex for loop in loops for vertex in loop} for loops in body.loops]
    is_side = [len(loops) == 1 and len(loops[0]) == 4 for loops in body.loops]
    for low in range(len(members)):
        for high in range(low + 1, len(members)):
            sides = [k for k in range(len(members)) if k not in (low, high)]
            ends = members[low] | members[high]
            if members[low] & members[high] or len(ends) != len(body.corners) or not all(is_side[k] for k in sides):
                continue
            if all(len(members[k] & members[low]) == len(members[k] & members[high]) == 2 for k in sides):
                rows = [body.loops[k][0] for k in sides]
                pairs = {
                    (a, b) if a in members[low] else (b, a)
                    for row in rows
                    for a, b in edges_of(row)
                    if (a in members[low]) != (b in members[low])
                }
                if len(pairs) == len(members[low]) == len({a for a, _ in pairs}):
                    yield low, dict(pairs)


def _in_plane(points: Array, normal: Array) -> Array:
    """Return the coordinates (k, 2) of points (k, 3) in their plane, counterclockwise about its normal."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return np.stack([points @ first, points @ np.cross(normal, first)], axis=1)


def _area(points: Array, loop: tuple[int, ...]) -> float:
    """Return the area of a polygon, negative where it is clockwise."""
    x, y = points[list(loop)].T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _over(plane: Quadrangles, flat: Array, low: Array, high: Array) -> Complex:
    """Return columns over quadrangles between the corners of two faces (k, 3).

    Points on edges lie at the same share of both edges; those inside are where an affine map of one face to the other
    has them, or the map that is nearest to one.
    """
    flat_rows = np.column_stack([plane.points, np.ones(len(plane.points))])
    known = np.column_stack([flat, np.ones(len(flat))])
    ends = list[Array]()
    for face in (low, high):
        inside = flat_rows @ np.linalg.lstsq(known, face, rcond=None)[0]
        ends += [face[list(own)].mean(axis=0) if own else inside[k] for k, own in enumerate(plane.parents)]
    count = len(plane.points)
    mates = {k: count + k for k in range(count)}
    return Complex(np.array(ends), np.array([column(one, mates) for one in plane.corners], dtype=np.int64))
