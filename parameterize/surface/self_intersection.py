"""Finds the faces of a surface that pass through each other, and where."""

import numpy as np
from igl.predicates import find_self_intersections

from ..arrays import Array, IntArray, in_brackets

SHOWN = 5  # pairs that the summary lists


def crossing_faces(vertices: Array, faces: IntArray) -> IntArray:
    """Return the pairs (k, 2) of faces that meet outside of their common vertices and edges, by exact predicates.

    Two faces with a common edge are not compared: folded flat upon each other, they are not found.
    """
    _, pairs, _ = find_self_intersections(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    ordered = np.sort(np.asarray(pairs, dtype=np.int64).reshape(-1, 2), axis=1)
    return np.unique(ordered, axis=0)


def crossing_places(vertices: Array, faces: IntArray, pairs: IntArray) -> Array:
    """Return a place (k, 3) for each pair: the middle of what the boxes of the two faces have in common."""
    corners = vertices[faces[pairs]]  # (k, 2, 3, 3)
    low, high = corners.min(axis=2).max(axis=1), corners.max(axis=2).min(axis=1)
    return np.asarray((low + high) / 2.0)


def describe_crossings(vertices: Array, faces: IntArray, pairs: IntArray) -> str:
    """Return one line: the number of pairs, and the first with its place."""
    first, second = pairs[0].tolist()
    place = in_brackets(crossing_places(vertices, faces, pairs[:1])[0])
    count = "1 pair" if len(pairs) == 1 else f"{len(pairs)} pairs"
    return f"self-intersection: {count} of faces, the first are faces {first} and {second} near {place}"
