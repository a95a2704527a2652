"""Starts of blocks made by hand, with the surfaces they lie in: a torus, and a double torus with one junction."""

from __future__ import annotations

import numpy as np
import pyvista
from block_bodies import glued

from parameterize.surface.geometry import signed_volume

SECTIONS = 13  # of a quarter of the torus; of each handle of the double torus twice as many
SPANS = 6  # across the blocks


def torus(major=1.0, minor=0.35, around=72, across=28):
    """A ring of four rods, vertices (n, 3) at volume 1, and faces wound outward."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    r = major + minor * np.cos(b)
    points = np.stack([r * np.cos(a), r * np.sin(a), minor * np.sin(b)], axis=-1).reshape(-1, 3)
    number = u * across + v
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((number, right, both), (number, both, up))])
    scale = signed_volume(points, faces) ** (-1 / 3)
    half = 0.55 * minor
    sections = np.array(
        [
            [[[r * np.cos(t), r * np.sin(t), z] for z in (half, -half)] for r in (major - half, major + half)]
            for t in np.linspace(0.0, 2 * np.pi, 4 * (SECTIONS - 1) + 1)
        ]
    )
    sections[-1] = sections[0]
    quarters = [sections[k * (SECTIONS - 1) : (k + 1) * (SECTIONS - 1) + 1] for k in range(4)]
    blocks = [(f"rod {k}", scale * quarter + 0.5, (SPANS, SPANS, 8)) for k, quarter in enumerate(quarters)]
    return glued(*blocks), scale * points + 0.5, faces


def double_torus(cells=100):
    """A junction and two rods, each of which leaves it and comes back: layout, vertices at volume 1, faces.

    Two tori of radii 0.8 and 0.33 around (-1, 0, 0) and (1, 0, 0) with a smooth minimum of their distances. The
    junction is a diamond in the plane, its corners in the north, east, south and west.
    """
    points, faces = _implicit(_two_tori, (2.4, 1.4, 0.6), cells)
    scale = signed_volume(points, faces) ** (-1 / 3)
    half, high, north, east = 0.2, 0.18, 0.34, 0.4
    compass = {"n": (0, north), "e": (east, 0), "s": (0, -north), "w": (-east, 0)}
    corners = {name: np.array(place) for name, place in compass.items()}
    far, outer = np.hypot(1.0, north), np.pi - np.arctan(north)
    t = np.linspace(1.0, -1.0, 2 * SECTIONS - 1)
    inner_side = _polar(1.0, 0.8 - half, np.pi * t)
    outer_side = _polar(1.0, 0.8 + half + (far - 0.8 - half) * t**8, outer * t)
    right = np.stack([inner_side, outer_side], axis=1)  # (m, 2, 2)
    right[0], right[-1] = (corners["e"], corners["n"]), (corners["e"], corners["s"])
    left = -right
    left[0], left[-1] = (corners["w"], corners["s"]), (corners["w"], corners["n"])
    middle = np.array([[corners["w"], corners["n"]], [corners["s"], corners["e"]]])  # [w][u]

    def block(name, plane, along):
        z = np.broadcast_to(np.array([-high, high])[:, None], (*plane.shape[:2], 2, 1))
        sections = np.concatenate([np.repeat(plane[:, :, None], 2, axis=2), z], axis=-1)
        return name, scale * sections + 0.5, (SPANS, SPANS, along)

    blocks = [block("left", left, 20), block("junction", middle, SPANS), block("right", right, 20)]
    return glued(*blocks), scale * points + 0.5, faces


def _polar(x, radius, angle):
    return np.stack([x + radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def _two_tori(x, y, z):
    """The smooth minimum of the distances from two tori side by side."""
    parts = [np.sqrt((np.hypot(x - c, y) - 0.8) ** 2 + z**2) - 0.33 for c in (-1.0, 1.0)]
    return -np.log(sum(np.exp(-12.0 * part) for part in parts)) / 12.0


def _implicit(function, box, cells):
    """Vertices and outward faces of the surface where a function is zero, in a box (3,) of half sides around 0."""
    dimensions = [int(cells * side / max(box)) for side in box]
    grid = pyvista.ImageData(dimensions=dimensions, origin=-np.array(box))
    grid.spacing = [2 * side / (n - 1) for side, n in zip(box, dimensions, strict=True)]
    values = function(*grid.points.T)
    mesh = grid.contour([0.0], scalars=values).triangulate().clean()
    points, faces = np.asarray(mesh.points, dtype=np.float64), mesh.faces.reshape(-1, 4)[:, 1:].astype(np.int64)
    return points, faces if signed_volume(points, faces) > 0 else faces[:, ::-1]
