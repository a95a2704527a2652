"""Checks the topology: refuses surfaces that are open, non-manifold or disconnected; counts handles; finds crossings.

Positions in messages are the user's: the caller passes `where`, which turns a vertex number into text.
"""

from collections.abc import Callable
from numbers import Integral

import igl
import numpy as np
from igl.predicates import find_self_intersections

from ..arrays import Array, IntArray, in_brackets
from .errors import MeshError
from .geometry import connected, directed_edges, edge_table

Where = Callable[[int], str]
SLIVER_DEGREES = 0.5
LISTED = 8  # components
SHOWN = 5  # pairs of faces that cross


def choose_component(vertices: Array, faces: IntArray, component: int | None) -> tuple[IntArray, list[str]]:
    """Return the face numbers of the only or the chosen component (0 is the largest), and notices. Raises MeshError."""
    groups = _components(faces)
    if component is None and len(groups) == 1:
        return np.arange(len(faces)), []
    sizes = ", ".join(f"{i}: {len(group)} faces" for i, group in enumerate(groups[:LISTED]))
    sizes += f", and {len(groups) - LISTED} more" if len(groups) > LISTED else ""
    if component is not None:
        if not isinstance(component, Integral):
            raise MeshError(f"component must be a whole number, counted from 0, got {component!r:.80}")
        if not 0 <= component < len(groups):
            raise MeshError(f"component {component} does not exist: there are {len(groups)}, counted from 0 ({sizes})")
        notice = [f"component {component} taken of {len(groups)} ({sizes})"] if len(groups) > 1 else []
        return groups[component], notice
    outer, nested = _inside(vertices, faces, groups)
    if nested:
        raise MeshError(
            f"{len(groups)} nested shells ({sizes}), component {nested[0]} lies inside component {outer}: one cube has "
            f"no cavity; remove the inner shell, or fill it by choosing --component {outer}"
        )
    raise MeshError(f"{len(groups)} components ({sizes}): choose one with --component N, or join them")


def _components(faces: IntArray) -> list[IntArray]:
    """Return the face numbers of each component (faces sharing a vertex), the largest first."""
    label = connected(directed_edges(faces), int(faces.max()) + 1)[faces[:, 0]]
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(groups, key=lambda group: (-len(group), int(group[0])))


def _inside(vertices: Array, faces: IntArray, groups: list[IntArray]) -> tuple[int, list[int]]:
    """Return the number of the widest component, and the numbers of the components that lie inside it."""
    listed = [vertices[np.unique(faces[group])] for group in groups[: LISTED + 1]]
    outer = int(np.argmax([np.linalg.norm(np.ptp(points, axis=0)) for points in listed]))
    nested = []
    for i, points in enumerate(listed):
        if i != outer:
            winding = igl.fast_winding_number(vertices, faces[groups[outer]], points)
            if np.all(np.abs(winding) > 0.5):
                nested.append(i)
    return outer, nested


def check_manifold(faces: IntArray, where: Where) -> None:
    """Raise MeshError for an edge with more than two faces, an open boundary, or a vertex where sheets touch."""
    edges, counts = edge_table(faces)
    crowded = edges[counts > 2]
    if len(crowded):
        raise MeshError(
            f"{len(crowded)} non-manifold edges (more than two faces), the first at {where(crowded[0, 0])}: "
            "remove inner or doubled faces there"
        )
    border = edges[counts == 1]
    if len(border):
        loops = len(np.unique(connected(border, int(faces.max()) + 1)[border[:, 0]]))
        raise MeshError(
            f"open surface: {loops} boundary {'loop' if loops == 1 else 'loops'} ({len(border)} edges), the first at "
            f"{where(border[0, 0])}: close the {'hole' if loops == 1 else 'holes'}"
        )
    pinched = np.flatnonzero(~igl.is_vertex_manifold(faces))
    if len(pinched):
        raise MeshError(
            f"{len(pinched)} non-manifold vertices (sheets touch in a point), the first at {where(int(pinched[0]))}: "
            "pull the sheets apart there"
        )


def genus_of(faces: IntArray) -> int:
    """Return the number of handles of a closed, oriented component (Euler: V - E + F = 2 - 2 g)."""
    return (2 - (len(np.unique(faces)) - len(faces) // 2)) // 2


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
