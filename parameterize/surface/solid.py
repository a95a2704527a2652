"""The solid inside a closed surface: which points lie inside, rays, depths, and the points of a lattice inside."""

from collections.abc import Iterator
from functools import cached_property
from itertools import product
from typing import Any

import igl
import numpy as np

from ..arrays import Array, IntArray, Mask
from .geometry import normals_and_areas
from .triangle_tree import TriangleTree

_ACCURACY = 2.0  # of the fast winding number
_NUDGES = 1e-5 * np.array([[0.61, -0.32, 0.72], [-0.48, 0.79, 0.38]])  # a ray through an edge or a corner meets nothing
_SMALL = 8  # lattice points along a part of the lattice that is not halved further
_ROUNDING = 1e-6  # error of a distance, in cells
_CELLS = 16  # of `deepest` along the box's longest side, at the first level
_TOLERANCE = 1e-3  # share of the depth
_MOST_CELLS = 4000  # kept at a level; only sheets thinner than a hundredth of the box reach it
_FEW = 2000  # triangles: compiled code takes longer to load than libigl to search them
_LEVELS = 16  # of halving, at most
# Of the 26 directions to the neighbours of a lattice point one of each pair of opposite ones: its first part is 1.
DIRECTIONS = [(x, y, z) for x, y, z in product((0, 1, -1), repeat=3) if (x, y, z) > (0, 0, 0)]


