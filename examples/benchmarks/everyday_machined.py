"""Things with handles from workshops and rooms as CAD systems write them, of genus 1 to 9."""

from __future__ import annotations

import numpy as np
from distance_fields import Triangles
from machined_shapes import block, plate, rod, triangles
from manifold3d import CrossSection, Manifold


def union(parts: list[Manifold]) -> Manifold:
    """Return the union of solids that overlap."""
    return sum(parts[1:], parts[0])


def around(part: Manifold, count: int) -> Manifold:
    """Return so many copies of a part, turned about the z axis."""
    return union([part.rotate((0.0, 0.0, 360.0 * i / count)) for i in range(count)])


def spoked_wheel() -> Triangles:
    """Return a wheel with a bored hub and five spokes."""
    rim = (CrossSection.circle(2.0, 64) - CrossSection.circle(1.6, 64)).extrude(0.5)
    hub = Manifold.cylinder(0.7, 0.5, circular_segments=32).translate((0.0, 0.0, -0.1))
    spokes = around(block((0.3, 1.8), (-0.13, 0.13), (0.1, 0.4)), 5)
    return triangles(rim + hub + spokes - Manifold.cylinder(2.0, 0.22, circular_segments=24).translate((0, 0, -1)))


def hinge() -> Triangles:
    """Return a leaf of a hinge: three holes for screws and two knuckles with a bore for the pin."""
    leaf = plate([(-1.4, 0.2), (0.0, -0.2), (1.4, 0.2)], (4.0, 2.0, 0.3), 0.2)
    knuckles = [rod((x, 1.1, 0.3), (x + 1.0, 1.1, 0.3), 0.35) for x in (-1.6, 0.6)]
    return triangles(leaf + union(knuckles) - rod((-3.0, 1.1, 0.3), (3.0, 1.1, 0.3), 0.17))


def ladder() -> Triangles:
    """Return a ladder: two rails and five round rungs."""
    rails = [block((x - 0.12, x + 0.12), (-0.18, 0.18), (0.0, 5.0)) for x in (-0.8, 0.8)]
    rungs = [rod((-0.85, 0.0, z), (0.85, 0.0, z), 0.12, 16) for z in (0.6, 1.5, 2.4, 3.3, 4.2)]
    return triangles(union(rails + rungs), 0.5)


def gear() -> Triangles:
    """Return a gear of 16 teeth with a bore and five lightening holes."""
    angle = 2.0 * np.pi * np.arange(64) / 64.0
    radius = np.tile([2.0, 2.35, 2.35, 2.0], 16)
    outline = CrossSection([np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)])
    outline = outline - CrossSection.circle(0.45, 32)
    for turn in 2.0 * np.pi * np.arange(5) / 5.0:
        outline = outline - CrossSection.circle(0.4, 24).translate((1.25 * np.cos(turn), 1.25 * np.sin(turn)))
    return triangles(outline.extrude(0.7))


def pipe_elbow() -> Triangles:
    """Return a pipe's elbow of a quarter turn, its wall a fifth of its radius, with flanges: one handle, thin."""

    def bent(radius: float, end_radius: float, end: float) -> Manifold:
        """Return the quarter of a torus about the z axis, with a straight end along y and one along x."""
        middle = CrossSection.circle(radius, 32).translate((2.0, 0.0)).revolve(64, 90.0)
        first = rod((2.0, -end, 0.0), (2.0, 0.02, 0.0), end_radius, 32)
        return middle + first + rod((-end, 2.0, 0.0), (0.02, 2.0, 0.0), end_radius, 32)

    return triangles(bent(0.7, 1.1, 0.3) - bent(0.56, 0.56, 0.5))


def table() -> Triangles:
    """Return a table whose four legs are joined by a ring of rungs: genus 4."""
    legs = around(block((0.95, 1.2), (0.95, 1.2), (0.0, 2.0)), 4)
    rungs = around(block((-1.1, 1.1), (1.0, 1.15), (0.5, 0.7)), 4)
    return triangles(block((-1.5, 1.5), (-1.5, 1.5), (1.9, 2.2)) + legs + rungs, 0.6)


def chair() -> Triangles:
    """Return a chair: four legs, and a back of two posts with two slats between."""
    legs = around(block((0.65, 0.85), (0.65, 0.85), (0.0, 1.3)), 4)
    posts = [block((x - 0.1, x + 0.1), (0.65, 0.85), (1.2, 3.2)) for x in (-0.75, 0.75)]
    slats = [block((-0.7, 0.7), (0.68, 0.82), (z, z + 0.35)) for z in (2.0, 2.7)]
    return triangles(union([block((-1.0, 1.0), (-1.0, 1.0), (1.2, 1.4)), legs, *posts, *slats]))


def fence() -> Triangles:
    """Return a piece of a fence: two rails and six pickets that end in points."""
    picket = CrossSection([[(-0.15, 0.0), (0.15, 0.0), (0.15, 2.0), (0.0, 2.25), (-0.15, 2.0)]]).extrude(0.15)
    pickets = [picket.rotate((90.0, 0.0, 0.0)).translate((0.6 * i, 0.0, 0.0)) for i in range(6)]
    rails = [block((-0.4, 3.4), (-0.1, 0.1), (z, z + 0.25)) for z in (0.4, 1.4)]
    return triangles(union(pickets + rails), 0.7)


def ribbed_bracket() -> Triangles:
    """Return an angle bracket with four holes and two ribs in its corner."""
    base = plate([(-1.3, 0.7), (1.3, 0.7)], (4.0, 3.0, 0.5), 0.3)
    wall = plate([(-1.3, 0.9), (1.3, 0.9)], (4.0, 3.0, 0.5), 0.3).rotate((90.0, 0.0, 0.0)).translate((0.0, -1.0, 1.5))
    corner = CrossSection([[(-1.1, 0.4), (0.6, 0.4), (-1.1, 2.1)]]).extrude(0.3)
    upright = corner.rotate((90.0, 0.0, 90.0))
    ribs = [upright.translate((x, 0.0, 0.0)) for x in (-0.75, 0.45)]
    return triangles(union([base, wall, *ribs]))


def flange() -> Triangles:
    """Return a flange with a bore, a collar and six holes for bolts."""
    body = Manifold.cylinder(0.4, 2.0, circular_segments=48) + Manifold.cylinder(1.2, 1.0, circular_segments=48)
    hole = Manifold.cylinder(2.0, 0.22, circular_segments=16).translate((1.5, 0.0, -0.5))
    return triangles(body - Manifold.cylinder(3.0, 0.6, circular_segments=48).translate((0, 0, -1)) - around(hole, 6))
