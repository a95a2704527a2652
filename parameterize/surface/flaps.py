"""Loose faces of a surface: sheets that hang on an edge of a closed body by one side and enclose nothing."""

import numpy as np

from ..arrays import IntArray
from .draft import Draft
from .geometry import connected, directed_edges, edge_table, normals_and_areas


def without_flaps(draft: Draft) -> tuple[Draft, list[str]]:
    """Return the draft without its loose faces, and a notice of their number and area.

    Loose are the sheets, bounded by edges of more than two faces, that have an open edge; they are dropped where every
    edge on which they hang has two faces left, otherwise all are kept.
    """
    numbers = edge_table(draft.faces)[1]
    if not (numbers == 1).any() or numbers.max() < 3:
        return draft, []
    sides = directed_edges(draft.faces)
    _, edge, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1, 3)  # of each face
    label = _sheets(edge, counts)
    marked = [np.bincount(label, wrong[edge].any(axis=1)) > 0 for wrong in (counts == 1, counts > 2)]
    loose = (marked[0] & marked[1])[label]
    left = np.bincount(edge[~loose].ravel(), minlength=len(counts))
    if loose.all() or np.any(left[np.unique(edge[loose])] % 2) or np.any(left[counts > 2] > 2):
        return draft, []
    dropped = np.flatnonzero(loose)
    area = float(normals_and_areas(draft.vertices, draft.faces[dropped])[1].sum())
    notice = f"dropped {len(dropped)} loose faces (area {area:.3g}) that hang on the body by an edge: "
    return draft.with_faces(np.flatnonzero(~loose)), [notice + "the volume is unchanged"]


def _sheets(edge: IntArray, counts: IntArray) -> IntArray:
    """Return the number of the sheet of each face (m,): faces (m, 3 edges) are joined across edges of two faces."""
    face, side = np.nonzero(counts[edge] == 2)
    links = np.stack([face, len(edge) + edge[face, side]], axis=1)
    return np.unique(connected(links, len(edge) + len(counts))[: len(edge)], return_inverse=True)[1]
