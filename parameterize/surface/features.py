"""Finds the sharp edges of a surface: edges whose triangles meet at more than an angle, chained, and their corners."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, IntArray
from .geometry import connected, edge_triangles, normals_and_areas

SHARP = 40.0  # degrees between the normals of two triangles, above which their edge is sharp
_LOOSE = 0.25  # of the box's diagonal: connected edges with loose ends that are shorter together are noise of scans
_SHORTEST = 0.05  # of the box's diagonal: so are those without loose ends that are shorter together


@dataclass(frozen=True, eq=False)
class Features:
    """The sharp edges of a surface.

    Attributes
    ----------
    chains : tuple of (k,) arrays of int
        The vertices along each chain of sharp edges; a closed chain begins and ends with the same vertex.
    corners : (c,) array of int
        The vertices where chains end, ascending: three or more meet there, or a single one dies out.
    lengths : (chains,) array
        In the unit of the surface.
    """

    chains: tuple[IntArray, ...]
    corners: IntArray
    lengths: Array

    def __len__(self) -> int:
        return len(self.chains)

    @cached_property
    def edges(self) -> IntArray:
        """Return the sharp edges (e, 2) of all chains."""
        pairs = [np.stack([chain[:-1], chain[1:]], axis=1) for chain in self.chains]
        return np.concatenate(pairs) if pairs else np.empty((0, 2), dtype=np.int64)


def features_of(vertices: Array, faces: IntArray, angle: float = SHARP) -> Features:
    """Return the sharp edges of a closed surface, vertices (n, 3) and faces (m, 3).

    Chains run on through vertices at which two sharp edges meet in less than the angle, in degrees.
    """
    edges, triangles = edge_triangles(faces)
    normals, _ = normals_and_areas(vertices, faces)
    bend = np.cos(np.radians(angle))
    sharp = np.sum(normals[triangles[:, 0]] * normals[triangles[:, 1]], axis=1) < bend
    around: dict[int, list[int]] = {}
    for a, b in edges[sharp].tolist():
        around.setdefault(a, []).append(b)
        around.setdefault(b, []).append(a)
    corners = {vertex for vertex, ends in around.items() if not runs_on(vertices, vertex, ends, bend)}
    chains = [np.array(chain) for chain in chains_between(around, corners)]
    lengths = np.array([np.linalg.norm(np.diff(vertices[chain], axis=0), axis=1).sum() for chain in chains])
    label = connected(edges[sharp], len(vertices))
    owners = np.array([label[chain[0]] for chain in chains], dtype=np.int64)
    together = np.bincount(owners, lengths, minlength=len(vertices))
    loose = np.bincount(label[[vertex for vertex in corners if len(around[vertex]) == 1]], minlength=len(vertices))
    least = np.where(loose[owners] > 0, _LOOSE, _SHORTEST) * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    kept = together[owners] >= least
    chosen = tuple(chains[number] for number in np.flatnonzero(kept))
    ends = {int(end) for chain in chosen for end in (chain[0], chain[-1])}
    return Features(chosen, np.array(sorted(ends & corners), dtype=np.int64), lengths[kept])


def runs_on(vertices: Array, vertex: int, ends: list[int], bend: float) -> bool:
    """Return whether two edges, and no others, meet at a vertex and turn there by less than the angle of a cosine."""
    if len(ends) != 2:
        return False
    into, out = vertices[vertex] - vertices[ends[0]], vertices[ends[1]] - vertices[vertex]
    return bool(into @ out > bend * np.linalg.norm(into) * np.linalg.norm(out))


def chains_between(around: dict[int, list[int]], corners: set[int]) -> list[list[int]]:
    """Return the chains of vertices between corners, then the closed ones without a corner, which end where they begin.

    around: of each vertex those to which edges lead, two where it is no corner.
    """
    chains, used = [], set[tuple[int, int]]()
    for start in [*sorted(corners), *sorted(set(around) - corners)]:
        for second in around[start]:
            if (start, second) in used:
                continue
            chain = [start, second]
            while chain[-1] not in corners and chain[-1] != start:
                a, b = around[chain[-1]]
                chain.append(b if a == chain[-2] else a)
            used.update(zip(chain, chain[1:], strict=False))
            used.update(zip(chain[1:], chain, strict=False))
            chains.append(chain)
    return chains
