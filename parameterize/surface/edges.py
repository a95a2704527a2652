"""The edges of a triangle mesh, and what links hold together."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays import IntArray


def edge_table(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the undirected edges (e, 2), sorted, and the number of faces at each (e,)."""
    pairs = np.sort(directed_edges(faces), axis=1)
    base = int(faces.max()) + 1 if len(faces) else 1
    keys, counts = np.unique(pairs[:, 0] * base + pairs[:, 1], return_counts=True)
    return np.stack([keys // base, keys % base], axis=1), counts


def directed_edges(faces: IntArray) -> IntArray:
    """Return the edges (3 m, 2) in the direction of each face; edge k of face i is row 3 i + k."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def connected(links: IntArray, count: int) -> IntArray:
    """Return the number of the component that each of `count` things belongs to (count,), joined by links (k, 2)."""
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
