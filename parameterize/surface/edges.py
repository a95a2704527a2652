"""The edges of a triangle mesh."""

from __future__ import annotations

import numpy as np

from ..arrays import IntArray


def edge_table(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Undirected edges (e, 2), sorted, and the number of faces at each (e,)."""
    pairs = np.sort(directed_edges(faces), axis=1)
    base = int(faces.max()) + 1 if len(faces) else 1
    keys, counts = np.unique(pairs[:, 0] * base + pairs[:, 1], return_counts=True)
    return np.stack([keys // base, keys % base], axis=1), counts


def directed_edges(faces: IntArray) -> IntArray:
    """Edges (3 m, 2) in the direction of each face; edge k of face i is row 3 i + k."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
