"""Closed surfaces of bodies with handles and limbs, at volume 1, made by marching cubes and by Boolean operations."""

from __future__ import annotations

import numpy as np
import trimesh
from skimage.measure import marching_cubes


def at_volume_one(mesh):
    """Return vertices, faces and genus of a mesh, scaled to volume 1."""
    assert mesh.is_watertight and mesh.body_count == 1 and mesh.volume > 0.0
    vertices = np.asarray(mesh.vertices, dtype=np.float64) * mesh.volume ** (-1.0 / 3.0)
    return vertices, np.asarray(mesh.faces, dtype=np.int64), 1 - mesh.euler_number // 2


def implicit(function, box, points=48):
    """Return the surface on which a function of x (3, ...) is 0, negative inside, in the box [-b, b] of three b."""
    axes = [np.linspace(-b, b, max(8, round(points * b / max(box)))) for b in box]
    values = function(np.stack(np.meshgrid(*axes, indexing="ij")))
    vertices, faces, *_ = marching_cubes(values, 0.0, spacing=[axis[1] - axis[0] for axis in axes])
    mesh = trimesh.Trimesh(vertices - np.asarray(box), faces, process=True)
    return at_volume_one(max(mesh.split(only_watertight=False), key=lambda piece: piece.volume))


def from_manifold(solid, length):
    """Return the surface of a solid of manifold3d, its edges no longer than a length."""
    mesh = solid.refine_to_length(length).to_mesh()
    return at_volume_one(trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)))


def capsule(x, a, b, radius):
    """Return the distance of points x (3, ...) from the segment a b, less a radius."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    d = b - a
    share = np.clip(np.tensordot(d, x - a[:, None, None, None], 1) / (d @ d), 0.0, 1.0)
    return np.linalg.norm(x - a[:, None, None, None] - d[:, None, None, None] * share, axis=0) - radius


def ring(x, center, major, minor):
    """Return the distance of points x (3, ...) from a circle about the z axis through `center` on x, less a radius."""
    return np.sqrt((np.hypot(x[0] - center, x[1]) - major) ** 2 + x[2] ** 2) - minor


def union(*parts, sharpness=14.0):
    """Return the smooth union of distance functions."""
    return -np.log(sum(np.exp(-sharpness * part) for part in parts)) / sharpness


def plate(holes, size=(6.0, 4.0, 0.8), radius=0.45, length=0.3):
    """Return a rectangular plate with round holes at the places (x, y)."""
    from manifold3d import CrossSection

    outline = CrossSection.square(size[:2], True)
    for place in holes:
        outline = outline - CrossSection.circle(radius, 24).translate(place)
    return from_manifold(outline.extrude(size[2]), length)


def star(directions, reach=1.6, radius=0.22, ball=0.5):
    """Return a ball with a round limb in each direction (k, 3)."""
    limbs = [reach * np.asarray(d, dtype=float) / np.linalg.norm(d) for d in directions]
    box = [reach + radius + 0.2] * 3
    return implicit(
        lambda x: union(np.linalg.norm(x, axis=0) - ball, *(capsule(x, (0, 0, 0), end, radius) for end in limbs)),
        box,
        56,
    )


BALL, EAR = 0.9, 0.13  # radii of the body below, and of its handles


def eared():
    """Return a ball with a thin handle, or ear, on either side."""

    def distance(x):
        ears = (ring(np.array([x[0] - side, x[1], x[2]]), 0.0, 0.4, EAR) for side in (-1.0, 1.0))
        return np.minimum(np.linalg.norm(x, axis=0) - BALL, np.minimum(*ears))

    return implicit(distance, (1.7, 1.1, 1.1), 64)
