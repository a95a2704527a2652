"""A patch of triangles that fills a loop of edges, as fine as the mesh around it, smooth where the loop is not plane.

The loop is triangulated with the least area, the triangles are divided and their edges flipped until they are as large
as the loop's edges, and the new vertices are moved to the thin plate through the loop that goes on as the mesh beside
it does (Liepa, "Filling holes in meshes", SGP 2003; the plate with cotangents: Botsch, Kobbelt, "An intuitive framework
for real-time freeform modeling", SIGGRAPH 2004). In a plane loop the patch is plane.
"""

import igl
import numpy as np
from scipy.sparse import coo_array, diags_array

from ..arrays import Array, IntArray, Mask
from .geometry import directed_edges, normals_and_areas
from .triangulation import triangulate

MOST_EDGES = 2000  # of a loop: the time of its triangulation grows with the cube, some ten seconds here
LONG = 1.4  # times the edges around: longer edges are halved; then the halves are not shorter than 0.7 of them
PLANE = 1e-3  # share of its diameter by which a plane loop may leave its plane
BENT = 1e-9  # radians beyond a straight angle: edges are flipped where the opposite angles exceed it
PASSES = 2  # of the plate: the second lies half as far from a ball as the first, further ones hardly nearer
STEEPEST = 5.0  # cotangent over two, of a corner of 6 degrees: thinner triangles outside would outweigh all others
MOST_FLIPS = 40  # rounds after each division; each makes the triangles rounder


def fill(points: Array, faces: IntArray, loop: IntArray) -> tuple[Array, IntArray]:
    """Return new vertices (k, 3) and the triangles (t, 3) that fill a loop of vertices (n,), wound along it.

    points: (n, 3) and faces: (m, 3), the mesh around the loop. New vertices are numbered from len(points) on.
    """
    ring = points[loop]
    triangles = triangulate(ring, [list(range(len(loop)))], MOST_EDGES)
    nearby = faces[np.isin(faces, loop).any(axis=1)]
    places = np.full(len(points), -1)
    places[loop] = np.arange(len(loop))
    taken = np.sort(places[directed_edges(nearby)], axis=1)  # edges of the mesh between vertices of the loop
    patch = _Patch(ring, triangles, taken[taken[:, 0] >= 0])
    patch.refine()
    added = patch.points[len(loop) :]
    numbers = np.concatenate([loop, len(points) + np.arange(len(added))])
    filled = numbers[patch.faces]
    if len(added) and not _is_plane(ring):
        added = _plate(np.concatenate([points, added]), np.concatenate([nearby, filled]), len(points), loop)
    return added, filled


def _is_plane(ring: Array) -> bool:
    """Return whether the points (n, 3) of a loop lie in a plane."""
    centered = ring - ring.mean(axis=0)
    normal = np.linalg.svd(centered, full_matrices=False)[2][2]
    return bool(abs(centered @ normal).max() <= PLANE * np.ptp(ring, axis=0).max())


def _plate(points: Array, faces: IntArray, fixed: int, loop: IntArray) -> Array:
    """Return the vertices from number `fixed` on, moved so that the mean curvature is least in the sum of squares.

    The curvature vector is that of the cotangent formula, at new vertices and at the loop; lengths and angles are those
    of the last pass, which makes the sum quadratic.
    """
    from scipy.sparse.linalg import splu

    places, n = points.copy(), len(points)
    counted = np.concatenate([np.sort(loop), np.arange(fixed, n)])
    starts, ends = faces[:, [1, 2, 0]].ravel(), faces[:, [2, 0, 1]].ravel()  # opposite the corners
    for _ in range(PASSES):
        weights = np.clip(np.nan_to_num(igl.cotmatrix_entries(places, faces)), 0.0, STEEPEST).ravel()
        half = coo_array((weights, (starts, ends)), shape=(n, n)).tocsr()
        laplacian = half + half.T - diags_array((half + half.T).sum(axis=1))
        _, areas = normals_and_areas(places, faces)
        around = np.bincount(faces.ravel(), np.repeat(areas / 3.0, 3), minlength=n)[counted]
        rows = (diags_array(1.0 / np.sqrt(np.maximum(around, 1e-300))) @ laplacian[counted]).tocsc()
        moving, held = rows[:, fixed:], rows[:, :fixed]
        places[fixed:] = splu((moving.T @ moving).tocsc()).solve(np.asarray(-moving.T @ (held @ places[:fixed])))
    return places[fixed:]


