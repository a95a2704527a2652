"""Parts of genus 0 as a CAD system writes them: planes, cylinders, cones, and the sharp edges between them."""

from __future__ import annotations

import numpy as np
from distance_fields import Triangles
from handle_shapes import Shape
from machined_shapes import block, rod, triangles
from manifold3d import CrossSection, Manifold


def steps() -> Triangles:
    """Return a stair of three steps."""
    return triangles(block((0, 3), (0, 2), (0, 1)) + block((1, 3), (0, 2), (1, 2)) + block((2, 3), (0, 2), (2, 3)))


def tee() -> Triangles:
    """Return a bar with a rib in its middle: a T."""
    return triangles(block((0, 3), (0, 1.5), (0, 0.6)) + block((1.2, 1.8), (0, 1.5), (0.6, 2.2)))


def channel() -> Triangles:
    """Return a channel: a U."""
    return triangles(block((0, 3), (0, 2), (0, 2)) - block((0.6, 2.4), (-1, 3), (0.6, 3)))


def chamfered_block() -> Triangles:
    """Return a block, its four upper edges chamfered."""
    levels = ((0, 1.5), (1, 1.5), (1.4, 1.1))  # height, and half of the width
    return triangles(Manifold.hull_points(np.array([[x, y, z] for z, s in levels for x in (-s, s) for y in (-s, s)])))


def pyramid_on_block() -> Triangles:
    """Return a block with a pyramid on its middle."""
    tip = Manifold.hull_points(np.array([(1, 1, 0.9), (3, 1, 0.9), (1, 3, 0.9), (3, 3, 0.9), (2, 2, 2.4)]))
    return triangles(block((0, 4), (0, 4), (0, 1)) + tip)


def pocketed_block() -> Triangles:
    """Return a block with a square pocket and a round one."""
    pockets = block((0.5, 1.5), (0.5, 1.5), (0.7, 2)) + rod((2.8, 1.0, 0.6), (2.8, 1.0, 2.0), 0.6, 48)
    return triangles(block((0, 4), (0, 2), (0, 1.2)) - pockets, 0.4)


def cylinder() -> Triangles:
    """Return a cylinder of 96 sides."""
    return triangles(rod((0, 0, 0), (0, 0, 2.5), 1.0, 96), 0.5)


def cone() -> Triangles:
    """Return a frustum of a cone of 96 sides."""
    return triangles(Manifold.cylinder(2.0, 1.2, 0.6, 96), 0.4)


def shaft() -> Triangles:
    """Return a shaft with two shoulders, of 64 sides."""
    return triangles(rod((0, 0, 0), (0, 0, 4), 0.6, 64) + rod((0, 0, 1), (0, 0, 2.5), 1.0, 64), 0.4)


def keyed_shaft() -> Triangles:
    """Return a shaft with chamfers at its ends, a groove and a keyway."""
    outline = [(0, 0), (0.8, 0), (1, 0.2), (1, 3), (0.8, 3.2), (1, 3.4), (1, 4.4), (0.8, 4.6), (0, 4.6)]
    return triangles(turned(outline, 64) - block((-0.2, 0.2), (0.7, 2), (1, 2)), 0.4)


def rounded_shoulder() -> Triangles:
    """Return a shaft on a disc, with a rounding of six facets between them."""
    angles = np.linspace(0.0, np.pi / 2.0, 7)
    rounding = zip(0.8 - 0.3 * np.sin(angles), 0.9 - 0.3 * np.cos(angles), strict=True)
    return triangles(turned([(0, 0), (1.2, 0), (1.2, 0.6), *rounding, (0.5, 2.5), (0, 2.5)], 48))


def turned(outline: list[tuple[float, float]], sides: int) -> Manifold:
    """Return the body that an outline of radii and heights makes around the axis."""
    return CrossSection([outline]).revolve(sides)


def notched_cylinder() -> Triangles:
    """Return a shaft's end with a flat and a step."""
    return triangles(rod((0, 0, 0), (0, 0, 3), 1.0, 64) - block((0.5, 2), (-2, 2), (1.5, 4)), 0.4)


def notched_cube() -> Triangles:
    """Return a cube, a quarter of a cylinder cut from one of its edges."""
    return triangles(block((0, 2), (0, 2), (0, 2)) - rod((2, -1, 2), (2, 3, 2), 0.8, 96), 0.4)


def half_round_block() -> Triangles:
    """Return a block that ends in a half cylinder, with a step."""
    body = block((0, 2), (-1, 1), (0, 1)) + rod((2, 0, 0), (2, 0, 1), 1.0, 64)
    return triangles(body + block((0, 0.8), (-1, 1), (0.9, 1.8)), 0.4)


def fan_blade() -> Triangles:
    """Return a curved wedge between two cylinders with a slanted end, as fandisk has."""
    ring = CrossSection.circle(3.0, 128) - CrossSection.circle(2.0, 128)
    part = ring.extrude(1.0) ^ block((0.0, 4.0), (0.4, 4.0), (-1.0, 2.0))
    slanted = part.trim_by_plane((-0.3, 0.5, -0.35), -0.2)
    return triangles(slanted - rod((2.9, 0.9, 0.5), (2.9, 0.9, 3.0), 0.45, 48), 0.3)


CAD = {
    one.__name__: Shape(one, 0)
    for one in (
        steps,
        tee,
        channel,
        chamfered_block,
        pyramid_on_block,
        pocketed_block,
        cylinder,
        cone,
        shaft,
        keyed_shaft,
        rounded_shoulder,
        notched_cylinder,
        notched_cube,
        half_round_block,
        fan_blade,
    )
}
