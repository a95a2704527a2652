"""Surfaces with handles as a CAD system writes them: Boolean operations, sharp edges, few and often long triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from distance_fields import Triangles
from manifold3d import CrossSection, Manifold

Place = tuple[float, float]


def triangles(solid: Manifold, longest: float | None = None) -> Triangles:
    """Return the surface of a solid; its edges are divided where they are longer than `longest`."""
    mesh = (solid if longest is None else solid.refine_to_length(longest)).to_mesh()
    vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    return vertices, np.asarray(mesh.tri_verts, dtype=np.int64)


def block(x: Place, y: Place, z: Place) -> Manifold:
    """Return a box between two bounds on each axis."""
    low = np.array([x[0], y[0], z[0]])
    return Manifold.cube(tuple(np.array([x[1], y[1], z[1]]) - low)).translate(tuple(low))


def rod(start: Sequence[float], end: Sequence[float], radius: float, sides: int = 24) -> Manifold:
    """Return a cylinder from one point to another."""
    along = np.subtract(end, start)
    length = float(np.linalg.norm(along))
    tilt = float(np.degrees(np.arccos(along[2] / length)))
    heading = float(np.degrees(np.arctan2(along[1], along[0])))
    upright = Manifold.cylinder(length, radius, circular_segments=sides)
    return upright.rotate((0.0, tilt, heading)).translate(tuple(start))


def plate(holes: Sequence[Place], size: tuple[float, float, float] = (6.0, 4.0, 0.8), radius: float = 0.45) -> Manifold:
    """Return a plate with its middle at the origin of x and y, from z = 0 up, and round holes (24-gons)."""
    outline = CrossSection.square(size[:2], True)
    for hole in holes:
        outline = outline - CrossSection.circle(radius, 24).translate(hole)
    return outline.extrude(size[2])


def plate_1() -> Triangles:
    """Return a plate with a hole; its volume is 18.697."""
    return triangles(plate([(0.0, 0.0)]), 0.4)


def plate_4() -> Triangles:
    """Return a plate with four holes; its volume is 17.187."""
    return triangles(plate([(x, y) for x in (-2.0, 2.0) for y in (-1.0, 1.0)]), 0.3)


def plate_6() -> Triangles:
    """Return a plate with six holes, in as few triangles as it needs."""
    return triangles(plate([(x, y) for x in (-2.0, 0.0, 2.0) for y in (-1.0, 1.0)]))


def bracket_4() -> Triangles:
    """Return an angle bracket with two holes in each of its legs."""
    base = plate([(-1.2, 0.3), (1.2, 0.3)], (4.0, 3.0, 0.6), 0.4)
    wall = plate([(-1.0, 0.6), (1.0, 0.6)], (4.0, 3.0, 0.6), 0.4)
    return triangles(base + wall.rotate((90.0, 0.0, 0.0)).translate((0.0, -0.9, 1.5)), 0.5)


def frame() -> Triangles:
    """Return a cube of side 2 with square bores of 1.3 along all axes: genus 5; its volume is 2.254."""
    cube, bore = Manifold.cube((2.0, 2.0, 2.0), True), Manifold.cube((1.3, 1.3, 3.0), True)
    return triangles(cube - bore - bore.rotate((90.0, 0.0, 0.0)) - bore.rotate((0.0, 90.0, 0.0)))
