"""Holds the ridges of a surface: the sharp edges along which it bends outwards, which an edge of the cube can carry.

In a hollow the solid fills more than half of the space around, and det J > 0 allows no edge of the cube there.
"""

from dataclasses import dataclass

import igl
import numpy as np

from ..arrays import Array, IntArray, Mask
from .features import Features
from .geometry import doubled_areas

_ON = 1e-7  # distance, at volume 1, of points that lie on a ridge: rounding, and single precision


@dataclass(frozen=True, eq=False)
class Ridges:
    """Hold the ridges of a surface at volume 1, and tell what lies on them.

    segments: (s, 2, 3), the ends of the mesh's edges on ridges. corners: (c, 3), where chains of sharp edges end.
    links: (k, 2), the corners that a ridge joins. lengths: (k,), of these ridges. total: the length of all sharp edges,
    those in hollows too.
    """

    segments: Array
    corners: Array
    links: IntArray
    lengths: Array
    total: float

    @classmethod
    def of(cls, found: Features, vertices: Array, faces: IntArray) -> "Ridges":
        """Return the ridges among the sharp edges of a surface, vertices (n, 3) and faces (m, 3)."""
        chosen = [number for number, chain in enumerate(found.chains) if _bends_outwards(chain, vertices, faces)]
        pairs = [np.stack([found.chains[k][:-1], found.chains[k][1:]], axis=1) for k in chosen]
        segments = vertices[np.concatenate(pairs)] if pairs else np.empty((0, 2, 3))
        ends = np.array([found.chains[k][[0, -1]] for k in chosen], dtype=np.int64).reshape(-1, 2)
        between = np.isin(ends, found.corners).all(axis=1)
        links = np.searchsorted(found.corners, ends[between])
        total = float(found.lengths.sum())
        return cls(segments, vertices[found.corners], links, found.lengths[chosen][between], total)

    @property
    def length(self) -> float:
        """Return the length of all ridges."""
        return float(np.linalg.norm(np.diff(self.segments, axis=1), axis=2).sum())

    def hold(self, points: Array) -> Mask:
        """Return whether points (n, 3) lie on a ridge, (n,)."""
        ends = np.ascontiguousarray(self.segments.reshape(-1, 3))
        squared = igl.point_mesh_squared_distance(points, ends, np.arange(len(ends)).reshape(-1, 2))[0]
        return np.asarray(np.asarray(squared).ravel() < _ON**2)

    def end_at(self, points: Array) -> Mask:
        """Return whether points (n, 3) are corners, (n,)."""
        if not len(self.corners):
            return np.zeros(len(points), dtype=bool)
        return np.asarray(np.linalg.norm(points[:, None] - self.corners, axis=2).min(axis=1) < _ON)

    def along(self, points: Array, edges: IntArray) -> Mask:
        """Return whether mesh edges (e, 2) between points (n, 3) lie on ridges, (e,)."""
        found = np.flatnonzero(self.hold(points)[edges].all(axis=1))
        along = np.zeros(len(edges), dtype=bool)
        if len(found):
            along[found] = self.hold(points[edges[found]].mean(axis=1))
        return along


def _bends_outwards(chain: IntArray, vertices: Array, faces: IntArray) -> bool:
    """Return whether the surface bends outwards along a chain of its edges, by its first edge."""
    beside = faces[np.isin(faces, chain[:2]).sum(axis=1) == 2]
    normal = doubled_areas(vertices, beside[:1])[0]
    opposite = beside[1][~np.isin(beside[1], chain[:2])][0]
    return bool((vertices[opposite] - vertices[chain[0]]) @ normal < 0.0)
