"""Splits inner edges of curved tetrahedra that no move of inner nodes makes valid.

Three edges of a tetrahedron that lie on a smooth part of the boundary have tangents in one plane where they meet, so
that det J is zero there at best. A vertex in the middle of an inner edge opposite to them leaves it but two of them.
"""

from dataclasses import replace

import numpy as np

from ...arrays import IntArray, Mask
from .mesh import EDGES, ORDER, THIRDS, TetrahedralMesh

_AT = np.array([[vertex in edge for edge in EDGES.tolist()] for vertex in range(4)])  # (4, 6)


def chords(mesh: TetrahedralMesh, bad: Mask) -> Mask:
    """Return the inner edges (t, 6) of bad tetrahedra that lie opposite to three edges on the part."""
    numbers = mesh.numbering.cells[:, 4 : 4 + 2 * len(EDGES) : 2]
    on_part = mesh.on_part[numbers]
    three = np.stack([on_part[:, own].all(axis=1) for own in _AT], axis=1) & bad[:, None]  # (t, 4)
    return np.asarray((three[:, :, None] & ~_AT).any(axis=1) & ~on_part)


def split(mesh: TetrahedralMesh, wanted: Mask) -> TetrahedralMesh:
    """Return the mesh with a vertex in the middle of wanted edges (t, 6), of one edge of each tetrahedron at most."""
    own = (mesh.numbering.cells[:, 4 : 4 + 2 * len(EDGES) : 2] - len(mesh.points)) // 2
    chosen = _longest(mesh, own, wanted)
    middles = np.full(len(chosen), -1)
    middles[chosen] = len(mesh.points) + np.arange(np.count_nonzero(chosen))
    points = np.concatenate([mesh.points, mesh.points[mesh.numbering.edges[chosen]].mean(axis=1)])
    cells, edges = np.nonzero(chosen[own])
    halves = [mesh.cells[cells].copy() for _ in range(2)]
    nodes = []
    for half, ends in zip(halves, EDGES[edges].T, strict=True):
        half[np.arange(len(cells)), ends] = middles[own[cells, edges]]
        straight = np.einsum("nk,tkx->tnx", THIRDS / ORDER, points[half])
        kept = THIRDS[:, ends].T == 0  # the nodes of the face opposite to the vertex that is replaced
        nodes.append(np.where(kept[:, :, None], mesh.nodes[cells], straight))
    whole = np.ones(len(mesh.cells), dtype=bool)
    whole[cells] = False
    return replace(
        mesh,
        points=points,
        cells=np.concatenate([mesh.cells[whole], *halves]),
        solids=np.concatenate([mesh.solids[whole], mesh.solids[cells], mesh.solids[cells]]),
        nodes=np.concatenate([mesh.nodes[whole], *nodes]),
    )


def _longest(mesh: TetrahedralMesh, own: IntArray, wanted: Mask) -> Mask:
    """Return which edges (e,) are wanted, and longer than the others that are in each of their tetrahedra."""
    ends = mesh.points[mesh.numbering.edges]
    order = np.argsort(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), kind="stable")
    rank = np.empty(len(ends), dtype=np.int64)
    rank[order] = np.arange(len(ends))
    chosen = np.zeros(len(ends), dtype=bool)
    chosen[own[wanted]] = True
    ranks = np.where(chosen, rank, -1)[own]
    chosen[own[(ranks >= 0) & (ranks < ranks.max(axis=1, keepdims=True))]] = False
    return chosen
