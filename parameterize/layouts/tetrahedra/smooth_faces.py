"""The smooth surface through the vertices of a triangle mesh, face by face.

Each triangle is a cubic one that has the normals at its corners (Vlachos, Peters, Boyd, Mitchell, "Curved PN
triangles", I3D 2001), so that facets of a coarse tessellation do not show.
"""

from functools import cached_property
from typing import Any

import igl
import numpy as np

from ...arrays import Array, IntArray
from ...surface.nearest import shares_of
from .outline import STRAY, Outline


class SmoothFaces:
    """The smooth faces of a mesh: points (n, 3), triangles (m, 3), and their outline."""

    def __init__(self, points: Array, triangles: IntArray, outline: Outline) -> None:
        self._corners = points[triangles]
        self._normals = outline.normals
        self._points, self._triangles = np.ascontiguousarray(points), triangles
        self._reach = STRAY * float(np.linalg.norm(np.ptp(points, axis=0)))
        order = np.argsort(outline.labels, kind="stable")
        self._of_face = np.split(order, np.cumsum(np.bincount(outline.labels))[:-1])
        self._trees: dict[int, Any] = {}

    def _tree(self, face: int) -> tuple[Any, IntArray]:
        """Return the tree of the boxes of a face's triangles, and these."""
        if face not in self._trees:
            tree, rows = igl.AABB(), np.ascontiguousarray(self._triangles[self._of_face[face]])
            tree.init(self._points, rows)
            self._trees[face] = tree, rows
        found: tuple[Any, IntArray] = self._trees[face]
        return found

    def nearest(self, points: Array, faces: IntArray) -> tuple[IntArray, Array]:
        """Return the triangles (k,) of faces (k,) nearest to points (k, 3), and the weights (k, 3) of their corners."""
        triangles, feet = np.zeros(len(points), dtype=np.int64), points.copy()
        for face in np.unique(faces).tolist():
            chosen = np.flatnonzero(faces == face)
            tree, rows = self._tree(face)
            _, index, foot = tree.squared_distance(self._points, rows, np.ascontiguousarray(points[chosen]))
            triangles[chosen] = self._of_face[face][np.asarray(index).ravel()]
            feet[chosen] = foot
        return triangles, shares_of(feet, self._corners[triangles])

    def lifted(self, triangles: IntArray, weights: Array) -> Array:
        """Return the points (k, 3) of the smooth surface over points of triangles."""
        flat = self.flat(triangles, weights)
        cubic = np.einsum("kc,kcx->kx", _powers(weights), self._controls[triangles])
        lift = cubic - flat
        size = np.linalg.norm(lift, axis=1)
        return np.asarray(flat + lift * np.minimum(1.0, self._reach / np.maximum(size, 1e-300))[:, None])

    def flat(self, triangles: IntArray, weights: Array) -> Array:
        """Return the points (k, 3) of triangles."""
        return np.asarray(np.einsum("ki,kix->kx", weights, self._corners[triangles]))

    def onto(self, points: Array, faces: IntArray) -> Array:
        """Return the points (k, 3) of the smooth faces (k,) near to points (k, 3)."""
        return self.lifted(*self.nearest(points, faces))

    def thirds(self, ends: Array, faces: IntArray) -> tuple[Array, Array]:
        """Return the points (k, 3) at one and two thirds of the way along faces between ends (k, 2, 3) on these.

        They are those of the arc that is tangent to the face at both ends: cubic interpolation there is far better than
        at the points nearest to the thirds of the chord.
        """
        chord = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(chord, axis=1)
        ways = chord / length[:, None]
        slopes = []
        for end in (0, 1):
            up = self.normals(*self.nearest(ends[:, end], faces))
            flat = ways - np.einsum("kx,kx->k", ways, up)[:, None] * up
            size = np.linalg.norm(flat, axis=1)  # the cosine of half the angle of the arc
            slopes.append(flat * (2.0 * length / np.maximum(size * (1.0 + size), 0.5))[:, None])
        cubic = [(20.0 * ends[:, 0] + 7.0 * ends[:, 1] + 4.0 * slopes[0] - 2.0 * slopes[1]) / 27.0]
        cubic.append((7.0 * ends[:, 0] + 20.0 * ends[:, 1] + 2.0 * slopes[0] - 4.0 * slopes[1]) / 27.0)
        return self.onto(cubic[0], faces), self.onto(cubic[1], faces)

    def normals(self, triangles: IntArray, weights: Array) -> Array:
        """Return the normals (k, 3) of the smooth surface at points of triangles."""
        sums = np.einsum("ki,kix->kx", weights, self._normals[triangles])
        return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-300)[:, None])

    @cached_property
    def _controls(self) -> Array:
        """Return the Bezier points (m, 10, 3) of the cubic triangles, in the order of `_powers`."""
        corners, normals = self._corners, self._normals
        own, other = np.array([0, 0, 1, 1, 2, 2]), np.array([1, 2, 0, 2, 0, 1])
        steps = corners[:, other] - corners[:, own]
        heights = np.einsum("mex,mex->me", steps, normals[:, own])
        edges = corners[:, own] + (steps - heights[..., None] * normals[:, own]) / 3.0
        middle = 1.5 * edges.mean(axis=1) - 0.5 * corners.mean(axis=1)
        return np.concatenate([corners, edges, middle[:, None]], axis=1)

    @cached_property
    def curvatures(self) -> Array:
        """Return the largest curvature (m,) along the edges of each triangle."""
        steps = np.roll(self._corners, -1, axis=1) - self._corners
        turns = np.roll(self._normals, -1, axis=1) - self._normals
        squares = np.maximum(np.einsum("mex,mex->me", steps, steps), 1e-300)
        return np.asarray(np.abs(np.einsum("mex,mex->me", turns, steps) / squares).max(axis=1))


def _powers(weights: Array) -> Array:
    """Return the cubic Bernstein polynomials (k, 10) at barycentric weights (k, 3)."""
    a, b, c = weights.T
    return np.stack(
        [
            *(a**3, b**3, c**3),
            *(3 * a**2 * b, 3 * a**2 * c, 3 * b**2 * a, 3 * b**2 * c, 3 * c**2 * a, 3 * c**2 * b),
            6 * a * b * c,
        ],
        axis=1,
    )
