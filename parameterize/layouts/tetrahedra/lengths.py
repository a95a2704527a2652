"""The lengths that edges of coarse triangles should have: by curvature, by the thickness of walls, and graded."""

import igl
import numpy as np

from ...arrays import Array, IntArray, Mask
from .coarse import Coarse, Edges
from .mesher import Sizes

_SMALLEST = 1.0 / 300.0  # of the diagonal
_WALL = 2.5  # times the thickness of a wall, at most
_SWEEPS = 30  # at most


class Lengths:
    """What decides on lengths: the mesh, points (n, 3) and triangles (m, 3), and the sizes asked for.

    sides: (faces, 2), whether there is a solid inside and outside of each face.
    """

    def __init__(self, points: Array, triangles: IntArray, sides: Mask, sizes: Sizes) -> None:
        self._points, self._triangles = np.ascontiguousarray(points), np.ascontiguousarray(triangles)
        self._sides, self._sizes = sides, sizes
        self._diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        self._tree = igl.AABB()
        self._tree.init(self._points, self._triangles)

    def at(self, coarse: Coarse, edges: Edges) -> Array:
        """Return the wanted lengths (n,) at the vertices of coarse triangles."""
        turn = 2.0 * np.pi / self._sizes.around
        middles = coarse.points[coarse.triangles].mean(axis=1)
        nearest, weights = coarse.surface.nearest(middles, coarse.faces)
        by_triangle = turn / np.maximum(coarse.surface.curvatures[nearest], 1e-300)
        by_triangle = np.minimum(by_triangle, _WALL * self._thickness(coarse, coarse.surface.flat(nearest, weights)))
        found = self._near_places(coarse.points)
        np.minimum.at(found, coarse.triangles, by_triangle[:, None])
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            places = coarse.spans @ np.array([1.0 - share, share])
            by_arc = turn / np.maximum(coarse.lines.curvature(coarse.curves, places), 1e-300)
            np.minimum.at(found, coarse.arcs, by_arc[:, None])
        return self._graded(coarse.points, edges, np.maximum(found, _SMALLEST * self._diagonal))

    def _near_places(self, points: Array) -> Array:
        """Return the largest edges (n,) at points, which are shorter near the places of the sizes."""
        found = np.full(len(points), self._sizes.largest)
        for *place, length in self._sizes.places.tolist():
            np.minimum(found, length + self._sizes.growth * np.linalg.norm(points - place, axis=1), out=found)
        return found

    def _graded(self, points: Array, edges: Edges, lengths: Array) -> Array:
        """Return lengths (n,) that grow as the sizes say along edges at most."""
        steps = self._sizes.growth * np.linalg.norm(points[edges.ends[:, 0]] - points[edges.ends[:, 1]], axis=1)
        for _ in range(_SWEEPS):
            before = lengths.copy()
            np.minimum.at(lengths, edges.ends, before[edges.ends[:, ::-1]] + steps[:, None])
            if (lengths == before).all():
                break
        return lengths

    def _thickness(self, coarse: Coarse, middles: Array) -> Array:
        """Return the thickness (m,) of the solids beside coarse triangles, at their middles (m, 3)."""
        found = np.full(len(middles), self._diagonal)
        for side, sign in ((0, -1.0), (1, 1.0)):
            chosen = np.flatnonzero(self._sides[coarse.faces, side])
            ways = sign * coarse.up[chosen]
            origins = np.ascontiguousarray(middles[chosen] + 1e-4 * self._diagonal * ways)
            hit, lengths, _ = self._tree.intersect_ray_first(
                self._points, self._triangles, origins, np.ascontiguousarray(ways)
            )
            met = np.asarray(hit).ravel() >= 0
            found[chosen[met]] = np.minimum(found[chosen[met]], np.asarray(lengths).ravel()[met])
        return found
