"""Repairs a mesh and says so: duplicate vertices, degenerate faces, inconsistent winding."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ..arrays import Array, IntArray
from .edges import connected, directed_edges, edge_table

WELD_TOLERANCE = 1e-7  # of the box's longest side: what single precision cannot tell apart
FLAT = 1e-14  # twice a face's area over its longest edge squared, below which it counts as degenerate


def is_closed(faces: IntArray) -> bool:
    """Return whether every edge has exactly two faces."""
    return len(faces) > 0 and bool(np.all(edge_table(faces)[1] == 2))


def weld_and_drop(vertices: Array, faces: IntArray) -> tuple[IntArray, IntArray, list[str]]:
    """Weld duplicates, drop degenerate faces and unused vertices of a mesh whose box has side 1.

    A mesh that is closed as numbered keeps vertices that merely touch; only edges of no length are collapsed there.
    Returns the vertices to keep (n,), as numbers, faces (m, 3) that count in those, and notices.
    """
    notices = []
    solid = faces[_distinct(faces)]
    closed = is_closed(solid)
    merged = _merge(vertices, _short_edges(vertices, solid) if closed else _close_pairs(vertices, solid))
    welded = merged[solid]
    welded = welded[_distinct(welded)]
    if closed and not is_closed(welded):
        welded = solid  # collapsing would tear the surface: keep its edges of no length
    if not is_closed(welded):
        welded = welded[_areas(vertices, welded) > FLAT]
    removed = len(np.unique(faces)) - len(np.unique(welded)) if len(welded) else 0
    if removed:
        notices.append(f"welded {removed} duplicate vertices (closer than {WELD_TOLERANCE:g} of the size)")
    if len(faces) > len(welded):
        notices.append(f"dropped {len(faces) - len(welded)} degenerate faces")
    unused = len(vertices) - len(np.unique(faces))
    if unused:
        notices.append(f"dropped {unused} vertices that no face uses")
    kept, compact = np.unique(welded, return_inverse=True)
    return kept, compact.reshape(-1, 3).astype(np.int64), notices


def orient(faces: IntArray) -> tuple[IntArray, list[str]] | None:
    """Return the faces (m, 3) of a closed component wound alike, and notices, or None where that is impossible."""
    if _is_oriented(faces):
        return faces, []
    turned, _ = igl.bfs_orient(faces)
    if not _is_oriented(turned):
        return None
    count = int(np.count_nonzero(np.any(turned != faces, axis=1)))
    return turned, [f"repaired inconsistent winding: {min(count, len(faces) - count)} faces flipped"]


def signed_volume(vertices: Array, faces: IntArray) -> float:
    """Return the volume enclosed by faces wound outward; it is negative when they are wound inward."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.sum(np.cross(a, b) * c) / 6.0)


def components(faces: IntArray) -> list[IntArray]:
    """Return the face numbers of each component (faces sharing a vertex), the largest first."""
    label = connected(directed_edges(faces), int(faces.max()) + 1)[faces[:, 0]]
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(groups, key=lambda group: (-len(group), int(group[0])))


def _is_oriented(faces: IntArray) -> bool:
    edges = directed_edges(faces)
    keys = edges[:, 0] * (int(faces.max()) + 1) + edges[:, 1]
    return len(np.unique(keys)) == len(keys)


def _distinct(faces: IntArray) -> NDArray[np.bool_]:
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def _areas(vertices: Array, faces: IntArray) -> Array:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    longest = np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.maximum(longest, 1e-300)


def _short_edges(vertices: Array, faces: IntArray) -> IntArray:
    edges = edge_table(faces)[0]
    return edges[np.linalg.norm(np.subtract(*vertices[edges.T]), axis=1) <= WELD_TOLERANCE]


def _close_pairs(vertices: Array, faces: IntArray) -> IntArray:
    """Return pairs (k, 2) that link used vertices within the tolerance: in cells of a fine grid, then between cells."""
    used = np.unique(faces)
    cell = np.zeros(len(used), dtype=np.int64)
    for axis in range(3):
        rank = np.unique(np.floor(vertices[used, axis] / WELD_TOLERANCE), return_inverse=True)[1]
        cell = np.unique(cell * len(used) + rank, return_inverse=True)[1]
    _, first, member = np.unique(cell, return_index=True, return_inverse=True)
    within = np.stack([used[first[member]], used], axis=1)
    across = KDTree(vertices[used[first]]).query_pairs(WELD_TOLERANCE, output_type="ndarray")
    return np.concatenate([within, used[first[across]]]).astype(np.int64)


def _merge(vertices: Array, pairs: IntArray) -> IntArray:
    """Return for every vertex the lowest vertex that the pairs (k, 2) join it with, (n,)."""
    label = connected(pairs, len(vertices))
    return np.unique(label, return_index=True)[1][label]
