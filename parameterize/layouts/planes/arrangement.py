"""Cuts the box around a body along the planes of its faces, and keeps the convex cells inside of the body.

Each plane cuts all cells that it crosses, so that neighbouring cells have whole facets in common.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from ...arrays import Array
from ...surface.solid import Solid
from ..planar.polygons import edges_of
from .polyhedron import Polyhedron

NEAR = 1e-5  # of the diagonal: points this near to a plane lie in it, and this near to a vertex are the vertex
MOST_CELLS = 2000  # in the box: with more the planes do not divide the body into few blocks
_PARALLEL = 1e-6  # difference of two unit normals that are taken for one
_MARGIN = 0.1  # of the diagonal, between the body and the box
_BOX = -1  # the number of the planes of the box

Beside = Literal["upright", "waist_planes"]
Facet = tuple[int, tuple[int, ...]]  # the number of its plane, and its points, counterclockwise seen from outside
Cell = tuple[Facet, ...]


@dataclass(frozen=True, eq=False)
class Arrangement:
    """Convex cells that fill a body, with whole facets in common.

    Attributes
    ----------
    points : (n, 3) array
    cells : tuple of cells
    normals : (planes, 3) array
    offsets : (planes,) array
        x lies in plane i where normals[i] @ x = offsets[i].
    waist_planes : int
        The number of the first plane across which cells are never merged.
    """

    points: Array
    cells: tuple[Cell, ...]
    normals: Array
    offsets: Array
    waist_planes: int


def arrangement_of(body: Polyhedron, beside: Beside | None = None) -> Arrangement | None:
    """Return the cells of a body between the planes of its faces; None for more than MOST_CELLS.

    beside: cut along other planes, too; None is returned where all of these are planes of faces. "upright": through
    re-entrant edges, at right angles to the faces there. "waist_planes": through corners of four faces or more, as
    those below the chamfers of a block.
    """
    normals, offsets = _different_planes(body)
    count = len(normals)
    if beside is not None:
        planes = _upright(body) if beside == "upright" else _waist_planes(body)
        for normal, offset in planes:
            normals, offsets = _with(body, normals, offsets, normal, offset)
        if len(normals) == count:
            return None
    points, cells = _box(body)
    near = NEAR * body.diagonal
    for number, (normal, offset) in enumerate(zip(normals, offsets, strict=True)):
        points, cells = _cut(points, cells, number, points @ normal - offset, near)
        if len(cells) > MOST_CELLS:
            return None
    points = _snapped(points, body.vertices[body.corners], near)
    middles = np.array([points[sorted({i for _, ids in cell for i in ids})].mean(axis=0) for cell in cells])
    inside = Solid(body.vertices, body.triangles).contains(middles)
    first = count if beside == "waist_planes" else len(normals)
    return Arrangement(points, tuple(cells[k] for k in np.flatnonzero(inside)), normals, offsets, first)


def _different_planes(body: Polyhedron) -> tuple[Array, Array]:
    """Return normals (k, 3) and offsets (k,) of the planes of all faces, each plane once."""
    normals, offsets = list[Array](), list[float]()
    for number, loops in enumerate(body.loops):
        corners = body.vertices[[vertex for loop in loops for vertex in loop]]
        known = zip(normals, offsets, strict=True)
        if not any(np.abs(corners @ n - d).max() < NEAR * body.diagonal for n, d in known):
            normals.append(body.planes.normals[number])
            offsets.append(float(body.planes.offsets[number]))
    return np.array(normals), np.array(offsets)


def _with(body: Polyhedron, normals: Array, offsets: Array, normal: Array, offset: float) -> tuple[Array, Array]:
    """Return planes, normals (k, 3) and offsets (k,), with another one, unless it is among them."""
    sides = np.sign(normals @ normal)
    same = np.abs(sides[:, None] * normals - normal).max(axis=1) < _PARALLEL
    if np.any(same & (np.abs(sides * offsets - offset) < NEAR * body.diagonal)):
        return normals, offsets
    return np.vstack([normals, normal]), np.append(offsets, offset)


def _upright(body: Polyhedron) -> Iterator[tuple[Array, float]]:
    """Yield the planes through re-entrant edges at right angles to the faces there."""
    for one, other, a, b in body.edges:
        along = body.vertices[b] - body.vertices[a]
        if np.cross(body.planes.normals[one], body.planes.normals[other]) @ along >= 0.0:
            continue
        for face in (one, other):
            normal = np.cross(body.planes.normals[face], along)
            normal /= np.linalg.norm(normal)
            yield normal, float(normal @ body.vertices[a])


def _waist_planes(body: Polyhedron) -> Iterator[tuple[Array, float]]:
    """Yield planes through all corners of four faces or more, each through two edges there that have no common face.

    Those through most such corners come first, then those parallel to a face.
    """
    beside: dict[int, list[tuple[int, set[int]]]] = {}
    for one, other, a, b in body.edges:
        beside.setdefault(a, []).append((b, {one, other}))
        beside.setdefault(b, []).append((a, {one, other}))
    crowded = np.array([vertex for vertex in body.corners.tolist() if len(beside.get(vertex, ())) >= 4], dtype=np.int64)
    candidates = []
    for corner in crowded.tolist():
        for (b, faces), (c, others) in combinations(beside[corner], 2):
            normal = np.cross(body.vertices[b] - body.vertices[corner], body.vertices[c] - body.vertices[corner])
            if not faces & others and (size := np.linalg.norm(normal)) > 0.0:
                normal /= size
                offset = float(normal @ body.vertices[corner])
                near = np.abs(body.vertices[crowded] @ normal - offset) < NEAR * body.diagonal
                parallel = bool(np.abs(body.planes.normals @ normal).max() > 1.0 - _PARALLEL)
                candidates.append((int(near.sum()), parallel, normal, offset, set(crowded[near].tolist())))
    left = set(crowded.tolist())
    for *_, normal, offset, own in sorted(candidates, key=lambda row: row[:2], reverse=True):
        if own & left:
            left -= own
            yield normal, offset


def _box(body: Polyhedron) -> tuple[Array, list[Cell]]:
    """Return the corners (8, 3) of a box around the body, in the order 000, 001, ..., 111, and the box as a cell."""
    margin = _MARGIN * body.diagonal
    ends = np.stack([body.vertices.min(axis=0) - margin, body.vertices.max(axis=0) + margin])
    points = np.stack(np.meshgrid(*ends.T, indexing="ij"), axis=-1).reshape(-1, 3)
    rings = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return points, [tuple((_BOX, ring) for ring in rings)]


def _cut(points: Array, cells: list[Cell], plane: int, heights: Array, near: float) -> tuple[Array, list[Cell]]:
    """Return points and cells after a cut along a plane, over which the points have heights (n,)."""
    signs = np.where(np.abs(heights) <= near, 0, np.sign(heights)).astype(int).tolist()
    crossings: dict[tuple[int, int], int] = {}

    def crossing(a: int, b: int) -> int:
        return crossings.setdefault((min(a, b), max(a, b)), len(points) + len(crossings))

    parts: list[Cell] = []
    for cell in cells:
        own = {signs[i] for _, ids in cell for i in ids}
        if own >= {-1, 1}:
            parts += [_half(cell, plane, side, signs, crossing, len(points)) for side in (-1, 1)]
        else:
            parts.append(cell)
    if not crossings:
        return points, parts
    a, b = np.array(list(crossings)).T
    share = (heights[a] / (heights[a] - heights[b]))[:, None]
    return np.concatenate([points, (1.0 - share) * points[a] + share * points[b]]), parts


def _half(cell: Cell, plane: int, side: int, signs: list[int], crossing: Callable[[int, int], int], known: int) -> Cell:
    """Return the part of a cell on one side of a plane, closed by a facet in it.

    signs: of the `known` points. crossing: the number of the point between two points on different sides.
    """
    facets, rim = list[Facet](), dict[int, int]()
    for owner, ids in cell:
        kept = list[int]()
        for i, j in edges_of(ids):
            if signs[i] * side >= 0:
                kept.append(i)
            if signs[i] * signs[j] < 0:
                kept.append(crossing(i, j))
        if not any(i < known and signs[i] for i in kept):
            continue
        facets.append((owner, tuple(kept)))
        for i, j in edges_of(kept):
            if all(k >= known or signs[k] == 0 for k in (i, j)):
                rim[j] = i
    ring = [next(iter(rim))]
    while (after := rim[ring[-1]]) != ring[0]:
        ring.append(after)
    return (*facets, (plane, tuple(ring)))


def _snapped(points: Array, corners: Array, near: float) -> Array:
    """Return points (n, 3), those near a corner (k, 3) moved onto it."""
    gaps = np.linalg.norm(points[:, None] - corners[None], axis=2)
    nearest = gaps.argmin(axis=1)
    close = gaps[np.arange(len(points)), nearest] <= 10.0 * near
    return np.where(close[:, None], corners[nearest], points)