class Solid:
    """The solid inside a closed surface that is wound outward.

    Parameters
    ----------
    vertices : (n, 3) array
    faces : (m, 3) array of int
    """

    def __init__(self, vertices: Array, faces: IntArray) -> None:
        self._vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self._faces = np.ascontiguousarray(faces, dtype=np.int64)

    @cached_property
    def _tree(self) -> Any:
        """Return the tree of boxes that finds the triangles on rays, and the nearest ones of few."""
        tree = igl.AABB()
        tree.init(self._vertices, self._faces)
        return tree

    @cached_property
    def _triangles(self) -> TriangleTree:
        """Return the tree that finds nearest triangles of many."""
        return TriangleTree(self._vertices, self._faces)

    @cached_property
    def _winding(self) -> Any:
        """Return the tree of dipoles that sums winding numbers."""
        winding = igl.FastWindingNumberBVH()
        winding.init(self._vertices, self._faces)
        return winding

    def winding_numbers(self, points: Array) -> Array:
        """Return how often the surface winds around points (n, 3): (n,), about 1 inside and 0 outside."""
        return np.asarray(self._winding.winding_number(np.ascontiguousarray(points), _ACCURACY)).ravel()

    def contains(self, points: Array) -> Mask:
        """Return which points (..., 3) lie inside (...)."""
        return np.asarray(self.winding_numbers(points.reshape(-1, 3)) > 0.5).reshape(points.shape[:-1])

    def depths(self, points: Array) -> Array:
        """Return the distances (n,) of points (n, 3) from the surface."""
        return np.sqrt(self.squared_depths(points))

    def squared_depths(self, points: Array) -> Array:
        """Return the squared distances (n,) of points (n, 3) from the surface."""
        if len(self._faces) > _FEW:
            return self._triangles.nearest(points)[0]
        squares = self._tree.squared_distance(self._vertices, self._faces, np.ascontiguousarray(points))[0]
        return np.asarray(squares).ravel()

    def signed_distances(self, points: Array) -> Array:
        """Return the distances (n,) of points (n, 3) from the surface, negative inside, to some thousandths."""
        kind = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
        return np.asarray(igl.signed_distance(points, self._vertices, self._faces, sign_type=kind)[0])

    def rays(self, points: Array, directions: Array) -> Array:
        """Return the distances (...) from points (..., 3) to the surface along unit vectors (..., 3).

        Of a ray that meets nothing, as those of points outside may, it is the diagonal of the surface's box.
        """
        shape = np.broadcast_shapes(points.shape, directions.shape)
        origins, ways = (np.ascontiguousarray(np.broadcast_to(x, shape).reshape(-1, 3)) for x in (points, directions))
        lengths = np.full(len(origins), float(np.linalg.norm(np.ptp(self._vertices, axis=0))))
        for nudge in _NUDGES:
            hit, distances, _ = self._tree.intersect_ray_first(self._vertices, self._faces, origins, ways + nudge)
            met = np.asarray(hit).ravel() >= 0
            lengths[met] = np.minimum(lengths, np.asarray(distances).ravel())[met]
        return lengths.reshape(shape[:-1])

    def deepest(self) -> tuple[Array, float]:
        """Return the point (3,) inside that is farthest from the surface, to a thousandth of its depth, and that depth.

        Branch and bound over cells: the signed distance changes by at most the distance between two points, so a cell
        whose centre's depth plus half its diagonal falls short of the best depth cannot hold the deepest point.
        Deterministic.
        """
        low, high = self._vertices.min(axis=0), self._vertices.max(axis=0)
        side = float((high - low).max()) / _CELLS
        counts = np.maximum(np.ceil((high - low) / side - 1e-9).astype(int), 1)
        axes = [at + side * (np.arange(n) - (n - 1) / 2) for at, n in zip((low + high) / 2, counts, strict=True)]
        centers = _grid(axes)  # (cells, 3)
        octants = _grid([np.array([-0.25, 0.25])] * 3)
        best, depth = centers[0], -np.inf
        for _ in range(_LEVELS):
            distance = self.depths(centers)
            distance[~self.contains(centers)] *= -1.0
            top = int(np.argmax(distance))
            if distance[top] > depth:
                best, depth = centers[top], float(distance[top])
            reach = distance + side * np.sqrt(3.0) / 2.0
            hopeful = np.flatnonzero(reach > max(depth, 0.0) * (1.0 + _TOLERANCE))
            if not len(hopeful):
                break
            hopeful = hopeful[np.argsort(-reach[hopeful], kind="stable")[:_MOST_CELLS]]
            centers = (centers[hopeful, None] + side * octants).reshape(-1, 3)
            side /= 2.0
        return best, depth

    def lattice(self, cell: float) -> Array:
        """Return the points (k, 3) inside of a lattice whose neighbours are `cell` apart, one of them at the origin."""
        points = np.asarray(self.lattice_near(cell, 0.0) * cell, dtype=np.float64)
        return points[self.contains(points)]

    def lattice_near(self, cell: float, margin: float) -> IntArray:
        """Return the integer coordinates (k, 3), ascending, of all lattice points inside, and of some beside the solid.

        The bounding box, extended by `margin`, is halved until a part is small, or farther than `margin` from the box
        or plane of every triangle. Such far parts are kept only inside the surface: a thin body that is not parallel to
        the axes fills little of its box.
        """
        corners = self._vertices[self._faces]
        grown = np.stack([corners.min(axis=1) - margin, corners.max(axis=1) + margin], axis=1) / cell  # (m, 2, 3)
        normals, _ = normals_and_areas(self._vertices, self._faces)
        heights = (normals * corners[:, 0]).sum(axis=1) / cell
        low, high = np.floor(grown[:, 0].min(axis=0)).astype(int), np.ceil(grown[:, 1].max(axis=0)).astype(int)
        kept, parts = [], [(low, high, np.arange(len(self._faces)))]
        while parts:
            low, high, near = parts.pop()
            near = near[((grown[near, 0] <= high) & (grown[near, 1] >= low)).all(axis=1)]
            off = np.abs(normals[near] @ (low + high) / 2.0 - heights[near])
            near = near[off <= np.abs(normals[near]) @ (high - low) / 2.0 + margin / cell + _ROUNDING]
            if not len(near) and self.winding_numbers(cell * low[None].astype(float))[0] < 0.5:
                continue
            axis = int((high - low).argmax())
            middle = (low[axis] + high[axis]) // 2
            if not len(near) or high[axis] - low[axis] < _SMALL:
                kept.append(_grid([np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]))
                continue
            below, above = high.copy(), low.copy()
            below[axis], above[axis] = middle, middle + 1
            parts += [(low, below, near), (above, high, near)]
        index = np.concatenate(kept)
        return index[np.lexsort(index.T[::-1])]


