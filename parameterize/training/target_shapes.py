"""Finds nearest points on the target shapes: smooth cuboids S(d) and the unit cube (Definition 1)."""

from math import pi

import numpy as np
import torch
from torch import Tensor

from ..arrays import Array
from ..cube.cube import axis_and_side


def cuboid_scale(d: float) -> float:
    """Return v^(-1/3), where v is the volume of all points within d of the unit cube: it scales S(d) to volume 1."""
    volume = 4.0 / 3.0 * pi * d**3 + 3.0 * pi * d**2 + 6.0 * d + 1.0
    return float(volume ** (-1.0 / 3.0))


def nearest_on_cube(points: Tensor) -> Tensor:
    """Return the nearest points (m, 3) on the boundary of [0, 1]^3, for points (m, 3) inside or outside."""
    clamped = points.clamp(0.0, 1.0)
    to_face, axis = torch.minimum(clamped, 1.0 - clamped).min(dim=1, keepdim=True)  # (m, 1)
    on_face = clamped.scatter(1, axis, clamped.gather(1, axis).round())
    return torch.where(to_face > 0.0, on_face, clamped)


def nearest_places(points: Array) -> Array:
    """Return the nearest points (m, 3) on the boundary of [0, 1]^3, for an array of points (m, 3)."""
    return np.asarray(nearest_on_cube(torch.as_tensor(points)))


def nearest_on_cube_face(points: Tensor, face: Tensor) -> Tensor:
    """Return the nearest points (m, 3) on given faces (m,) of the cube, 0..5 for u0, u1, v0, v1, w0, w1."""
    axis, side = axis_and_side(face[:, None])
    return points.clamp(0.0, 1.0).scatter(1, axis, side.to(points.dtype))


def nearest_on_cuboid(points: Tensor, d: float) -> Tensor:
    """Return the nearest points (m, 3) on the boundary of S(d), d > 0, for points (m, 3)."""
    scale = cuboid_scale(d)
    local = (points - 0.5) / scale + 0.5  # there, S(d) is the unit cube grown by d
    core = local.clamp(0.0, 1.0)
    outward = local - core
    inside = (outward == 0.0).all(dim=1, keepdim=True)
    on_face = nearest_on_cube(local)
    axis = (on_face - 0.5).abs().argmax(dim=1, keepdim=True)
    normal = torch.zeros_like(local).scatter(
        1, axis, (on_face - 0.5).gather(1, axis).sign()
    )  # on an edge that of one face
    outward = torch.where(inside, normal, outward)
    base = torch.where(inside, on_face, core)
    nearest = base + d * outward / outward.norm(dim=1, keepdim=True)
    return (nearest - 0.5) * scale + 0.5


def nearest(target: str, points: Tensor) -> Tensor:
    """Return the nearest points (m, 3) on the boundary of "cube", "S(1)" or "S(2)"."""
    if target == "cube":
        return nearest_on_cube(points)
    return nearest_on_cuboid(points, float(target[2:-1]))
