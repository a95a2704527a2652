"""PartSurface: the mesh of a part, whose faces are found by group, by a nearby point, or up to sharp edges."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import igl
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray
from ..display import Brief
from .geometry import connected, directed_edges, normals_and_areas
from .groups import Groups
from .nearest import shares_of

NEAR = 1e-6  # of the box's diagonal: triangles whose distances differ by less are equally near
THIN = 1e-6  # of the box's diagonal: the normal of a lower triangle is rounding
TIED = 1e-9  # of the box's diagonal: the same where no normal is given, which could prefer a farther one
SHARP = 30.0  # degrees
ROUNDING = 1e-12  # of a cosine: an edge that bends by just the angle is crossed
# A triangle whose cosine with a point's normal is less than ASIDE belongs to another face of the part, if one that
# agrees better lies within FAR, a share of the box's diagonal: a round wall is off the flat triangles of a coarse mesh.
ASIDE, FAR = 0.5, 0.05
CHORD = (
    12.0  # degrees between triangles that may be chords of one curved face: readers of CAD make 6, exporters 5 to 10
)
_ALIKE = 2.0  # cells of a normal's coordinates in [0, 1]: normals in one cell share a search


@dataclass(frozen=True, eq=False, repr=False)
class PartSurface(Brief):
    """The triangle mesh of a part, as it was read, with its groups.

    `Surface.part` and `BoundaryMap.part` return it, `read_part` reads it from boundary.npz.

    Attributes
    ----------
    vertices : (n, 3) array
        In the user's units.
    faces : (m, 3) array of int
        Vertex numbers of the triangles, outward.
    groups : dict of str to array of int
        The triangles of each group of the input, ascending.

    Examples
    --------
    >>> import iga_nn
    >>> cube = iga_nn.sample("cube").part
    >>> top = cube.flood(int(cube.nearest([[0.4, 0.3, 1.0]])[0]))
    >>> len(cube.faces), len(top), round(cube.area(top), 12)
    (3072, 512, 1.0)
    """

    vertices: Array
    faces: IntArray
    groups: Groups

    def group(self, name: str) -> IntArray:
        """Return the triangles (k,) of a group. Raises ValueError, which lists the groups, where there is none."""
        if name in self.groups:
            return self.groups[name]
        known = ", ".join(self.groups) or "none"
        raise ValueError(f"group {name!r:.80} does not exist; the mesh has these groups: {known:.400}")

    def area(self, triangles: IntArray) -> float:
        """Return the area of triangles (k,) in the user's units."""
        return float(normals_and_areas(self.vertices, self.faces[triangles])[1].sum())

    def nearest(self, points: ArrayLike, normals: ArrayLike | None = None) -> IntArray:
        """Return the triangle (k,) that is nearest to each of the points (k, 3).

        normals: (k, 3), of any length. Of triangles that are equally near, as on both sides of an edge, the one whose
        outward normal agrees best with the given one is taken; a triangle that is turned away by more than 60 degrees
        only where none that agrees better is near, as beside the rim of a bore. Without normals it is the one with the
        lowest number.
        """
        from .part_kernels import best_aligned

        where = np.ascontiguousarray(points, dtype=np.float64)
        squared, index, _ = self._tree.squared_distance(self.vertices, self.faces, where)
        found = np.asarray(index, dtype=np.int64).reshape(-1)
        distance = np.sqrt(np.asarray(squared).reshape(-1))
        if normals is None:
            reach = distance + TIED * self._diagonal
            rows = zip(where, reach, found.tolist(), strict=True)
            return np.array([self._first(*row) for row in rows], dtype=np.int64)
        if not len(where):
            return found
        reach = distance + NEAR * self._diagonal
        given = np.ascontiguousarray(normals, dtype=np.float64)
        given = given / np.maximum(np.linalg.norm(given, axis=1, keepdims=True), np.finfo(np.float64).tiny)
        starts, around = self._around
        best = best_aligned(where, given, reach, found, self.vertices, self.faces, self.normals, starts, around)
        aside = np.flatnonzero(np.sum(self.normals[best] * given, axis=1) < ASIDE)
        cells = np.unique(np.round(_ALIKE * given[aside]), axis=0, return_inverse=True)[1].ravel()
        for cell in range(cells.max(initial=-1) + 1):
            own = aside[cells == cell]
            best[own] = self._alignment(where[own], given[own], best[own])
        return best

    def offsets(self, points: Array, normals: Array) -> Array:
        """Return how far (k,) the surface lies from points (k, 3), along their outward unit normals (k, 3).

        A triangle may be flat, or a chord of a curved surface: it is known no better. So points between it and the
        surface that bends with the neighbours' normals have the offset zero, others that to the nearer one.
        """
        from .part_kernels import nearest_in_triangles

        chosen = self.nearest(points, normals)
        corners = self.vertices[self.faces[chosen]]  # (k, 3, 3)
        feet = nearest_in_triangles(np.ascontiguousarray(points), self.vertices, self.faces[chosen])
        flat = np.sum((feet - points) * normals, axis=1)
        above = np.einsum("kca,kca->kc", corners - feet[:, None], self._bent[chosen])  # of the corners' tangent planes
        lift = 0.5 * np.einsum("kc,kca->ka", shares_of(feet, corners) * above, self._bent[chosen])
        bent = flat + np.sum(lift * normals, axis=1)
        return np.where(flat * bent > 0.0, np.where(np.abs(flat) < np.abs(bent), flat, bent), 0.0)

    @cached_property
    def _bent(self) -> Array:
        """Return unit normals (m, 3, 3) at the corners of triangles: means over those there that bend by CHORD at most.

        The weights are their angles at the corner.
        """
        corners = self.vertices[self.faces]
        ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
        size = np.linalg.norm(np.cross(ahead, back), axis=2)
        angles = np.arctan2(size, np.sum(ahead * back, axis=2))  # (m, 3)
        starts, around = self._around
        corner_of = np.argsort(self.faces.ravel(), kind="stable") % 3
        vertices = self.faces.ravel()
        counts = np.diff(starts)[vertices]
        own = np.repeat(np.arange(len(vertices)), counts)  # pairs of a corner and a triangle there
        place = (
            np.repeat(starts[vertices], counts) + np.arange(len(own)) - np.repeat(np.cumsum(counts) - counts, counts)
        )
        other = around[place]
        near = np.sum(self.normals[own // 3] * self.normals[other], axis=1) >= np.cos(np.radians(CHORD))
        weights = np.where(near, angles[other, corner_of[place]], 0.0)
        sums = [np.bincount(own, weights * self.normals[other, a], len(vertices)) for a in range(3)]
        total = np.stack(sums, axis=1).astype(np.float64)
        total = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), np.finfo(np.float64).tiny)
        return total.reshape(-1, 3, 3)

    def _first(self, point: Array, reach: float, found: int) -> int:
        """Return the lowest number of the triangles at the corners of one that lie within `reach` of a point (3,)."""
        from .part_kernels import distance

        starts, around = self._around
        near = {int(t) for corner in self.faces[found] for t in around[starts[corner] : starts[corner + 1]]}
        return min((t for t in near if distance(point, self.vertices, self.faces[t]) <= reach), default=found)

    def _alignment(self, points: Array, normals: Array, best: IntArray) -> IntArray:
        """Return the triangles (k,) near points (k, 3) that face as normals (k, 3), all much alike; else `best`."""
        middle = normals.mean(axis=0)
        rows = np.flatnonzero(self.normals @ (middle / np.linalg.norm(middle)) > 0.5 * ASIDE)
        if not len(rows):
            return best
        squared, index, _ = igl.point_mesh_squared_distance(points, self.vertices, self.faces[rows])
        found = rows[np.asarray(index).ravel()]
        fine = np.sqrt(np.asarray(squared).ravel()) <= FAR * self._diagonal
        return np.where(fine & (np.sum(self.normals[found] * normals, axis=1) >= ASIDE), found, best)

    def flood(self, triangle: int, angle: float = SHARP) -> IntArray:
        """Return the triangles (k,), ascending, reached from one across edges that bend by at most `angle` degrees.

        Raises ValueError where there is no such triangle.
        """
        if not 0 <= triangle < len(self.faces):
            raise ValueError(f"triangle must lie between 0 and {len(self.faces) - 1}, got {triangle}")
        sides = self._neighbours
        first, side = np.nonzero(sides >= 0)
        second = sides[first, side]
        smooth = np.sum(self.normals[first] * self.normals[second], axis=1) >= np.cos(np.radians(angle)) - ROUNDING
        label = connected(np.stack([first[smooth], second[smooth]], axis=1), len(self.faces))
        return np.flatnonzero(label == label[triangle])

    @cached_property
    def _diagonal(self) -> float:
        used = self.vertices[self.faces.ravel()]
        return float(np.linalg.norm(np.ptp(used, axis=0)))

    @cached_property
    def _tree(self) -> Any:
        """Return the tree of boxes that finds nearest triangles."""
        tree = igl.AABB()
        tree.init(self.vertices, self.faces)
        return tree

    @cached_property
    def _neighbours(self) -> IntArray:
        """Return the triangle across each side 0-1, 1-2, 2-0 of each triangle (m, 3), -1 where there is none."""
        sides = np.sort(directed_edges(self.faces), axis=1)
        order = np.lexsort(sides.T)
        same = np.flatnonzero(np.all(sides[order[1:]] == sides[order[:-1]], axis=1))
        found = np.full(3 * len(self.faces), -1, dtype=np.int64)
        found[order[same]], found[order[same + 1]] = order[same + 1] // 3, order[same] // 3
        return found.reshape(-1, 3)

    @cached_property
    def normals(self) -> Array:
        """Return unit normals (m, 3); a triangle that is too low takes its neighbour's at the longest side."""
        normals, areas = normals_and_areas(self.vertices, self.faces)
        corners = self.vertices[self.faces]
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)  # (m, 3)
        longest = lengths.argmax(axis=1)
        across = self._neighbours[np.arange(len(longest)), longest]
        thin = (2.0 * areas <= THIN * self._diagonal * lengths.max(axis=1)) & (across >= 0)
        source = np.where(thin, across, np.arange(len(longest)))
        for _ in range(4):  # slivers beside slivers: twice as far each time
            source = source[source]
        return normals[source]

    @cached_property
    def _around(self) -> tuple[IntArray, IntArray]:
        """Return where the triangles at each vertex begin (n + 1,), and these triangles, vertex by vertex (3 m,)."""
        order = np.argsort(self.faces.ravel(), kind="stable")
        counts = np.bincount(self.faces.ravel(), minlength=len(self.vertices))
        return np.concatenate([[0], np.cumsum(counts)]), order // 3