class _Patch:
    """The triangles of a loop whose first vertices are those of the loop, while they are divided.

    taken: (k, 2), pairs of the loop's vertices, ascending, that have an edge of the mesh, which the patch must not have
    a second time inside.
    """

    def __init__(self, ring: Array, faces: IntArray, taken: IntArray) -> None:
        sides = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
        self.points, self.faces = ring, faces
        self.size = 0.5 * (sides + np.roll(sides, 1))  # of the edges wanted at each vertex
        self.taken = {(int(a), int(b)) for a, b in taken.tolist()}

    def refine(self) -> None:
        """Divide the triangles until no edge inside is long or taken."""
        while True:
            edges, owners = self._inside()
            long = self._lengths(edges) > LONG * self.size[edges].mean(axis=1)
            long |= np.array([(int(a), int(b)) in self.taken for a, b in edges.tolist()], dtype=bool)
            if not long.any():
                return
            self._divide(edges, owners, long)
            for _ in range(MOST_FLIPS):
                if not self._flip():
                    break

    def _inside(self) -> tuple[IntArray, IntArray]:
        """Return the edges inside (e, 2), ascending, and their two sides (e, 2): side 3 i + k of face i runs from its
        corner k to the next.
        """
        sides = np.sort(directed_edges(self.faces), axis=1)
        order = np.lexsort(sides.T)
        same = np.flatnonzero(np.all(np.diff(sides[order], axis=0) == 0, axis=1))
        return sides[order[same]], np.stack([order[same], order[same + 1]], axis=1)

    def _lengths(self, edges: IntArray) -> Array:
        return np.linalg.norm(self.points[edges[:, 1]] - self.points[edges[:, 0]], axis=1)

    def _divide(self, edges: IntArray, owners: IntArray, chosen: Mask) -> None:
        """Halve the chosen edges that are the longest chosen ones of both their faces."""
        first = _foremost(owners // 3, self._lengths(edges), chosen, len(self.faces))
        number = len(self.points) + np.arange(len(first))
        ends = edges[first]
        self.points = np.concatenate([self.points, self.points[ends].mean(axis=1)])
        self.size = np.concatenate([self.size, self.size[ends].mean(axis=1)])
        sides = owners[first].ravel()
        face, corner, middle = sides // 3, sides % 3, np.repeat(number, 2)
        a, b, c = (self.faces[face, (corner + k) % 3] for k in range(3))
        self.faces[face] = np.stack([a, middle, c], axis=1)
        self.faces = np.concatenate([self.faces, np.stack([middle, b, c], axis=1)])

    def _flip(self) -> bool:
        """Exchange the diagonals of pairs of triangles whose opposite angles exceed a straight one; False without."""
        edges, owners = self._inside()
        tips = self.faces.ravel()[3 * (owners // 3) + (owners + 2) % 3]  # (e, 2), opposite the edge
        excess = self._angles(edges, tips).sum(axis=1) - np.pi
        pairs = np.sort(tips, axis=1)
        held = {*self.taken, *map(tuple, np.sort(directed_edges(self.faces), axis=1).tolist())}
        free = np.array([(int(a), int(b)) not in held for a, b in pairs.tolist()], dtype=bool)
        first = _foremost(owners // 3, excess, free & (excess > BENT), len(self.faces))
        if not len(first):
            return False
        sides = owners[first]
        a, b = (self.faces.ravel()[3 * (sides[:, 0] // 3) + (sides[:, 0] + k) % 3] for k in (0, 1))
        c, d = tips[first].T
        _, once = np.unique(np.sort(np.stack([c, d], axis=1), axis=1), axis=0, return_index=True)
        a, b, c, d, sides = a[once], b[once], c[once], d[once], sides[once]
        self.faces[sides[:, 0] // 3] = np.stack([a, d, c], axis=1)
        self.faces[sides[:, 1] // 3] = np.stack([d, b, c], axis=1)
        return True

    def _angles(self, edges: IntArray, tips: IntArray) -> Array:
        """Return the angles (e, 2) of the two triangles at an edge that are opposite the edge."""
        apex = self.points[tips]
        u, v = (self.points[edges[:, k]][:, None] - apex for k in (0, 1))
        return np.arctan2(np.linalg.norm(np.cross(u, v), axis=2), np.sum(u * v, axis=2))


def _foremost(faces: IntArray, values: Array, chosen: Mask, count: int) -> IntArray:
    """Return the chosen edges with the largest value in both their faces (e, 2), so that no two share a face."""
    rank = np.empty(len(values), dtype=np.int64)
    rank[np.argsort(values, kind="stable")] = np.arange(len(values))
    rank[~chosen] = -1
    best = np.full(count, -1)
    for column in faces.T:
        np.maximum.at(best, column, rank)
    return np.flatnonzero(chosen & np.all(best[faces] == rank[:, None], axis=1))
