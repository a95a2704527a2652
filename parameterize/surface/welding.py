"""Repairs a mesh, with notices: duplicate vertices, degenerate faces, inconsistent winding."""

import igl
import numpy as np
from scipy.spatial import KDTree

from ..arrays import Array, IntArray, Mask
from .errors import MeshError
from .geometry import connected, directed_edges, doubled_areas, edge_table, used_vertices

WELD_TOLERANCE = 1e-7  # share of the box's longest side: points this close are one in single precision
_MANY = 10_000  # faces
FLAT = 1e-14  # twice a face's area over its longest edge squared, below which it counts as degenerate


def is_known_sound(faces: IntArray) -> bool:
    """Return whether faces (m, 3) are found closed and sound, and need no repair; few are not asked about.

    The searches for repairs take less than it takes to load the compiled test, if there are few faces.
    """
    if len(faces) < _MANY:
        return False
    from .soundness import is_sound

    return is_sound(faces)


def is_closed(faces: IntArray) -> bool:
    """Return whether every edge has exactly two faces."""
    return is_known_sound(faces) or (len(faces) > 0 and bool(np.all(edge_table(faces)[1] == 2)))


def weld_and_drop(vertices: Array, faces: IntArray) -> tuple[IntArray, IntArray, list[str]]:
    """Weld duplicates, drop degenerate faces and unused vertices of a mesh whose box has side 1.

    A mesh that is closed as numbered keeps vertices that merely touch; only edges of no length are collapsed there.
    Returns the remaining faces (m, 3) in the same vertex numbers, their numbers among the given faces (m,), and
    notices.
    """
    notices = []
    kept = np.flatnonzero(_distinct(faces))
    solid = faces[kept]
    closed = is_closed(solid)
    edges = directed_edges(solid)
    short = edges[np.linalg.norm(np.subtract(*vertices[edges.T]), axis=1) <= WELD_TOLERANCE]
    if closed and not len(short):
        welded = solid
    else:
        welded, rows = _welded(vertices, solid, short if closed else close_pairs(vertices, solid), closed)
        kept = kept[rows]
    used = len(used_vertices(faces))
    removed = used - len(used_vertices(welded)) if len(welded) else 0
    if removed:
        notices.append(f"welded {removed} duplicate vertices (closer than {WELD_TOLERANCE:g} of the size)")
    if len(faces) > len(welded):
        notices.append(f"dropped {len(faces) - len(welded)} degenerate faces")
    unused = len(vertices) - used
    if unused:
        notices.append(f"dropped {unused} vertices that no face uses")
    return welded, kept, notices


def _welded(vertices: Array, faces: IntArray, links: IntArray, closed: bool) -> tuple[IntArray, IntArray]:
    """Return faces whose linked vertices are one, without degenerate ones, and their rows among the given faces."""
    label = connected(links, len(vertices))
    welded = np.unique(label, return_index=True)[1][label][faces]  # the lowest number of the joined vertices
    rows = np.flatnonzero(_distinct(welded))
    if closed and not is_closed(welded[rows]):
        rows, welded = np.arange(len(faces)), faces  # collapsing would tear it: keep its edges of no length
    else:
        welded = welded[rows]
    if not is_closed(welded):
        thick = _areas(vertices, welded) > FLAT
        welded, rows = welded[thick], rows[thick]
    return welded, rows


def wind_alike(faces: IntArray) -> tuple[IntArray, list[str]]:
    """Return the faces (m, 3) of a component, open or closed, wound alike, and a notice. Raises MeshError."""
    if is_oriented(faces):
        return faces, []
    wound, _ = igl.bfs_orient(faces)
    if not is_oriented(wound):
        raise MeshError("one-sided surface (no consistent orientation): it bounds no solid")
    count = int(np.count_nonzero(np.any(wound != faces, axis=1)))
    return wound, [f"repaired inconsistent winding: {min(count, len(faces) - count)} faces flipped"]


def is_oriented(faces: IntArray) -> bool:
    """Return whether no two faces run along an edge in the same direction."""
    edges = directed_edges(faces)
    keys = edges[:, 0] * (int(faces.max()) + 1) + edges[:, 1]
    return len(np.unique(keys)) == len(keys)


def _distinct(faces: IntArray) -> Mask:
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def _areas(vertices: Array, faces: IntArray) -> Array:
    """Return twice the area of each face over the square of its longest edge, (m,)."""
    corners = vertices[faces]  # (m, 3, 3)
    longest = np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=2).max(axis=1)
    return np.linalg.norm(doubled_areas(vertices, faces), axis=1) / np.maximum(longest, 1e-300)


def close_pairs(vertices: Array, faces: IntArray) -> IntArray:
    """Return pairs (k, 2) that link used vertices within the tolerance: in cells of a fine grid, then between cells."""
    used = used_vertices(faces)
    cell = np.zeros(len(used), dtype=np.int64)
    for axis in range(3):
        rank = np.unique(np.floor(vertices[used, axis] / WELD_TOLERANCE), return_inverse=True)[1]
        cell = np.unique(cell * len(used) + rank, return_inverse=True)[1]
    _, first, member = np.unique(cell, return_index=True, return_inverse=True)
    within = np.stack([used[first[member]], used], axis=1)
    across = KDTree(vertices[used[first]]).query_pairs(WELD_TOLERANCE, output_type="ndarray")
    return np.concatenate([within, used[first[across]]]).astype(np.int64)
