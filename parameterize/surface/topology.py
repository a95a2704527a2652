"""Checks the topology: refuses surfaces that are non-manifold; counts handles; finds crossings.

Positions in messages are the user's: the caller passes `where`, which turns a vertex number into text.
"""

from collections.abc import Callable

import igl
import numpy as np
from igl.predicates import find_self_intersections

from ..arrays import Array, IntArray, in_brackets
from .errors import MeshError
from .geometry import edge_table, used_vertices

Where = Callable[[int], str]
SLIVER_DEGREES = 0.5
SHOWN = 5  # pairs of faces that cross


def check_edges(faces: IntArray, where: Where) -> None:
    """Raise MeshError for an edge with more than two faces."""
    edges, counts = edge_table(faces)
    crowded = edges[counts > 2]
    if len(crowded):
        raise MeshError(
            f"{len(crowded)} non-manifold edges (more than two faces), the first at {where(crowded[0, 0])}: "
            "remove inner walls and loose faces there"
        )


def check_vertices(faces: IntArray, where: Where) -> None:
    """Raise MeshError for a vertex where sheets touch."""
    pinched = np.flatnonzero(~igl.is_vertex_manifold(faces))
    if len(pinched):
        raise MeshError(
            f"{len(pinched)} non-manifold vertices (sheets touch in a point), the first at {where(int(pinched[0]))}: "
            "pull the sheets apart there"
        )


def genus_of(faces: IntArray) -> int:
    """Return the number of handles of a closed, oriented component (Euler: V - E + F = 2 - 2 g)."""
    return (2 - (len(used_vertices(faces)) - len(faces) // 2)) // 2


def slivers(vertices: Array, faces: IntArray, where: Where) -> list[str]:
    """Return a notice of the triangles with a tiny angle, if any: they are accepted, but may spoil the result."""
    angles = np.degrees(np.nan_to_num(igl.internal_angles(vertices, faces)))  # (m, 3); nan: an edge has no length
    thin = np.flatnonzero(angles.min(axis=1) < SLIVER_DEGREES)
    if not len(thin):
        return []
    return [
        f"{len(thin)} slivers (an angle below {SLIVER_DEGREES} degrees), the first at {where(int(faces[thin[0], 0]))}"
    ]


def crossing_faces(vertices: Array, faces: IntArray) -> IntArray:
    """Return the pairs (k, 2) of faces that meet outside of their common vertices and edges, by exact predicates.

    Two faces with a common edge are not compared: folded flat upon each other, they are not found.
    """
    _, pairs, _ = find_self_intersections(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    ordered = np.sort(np.asarray(pairs, dtype=np.int64).reshape(-1, 2), axis=1)
    return np.unique(ordered, axis=0)


def crossing_places(vertices: Array, faces: IntArray, pairs: IntArray) -> Array:
    """Return a place (k, 3) for each pair: the middle of the intersection of the two faces' boxes."""
    corners = vertices[faces[pairs]]  # (k, 2, 3, 3)
    low, high = corners.min(axis=2).max(axis=1), corners.max(axis=2).min(axis=1)
    return np.asarray((low + high) / 2.0)


def describe_crossings(vertices: Array, faces: IntArray, pairs: IntArray) -> str:
    """Return one line: the number of pairs, and the first with its place."""
    first, second = pairs[0].tolist()
    place = in_brackets(crossing_places(vertices, faces, pairs[:1])[0])
    count = "1 pair" if len(pairs) == 1 else f"{len(pairs)} pairs"
    return f"self-intersection: {count} of faces, the first are faces {first} and {second} near {place}"
