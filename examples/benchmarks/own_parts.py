"""Parts of kinds that the public collections lack, made with OpenCASCADE through Netgen, and written as STEP.

    python examples/benchmarks/own_parts.py out/own_parts
    python examples/benchmarks/own_parts.py out/own_parts --only bolt gear

Each part is one solid; lengths are millimetres.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import pairwise
from math import acos, cos, hypot, pi, radians, sin, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from netgen.occ import (
    Axes,
    Axis,
    BezierCurve,
    Box,
    Cylinder,
    Dir,
    Edge,
    Face,
    Fuse,
    Pipe,
    Pnt,
    Revolve,
    Segment,
    SplineInterpolation,
    ThruSections,
    Vec,
    Wire,
    WorkPlane,
    X,
    Y,
    Z,
)
from processes import OneLineParser

Solid = Any  # a shape of netgen.occ
Points = Sequence[tuple[float, float]]
AXIS = Axis((0, 0, 0), Z)
MERIDIAN = Axes((0, 0, 0), n=-Y, h=X)  # radii along x, heights along z


def bolt() -> Solid:
    """Return a bolt M8 with a hexagonal head and fourteen turns of a helical thread."""
    pitch, turns, root = 1.25, 14, 3.25
    tooth = polygon([(root - 0.25, -0.5), (root + 0.75, -0.08), (root + 0.75, 0.08), (root - 0.25, 0.5)], MERIDIAN)
    middle = Wire([Segment(Pnt(0, 0, 0), Pnt(0, 0, pitch * turns))])
    thread = Pipe(helix(root, pitch, turns), tooth, auxspine=middle)
    flats = polygon(on_circle(6, 13.0 / sqrt(3.0)), Axes((0, 0, -11.3))).Extrude(5.3)
    head = flats * turned([(0, -11.3), (6.5, -11.3), (8, -10.4), (8, -6), (0, -6)])
    shank = rod((0, 0, -6.5), Z, root, 5.5) + rod((0, 0, -6.5), Z, 4.0, 5.0)
    tip = turned([(0, -12), (9, -12), (9, 12), (4.2, pitch * turns - 1.5), (2.9, pitch * turns), (0, pitch * turns)])
    return ((rod((0, 0, -2), Z, root, pitch * turns + 2) + thread) * tip) + shank + head


def spring() -> Solid:
    """Return a helical spring of four turns."""
    middle = helix(8.0, 5.0, 4)
    start, along = middle.edges[0].start, middle.edges[0].start_tangent
    return Pipe(middle, WorkPlane(Axes(start, n=Dir(along.x, along.y, along.z), h=X)).Circle(1.2).Face())


def loft() -> Solid:
    """Return a solid through three squares, each with rounder corners than the one below."""
    return ThruSections([rounded_square(30, 4, 0), rounded_square(26, 8, 15), rounded_square(20, 8, 32)])


def drafted_box() -> Solid:
    """Return a moulded cover: draft angles of three degrees, rounded edges, and a hollow."""
    outside = tapered(60.0, 40.0, 25.0, 3.0)
    outside = outside.MakeFillet([e for e in outside.edges if e.center.z > 1e-6 and abs(e.center.z - 25.0) > 1e-6], 5.0)
    outside = outside.MakeFillet(outside.faces.Max(Z).edges, 2.0)
    inside = tapered(55.0, 35.0, 22.5, 3.0)
    inside = inside.MakeFillet([e for e in inside.edges if e.center.z > 1e-6 and abs(e.center.z - 22.5) > 1e-6], 3.0)
    return outside - inside


def gear() -> Solid:
    """Return a spur gear of module 2 with eighteen involute teeth, a hub, a bore and a keyway."""
    module, teeth = 2.0, 18
    pitch = module * teeth / 2.0
    base, root, tip = pitch * cos(radians(20.0)), pitch - 1.25 * module, pitch + module
    half = pi / (2 * teeth) + involute(acos(base / pitch))  # angle from the middle of a tooth to its flank at the base
    radii = np.linspace(base, tip, 9)
    flank = [(r, half - involute(acos(base / r))) for r in radii.tolist()]
    edges = []
    for number in range(teeth):
        middle = 2 * pi * number / teeth
        up = [polar(r, middle - angle) for r, angle in flank]
        down = [polar(r, middle + angle) for r, angle in reversed(flank)]
        foot = [polar(root, middle - half), polar(root, middle + half)]
        following = polar(root, middle + 2 * pi / teeth - half)
        edges += [Segment(foot[0], up[0]), SplineInterpolation(up), Segment(up[-1], down[0])]
        edges += [SplineInterpolation(down), Segment(down[-1], foot[1]), Segment(foot[1], following)]
    body = Face(Wire(edges)).Extrude(10.0, Z) + rod((0, 0, 0), Z, 9.0, 18.0)
    return body - rod((0, 0, -1), Z, 5.0, 20.0) - block((-1.5, 0, -1), (1.5, 6.4, 19))


def manifold() -> Solid:
    """Return a block whose bores along three axes cross, with counterbores."""
    body = block((0, 0, 0), (80, 50, 40))
    bores = [rod((-1, 25, 20), X, 6.0, 70), rod((20, -1, 20), Y, 5.0, 52), rod((20, 25, -1), Z, 4.0, 42)]
    bores += [rod((55, 25, 20), Z, 5.0, 21), rod((55, 25, 20), Y, 4.0, 26), rod((40, -1, 12), Y, 3.0, 52)]
    counterbores = [rod((-1, 25, 20), X, 10.0, 9), rod((55, 25, 34), Z, 8.0, 7), rod((20, -1, 20), Y, 7.5, 7)]
    return body - Fuse(bores + counterbores)


def turbine_blade() -> Solid:
    """Return a twisted, lofted blade with a sharp trailing edge on a platform and a dovetail root."""
    blade = ThruSections([profile(chord, turn, height) for chord, turn, height in SECTIONS])
    root = polygon([(-4, -2), (-4, -5), (-6.5, -11), (6.5, -11), (4, -5), (4, -2)], Axes((-17, 0, 0), n=X, h=Y))
    return block((-17, -11, -4), (17, 11, 0)) + root.Extrude(34.0) + blade


def text_on_plate() -> Solid:
    """Return a plate with raised letters, whose edges are lines and parabolas."""
    body = block((0, 0, 0), (64, 20, 3))
    for letter in letters("IGA-3d", 14.0, 5.0, 5.0):
        body = body + letter.Move(Vec(0, 0, 2.5)).Extrude(1.7, Vec(0, 0, 1))
    return body


def ribbed_box() -> Solid:
    """Return an open box with walls of 1.5 mm, three ribs and two bosses."""
    shell = block((0, 0, 0), (80, 50, 25)) - block((1.5, 1.5, 1.5), (78.5, 48.5, 26))
    ribs = [block((x, 1, 1), (x + 1.2, 49, 14)) for x in (20.0, 40.0)] + [block((1, 25, 1), (79, 26.2, 10))]
    bosses = [rod((x, 12, 1), Z, 4.0, 17) for x in (10.0, 68.0)]
    return Fuse([shell, *ribs, *bosses]) - Fuse([rod((x, 12, 5), Z, 1.6, 20) for x in (10.0, 68.0)])


def elbow() -> Solid:
    """Return a pipe that bends by 90 degrees between two flanges with six holes each."""
    ring = WorkPlane(Axes((0, 0, 0), n=Z, h=X)).Circle(14.0).Circle(11.0).Reverse().Face()
    bend = Revolve(ring, Axis((30, 0, 0), Y), 90)
    flange = rod((0, 0, -8), Z, 26.0, 6) + rod((0, 0, -3), Z, 14.0, 3) - rod((0, 0, -9), Z, 11.0, 10)
    flange = flange - Fuse([rod((x, y, -9), Z, 2.75, 8) for x, y in on_circle(6, 20.0, pi / 6)])
    other = flange.Rotate(Axis((30, 0, 0), Y), 180).Rotate(Axis((30, 0, 0), Y), -90)
    return bend + flange + other


def knob() -> Solid:
    """Return a knob: a spline turned about its axis, a knurl of 24 grooves, and a bore with a flat."""
    points = [Pnt(15, 0, 9), Pnt(14, 0, 13), Pnt(11, 0, 15.5), Pnt(6, 0, 17), Pnt(0, 0, 17.5)]
    rim = SplineInterpolation(points, tangents={0: Vec(0, 0, 1), 4: Vec(-1, 0, 0)})
    corners = [Pnt(0, 0, 17.5), Pnt(0, 0, 0), Pnt(15, 0, 0), Pnt(15, 0, 9)]
    body = Revolve(Face(Wire([rim, *(Segment(a, b) for a, b in pairwise(corners))])), AXIS, 360)
    grooves = Fuse([rod((x, y, -1), Z, 1.1, 9) for x, y in on_circle(24, 15.3)])
    bore = rod((0, 0, -1), Z, 3.0, 11) - block((-4, 2.2, -2), (4, 4, 11))
    return body - grooves - bore


def shaft() -> Solid:
    """Return a stepped shaft with a rounded shoulder, chamfers, a keyway and a cross bore."""
    body = turned([(0, 0), (9, 0), (10, 1), (10, 30), (14, 30), (14, 50), (10, 50), (10, 84), (9, 85), (0, 85)])
    circles = [e for e in body.edges if min(abs(e.center.z - 30), abs(e.center.z - 50)) < 1e-6]
    body = body.MakeFillet([e for e in circles if hypot(e.start.x, e.start.y) < 11], 1.5)
    keyway = block((-3, 6.5, 10), (3, 12, 22)) + rod((0, 6.5, 10), Y, 3.0, 6) + rod((0, 6.5, 22), Y, 3.0, 6)
    return body - keyway - rod((-20, 0, 68), X, 2.5, 40)


PARTS = {
    make.__name__: make
    for make in (
        bolt, spring, loft, drafted_box, gear, manifold, turbine_blade, text_on_plate, ribbed_box, elbow, knob, shaft,
    )
}  # fmt: skip
SECTIONS = ((26.0, 0.0, -1.0), (23.0, 12.0, 15.0), (19.0, 24.0, 32.0), (15.0, 34.0, 50.0))  # chord, degrees, height


# What parts are made of


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Solid:
    """Return the box between two corners."""
    return Box(Pnt(*low), Pnt(*high))


def rod(start: tuple[float, float, float], along: Any, radius: float, length: float) -> Solid:
    """Return a cylinder."""
    return Cylinder(Pnt(*start), along, radius, length)


def polygon(points: Points, axes: Any) -> Solid:
    """Return the plane face of a polygon."""
    plane = WorkPlane(axes).MoveTo(*points[0])
    for point in points[1:]:
        plane = plane.LineTo(*point)
    return plane.Close().Face()


def turned(outline: Points) -> Solid:
    """Return the solid that an outline of radii and heights makes around the axis."""
    return Revolve(polygon(outline, MERIDIAN), AXIS, 360)


def helix(radius: float, pitch: float, turns: float) -> Any:
    """Return a helix around the axis that starts at (radius, 0, 0)."""
    around = rod((0, 0, -pitch), Z, radius, pitch * (turns + 2)).faces[0]
    return Wire([Edge(Segment((0, pitch), (2 * pi * turns, pitch * (turns + 1))), around)])


def on_circle(count: int, radius: float, start: float = 0.0) -> list[tuple[float, float]]:
    """Return points at equal distances on a circle."""
    angles = start + 2 * pi * np.arange(count) / count
    return list(zip((radius * np.cos(angles)).tolist(), (radius * np.sin(angles)).tolist(), strict=True))


def polar(radius: float, angle: float) -> Any:
    """Return a point in the plane z = 0."""
    return Pnt(radius * cos(angle), radius * sin(angle), 0)


def involute(angle: float) -> float:
    """Return tan a - a, the polar angle of an involute at the pressure angle a."""
    return tan(angle) - angle


def rounded_square(side: float, radius: float, height: float) -> Any:
    """Return the outline of a square with rounded corners, of four lines and four arcs."""
    plane = WorkPlane(Axes((0, 0, height), n=Z, h=X)).MoveTo(radius - side / 2, -side / 2)
    for _ in range(4):
        plane = plane.Line(side - 2 * radius).Arc(radius, 90)
    return plane.Wire()


def tapered(length: float, width: float, height: float, draft: float) -> Solid:
    """Return a box on z = 0 whose sides lean inward by a draft angle in degrees."""
    body = block((-length, -width, 0), (length, width, height))
    for side, along, sign in ((length, Y, 1), (length, Y, -1), (width, X, 1), (width, X, -1)):
        x, y = (sign * side / 2, 0.0) if along is Y else (0.0, sign * side / 2)
        far = block((0, -200, -200), (200, 200, 200)) if sign > 0 else block((-200, -200, -200), (0, 200, 200))
        far = far if along is Y else far.Rotate(AXIS, 90)
        turn = -sign * draft if along is Y else sign * draft
        body = body - far.Rotate(Axis((0, 0, 0), along), turn).Move(Vec(x, y, 0))
    return body


def profile(chord: float, turn: float, height: float) -> Any:
    """Return a NACA profile of 14 % thickness and 6 % camber, turned by degrees, of two splines."""
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, pi, 15)))
    thick = 0.7 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    camber = 0.24 * x * (1.0 - x)
    c, s = cos(radians(turn)), sin(radians(turn))

    def point(along: float, across: float) -> Any:
        a, b = chord * (along - 0.45), chord * across
        return Pnt(c * a - s * b, s * a + c * b, height)

    upper, lower = (
        [point(*pair) for pair in zip(x.tolist(), (camber + sign * thick).tolist(), strict=True)] for sign in (1, -1)
    )
    return Wire([SplineInterpolation(upper), SplineInterpolation(lower[::-1])])


def letters(text: str, size: float, left: float, bottom: float) -> list[Solid]:
    """Return a face for each letter, in the plane z = 0, with their holes."""
    path = TextPath((left, bottom), text, size=size, prop=FontProperties(family="DejaVu Sans"))
    loops = [_letter(loop) for loop in _loops(path)]
    whole = [face for face, area in loops if area < 0]  # outlines run clockwise, and holes the other way
    for hole in (face for face, area in loops if area > 0):
        whole = [face - hole for face in whole]
    return whole


def _loops(path: TextPath) -> list[list[np.ndarray]]:
    """Return the loops of a path: the control points (2, 2) or (3, 2) of each piece."""
    found: list[list[np.ndarray]] = []
    at = np.zeros(2)
    for points, code in path.iter_segments(simplify=False):
        if code == path.MOVETO:
            found.append([])
        elif code != path.CLOSEPOLY:
            found[-1].append(np.vstack([at, points.reshape(-1, 2)]))
        at = points[-2:]
    return found


def _letter(loop: list[np.ndarray]) -> tuple[Solid, float]:
    """Return the face inside a loop, and its area, which is negative where the loop runs clockwise."""
    edges = [BezierCurve([Pnt(x, y, 0) for x, y in piece.tolist()]) for piece in loop if np.ptp(piece, axis=0).any()]
    x, y = np.concatenate([piece[:-1] for piece in loop]).T
    return Face(Wire(edges)), float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def main(argv: list[str] | None = None) -> int:
    """Write the parts; 0 done, 2 bad arguments."""
    parser = OneLineParser(
        prog="own_parts.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="where the STEP files go")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS), metavar="NAME")
    given = parser.parse_args(argv)
    given.folder.mkdir(parents=True, exist_ok=True)
    for name in given.only:
        print(f"{name}: volume {write(name, given.folder).mass:.6g}")
    return 0


def write(name: str, folder: Path) -> Solid:
    """Write one part as STEP, and return it. Raises ValueError where it is not one solid."""
    made = PARTS[name]()
    if len(made.solids) != 1:
        raise ValueError(f"{name}: {len(made.solids)} solids instead of one")
    made.solids[0].WriteStep(str(folder / f"{name}.step"))
    return made


if __name__ == "__main__":
    raise SystemExit(main())
