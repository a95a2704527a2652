"""Distance fields of simple solids, how they are put together, and the triangles of the surface where they are zero.

A field is negative inside, zero on the surface and positive outside, and near the surface it is about the distance.
"""

from __future__ import annotations

from collections.abc import Callable

import igl
import numpy as np
import pyvista as pv
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Triangles = tuple[Array, IntArray]  # vertices (n, 3) and faces (m, 3), wound outward
Field = Callable[[Array], Array]  # points (n, 3) -> values (n,)
_STEP = 1e-4  # of the differences that give a slope
_MOVES = 4  # of Newton's method onto the surface
_FLATTEST = 0.1  # the squared slope is at least so large: at a crease it may vanish


def capsule(a: ArrayLike, b: ArrayLike, radius: float, end_radius: float | None = None) -> Field:
    """Return the field of all that is nearer than a radius to the segment from a to b; a ball where they are equal.

    With `end_radius` the radius at b is another one, and changes linearly on the way.
    """
    start, along = np.asarray(a, dtype=np.float64), np.subtract(b, a)
    square = max(float(along @ along), 1e-30)
    growth = 0.0 if end_radius is None else end_radius - radius

    def distance(points: Array) -> Array:
        share = np.clip((points - start) @ along / square, 0.0, 1.0)
        thickness = radius + growth * share if growth else radius
        return np.linalg.norm(points - start - share[:, None] * along, axis=1) - thickness

    return distance


def box(middle: ArrayLike, half: ArrayLike, rounding: float) -> Field:
    """Return the field of a box with rounded edges; half: its half widths (3,), the rounding included."""
    sides = np.asarray(half)
    return lambda points: np.linalg.norm(np.maximum(np.abs(points - middle) - sides + rounding, 0.0), axis=1) - rounding


def ellipsoid(middle: ArrayLike, half: ArrayLike) -> Field:
    """Return the field of an ellipsoid with half axes (3,); it is a distance to first order near the surface."""
    axes = np.asarray(half, dtype=np.float64)

    def distance(points: Array) -> Array:
        scaled = (points - np.asarray(middle)) / axes
        length = np.linalg.norm(scaled, axis=1)
        slope = np.linalg.norm(scaled / axes, axis=1)
        return (length - 1.0) * length / np.maximum(slope, 1e-12)

    return distance


def torus(middle: ArrayLike, ring: float, radius: float, axis: int = 2) -> Field:
    """Return the field of a torus around a coordinate axis; ring: radius of its middle circle."""
    across = [i for i in range(3) if i != axis]

    def distance(points: Array) -> Array:
        moved = points - np.asarray(middle)
        return np.hypot(np.hypot(*moved[:, across].T) - ring, moved[:, axis]) - radius

    return distance


def cylinder(middle: ArrayLike, radius: float, half: float, rounding: float = 0.0) -> Field:
    """Return the field of a cylinder around the z axis through its middle, of half height `half`, with rounded rims."""

    def distance(points: Array) -> Array:
        moved = points - np.asarray(middle)
        out = np.hypot(moved[:, 0], moved[:, 1]) - radius + rounding
        up = np.abs(moved[:, 2]) - half + rounding
        outside = np.hypot(np.maximum(out, 0.0), np.maximum(up, 0.0))
        return np.asarray(np.minimum(np.maximum(out, up), 0.0) + outside - rounding)

    return distance


def tube(curve: Array, radius: float | Array) -> Field:
    """Return the field of a tube around a curve of many points (k, 3); its radius is one or has a value a point."""
    tree, radii = cKDTree(curve), np.broadcast_to(radius, len(curve))

    def distance(points: Array) -> Array:
        far, nearest = tree.query(points)
        return np.asarray(far - radii[nearest])

    return distance


def joined(fillet: float, *parts: Field) -> Field:
    """Return the field of the union of parts; where two meet, a fillet of about that radius."""

    def distance(points: Array) -> Array:
        values = parts[0](points)
        for part in parts[1:]:
            other = part(points)
            near = np.maximum(fillet - np.abs(values - other), 0.0) / fillet
            values = np.minimum(values, other) - 0.25 * fillet * near**2
        return values

    return distance


def without(rounding: float, whole: Field, *parts: Field) -> Field:
    """Return the field of a solid less its parts; the edges between are rounded by about that radius."""
    outside = joined(rounding, lambda points: -whole(points), *parts)
    return lambda points: -outside(points)


def contour(distance: Field, cell: float, reach: float = 4.0) -> Triangles:
    """Return vertices and faces of the surface where a field is zero; it is positive outside [-reach, reach]^3.

    They are those of marching cubes on a grid of cells of side `cell`: many, and some of them thin.
    """
    axis = np.arange(-reach, reach, 4.0 * cell)
    near = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    near = near[distance(near) < 8.0 * cell]
    low = near.min(axis=0) - 4.0 * cell
    counts = np.ceil((near.max(axis=0) + 4.0 * cell - low) / cell).astype(int) + 1
    grid = pv.ImageData(dimensions=counts, spacing=(cell,) * 3, origin=low)
    surface = grid.contour([0.0], scalars=distance(np.asarray(grid.points, dtype=np.float64)), method="marching_cubes")
    return np.asarray(surface.points, dtype=np.float64), surface.faces.reshape(-1, 4)[:, :0:-1].astype(np.int64)


def evened(vertices: Array, faces: IntArray, count: int) -> Triangles:
    """Return a surface of about `count` faces of even size, by collapses of its shortest edges."""
    points, triangles, *_ = igl.decimate(vertices, faces, count, block_intersections=True)
    return np.asarray(points), np.asarray(triangles, dtype=np.int64)


def on_zero(distance: Field, points: Array) -> Array:
    """Return points (n, 3) near the surface where a field is zero, moved onto it: collapses leave them beside it."""
    for _ in range(_MOVES):
        slopes = [(distance(points + axis) - distance(points - axis)) / (2.0 * _STEP) for axis in _STEP * np.eye(3)]
        slope = np.stack(slopes, axis=1)
        square = np.maximum(np.sum(slope**2, axis=1), _FLATTEST)
        points = points - (distance(points) / square)[:, None] * slope
    return points


def has_genus(faces: IntArray, genus: int) -> bool:
    """Return whether the faces are one closed manifold with so many handles."""
    manifold = igl.is_edge_manifold(faces)[0] and np.all(igl.is_vertex_manifold(faces))
    closed = len(igl.boundary_facets(faces)[0]) == 0
    one = igl.facet_components(faces)[0] == 1
    return bool(manifold and closed and one and igl.euler_characteristic(faces) == 2 - 2 * genus)