def _grid(axes: list[Any]) -> Any:
    """Return all points (k, 3) with a coordinate of each of three rows."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def inside_of(corners: Array, shape: tuple[int, int, int]) -> Mask:
    """Return which lattice points lie inside the surface, (n_x, n_y, n_z): whose winding number is above 0.

    Parameters
    ----------
    corners : (m, 3, 3) array
        Of triangles that are wound outward, in cells: lattice points have whole coordinates from 0.
    shape : three int
        The numbers of lattice points.
    """
    links, signs = crossed_links(corners, (1, 0, 0))
    change = np.zeros(shape, dtype=np.int16)
    np.add.at(change, (links[:, 0] + 1, links[:, 1], links[:, 2]), signs)
    return np.cumsum(change, axis=0, dtype=np.int16) > 0


def crossed_pairs(corners: Array, inside: Mask) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield, for each direction, the pairs (k, 3), (k, 3) of neighbours inside between which the surface passes."""
    for direction in DIRECTIONS:
        first = crossed_links(corners, direction)[0]
        second = first + np.array(direction)
        both = inside[tuple(first.T)] & inside[tuple(second.T)]
        yield first[both], second[both]


def crossed_links(corners: Array, direction: tuple[int, int, int]) -> tuple[IntArray, IntArray]:
    """Return the links that the surface crosses by their first points (k, 3), and the senses of the crossings (k,).

    A link leads from a lattice point to the next one along the direction, whose first component that is not 0 is 1.
    The sense is 1 where it leads into the body. Each triangle is divided into lines of the lattice as in the drawing
    of polygons on a screen: half-open intervals, whose ends are computed alike for both triangles of an edge, so no
    line slips through between two triangles.
    """
    pivot = direction.index(1)
    others = [axis for axis in range(3) if axis != pivot]
    along = corners[:, :, pivot]
    across = np.stack([corners[:, :, axis] - direction[axis] * along for axis in others], axis=-1)  # (m, 3, 2)
    owner, row = _numbered(np.ceil(across[:, :, 0].min(axis=1)), np.ceil(across[:, :, 0].max(axis=1)))
    low, high = _interval(across[owner], row)
    part, column = _numbered(np.ceil(low), np.ceil(high))
    owner, row = owner[part], row[part]
    a, b, c = np.moveaxis(across[owner], 1, 0)
    doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    x, y = row - a[:, 0], column - a[:, 1]
    safe = np.where(doubled == 0.0, 1.0, doubled)
    to_b = (x * (c[:, 1] - a[:, 1]) - y * (c[:, 0] - a[:, 0])) / safe
    to_c = (y * (b[:, 0] - a[:, 0]) - x * (b[:, 1] - a[:, 1])) / safe
    heights = along[owner]
    place = heights[:, 0] + to_b * (heights[:, 1] - heights[:, 0]) + to_c * (heights[:, 2] - heights[:, 0])
    place = np.clip(place, heights.min(axis=1), heights.max(axis=1))  # slivers: rounding does not lead away
    first = np.empty((len(row), 3), dtype=np.int64)
    first[:, pivot] = np.floor(place)
    for axis, line in zip(others, (row, column), strict=True):
        first[:, axis] = line + direction[axis] * first[:, pivot]
    turn = -1 if pivot != 1 else 1  # the others, in ascending order, are right-handed about the axis unless it is y
    return first, (turn * np.sign(doubled)).astype(np.int64)


def _numbered(begin: Array, end: Array) -> tuple[IntArray, IntArray]:
    """Return the whole numbers of half-open intervals [begin, end), (k,), with the interval of each."""
    first = begin.astype(np.int64)
    counts = np.maximum(end.astype(np.int64) - first, 0)
    owner = np.repeat(np.arange(len(first)), counts)
    return owner, first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


def _interval(triangles: Array, row: IntArray) -> tuple[Array, Array]:
    """Return where the lines x = row (k,) of the plane enter and leave triangles (k, 3, 2)."""
    low, high = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        p, q = triangles[:, i], triangles[:, j]
        swap = (p[:, 0] > q[:, 0])[:, None]
        p, q = np.where(swap, q, p), np.where(swap, p, q)
        meets = (np.ceil(p[:, 0]) <= row) & (row < np.ceil(q[:, 0]))
        width = np.where(meets, q[:, 0] - p[:, 0], 1.0)
        y = p[:, 1] + (row - p[:, 0]) / width * (q[:, 1] - p[:, 1])
        low = np.where(meets, np.minimum(low, y), low)
        high = np.where(meets, np.maximum(high, y), high)
    return low, high
