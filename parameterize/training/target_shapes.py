"""Finds nearest points on the target shapes: smooth cuboids S(d) and the unit cube (Definition 1)."""

from math import pi

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..cube.cube import axis_and_side

_AXES = np.arange(3)


def cuboid_scale(d: float) -> float:
    """Return v^(-1/3), where v is the volume of all points within d of the unit cube: it scales S(d) to volume 1."""
    volume = 4.0 / 3.0 * pi * d**3 + 3.0 * pi * d**2 + 6.0 * d + 1.0
    return float(volume ** (-1.0 / 3.0))


def nearest_on_cube(points: Array) -> Array:
    """Return the nearest points (m, 3) on the boundary of [0, 1]^3, for points (m, 3) inside or outside."""
    clamped = points.clip(0.0, 1.0)
    to_face = np.minimum(clamped, 1.0 - clamped)
    moved = _only(to_face.argmin(axis=1)) & (to_face > 0.0)
    return np.where(moved, clamped.round(), clamped)


def nearest_on_cube_face(points: Array, face: IntArray) -> Array:
    """Return the nearest points (m, 3) on given faces (m,) of the cube, 0..5 for u0, u1, v0, v1, w0, w1."""
    axis, side = axis_and_side(face)
    return np.where(_only(axis), side[:, None], points.clip(0.0, 1.0))


def nearest_on_cuboid(points: Array, d: float) -> Array:
    """Return the nearest points (m, 3) on the boundary of S(d), d > 0, for points (m, 3)."""
    scale = cuboid_scale(d)
    local = (points - 0.5) / scale + 0.5  # there, S(d) is the unit cube grown by d
    core = local.clip(0.0, 1.0)
    outward = local - core
    inside = ~outward.any(axis=1, keepdims=True)
    on_face = nearest_on_cube(local)
    from_centre = on_face - 0.5
    normal = _only(np.abs(from_centre).argmax(axis=1)) * np.sign(from_centre)  # on an edge that of one face
    outward = np.where(inside, normal, outward)
    base = np.where(inside, on_face, core)
    nearest = base + d * outward / np.linalg.norm(outward, axis=1, keepdims=True)
    return np.asarray((nearest - 0.5) * scale + 0.5)


def nearest(target: str, points: Array) -> Array:
    """Return the nearest points (m, 3) on the boundary of "cube", "S(1)" or "S(2)"."""
    if target == "cube":
        return nearest_on_cube(points)
    return nearest_on_cuboid(points, float(target[2:-1]))


def _only(axis: IntArray) -> Mask:
    """Return masks (m, 3) of one coordinate in each row."""
    return np.asarray(axis[:, None] == _AXES)
