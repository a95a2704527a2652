"""Bodies of textbooks, exact as rational splines: rings, plates with a hole, round bars, shells of a ball, blocks."""

from __future__ import annotations

import numpy as np

import iga_nn
from parameterize.arrays import Array
from parameterize.spline.bspline import greville

LINE, ARC = [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]  # knots of degree 1 and 2
CENTRE = 0.45  # half the side of the square inside of a round bar, in radii


def arc(start: float, end: float) -> tuple[Array, Array]:
    """Return control points (3, 2) and weights (3,) of an arc of the unit circle between two angles in degrees."""
    first, last = np.radians([start, end])
    half, middle = 0.5 * (last - first), 0.5 * (first + last)
    points = [(np.cos(t) * s, np.sin(t) * s) for t, s in ((first, 1.0), (middle, 1.0 / np.cos(half)), (last, 1.0))]
    return np.array(points), np.array([1.0, np.cos(half), 1.0])


def extruded(inner: Array, outer: Array, weights: Array, low: float, high: float) -> iga_nn.BSplineVolume:
    """Return the body between two curves of degree 2, extruded along z.

    inner, outer: control points (3, 2). weights: (2, 3). u runs from the inner curve to the outer one, v along them.
    """
    points = np.empty((2, 3, 2, 3))
    points[..., :2] = np.stack([inner, outer])[:, :, None]
    points[..., 2] = [low, high]
    full = np.repeat(weights[:, :, None], 2, axis=2)
    return iga_nn.BSplineVolume((1, 2, 1), (LINE, ARC, LINE), points, full)


def quarter_ring(radii: tuple[float, ...], height: float) -> iga_nn.Body:
    """Return a quarter of a ring about z, a patch between any two of the radii: u is the radius, v the angle from x."""
    points, weights = arc(0.0, 90.0)
    pairs = zip(radii, radii[1:], strict=False)
    return iga_nn.Body.from_patches(
        [extruded(a * points, b * points, np.stack([weights] * 2), 0.0, height) for a, b in pairs]
    )


def quarter_plate(half: float, height: float) -> iga_nn.Body:
    """Return a quarter of a square plate with a hole of radius 1: two patches, u runs from the hole outward."""
    patches = []
    for start, ends in ((0.0, ((half, 0.0), (half, half))), (45.0, ((half, half), (0.0, half)))):
        points, weights = arc(start, start + 45.0)
        line = np.array([ends[0], np.mean(ends, axis=0), ends[1]])
        patches.append(extruded(points, line, np.stack([weights, np.ones(3)]), 0.0, height))
    return iga_nn.Body.from_patches(patches)


def round_bar(half_x: float, half_y: float, length: float) -> iga_nn.Body:
    """Return a bar along z with an elliptic section: a square inside, and four patches around it, u outward."""
    axes = np.array([half_x, half_y])
    corners = [CENTRE * np.array(corner) for corner in ((1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0))]
    patches = []
    for number in range(4):
        points, weights = arc(90.0 * number - 45.0, 90.0 * number + 45.0)
        first, last = corners[number], corners[(number + 1) % 4]
        side = np.stack([first, 0.5 * (first + last), last])
        patches.append(extruded(axes * side, axes * points, np.stack([np.ones(3), weights]), 0.0, length))
    square = np.empty((3, 3, 2, 3))
    square[..., 0] = half_x * CENTRE * np.array([-1.0, 0.0, 1.0])[:, None, None]
    square[..., 1] = half_y * CENTRE * np.array([-1.0, 0.0, 1.0])[:, None]
    square[..., 2] = [0.0, length]
    return iga_nn.Body.from_patches([iga_nn.BSplineVolume((2, 2, 1), (ARC, ARC, LINE), square), *patches])


def ball_shell(inner: float, outer: float, degrees: float) -> iga_nn.Body:
    """Return an eighth of a shell of a ball without its top: u is the radius, v the angle about z, w the latitude.

    degrees: the latitude up to which the body goes; a cone with its tip at the middle ends it.
    """
    round_z, weights_v = arc(0.0, 90.0)
    upward, weights_w = arc(0.0, degrees)
    points = np.empty((2, 3, 3, 3))
    radii = np.array([inner, outer])
    points[..., :2] = radii[:, None, None, None] * round_z[:, None] * upward[:, :1]
    points[..., 2] = radii[:, None, None] * upward[:, 1]
    weights = np.broadcast_to(weights_v[:, None] * weights_w, (2, 3, 3))
    return iga_nn.Body.from_patches([iga_nn.BSplineVolume((1, 2, 2), (LINE, ARC, ARC), points, weights)])


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> iga_nn.Body:
    """Return the box between two corners, as one patch of one span: u, v, w along x, y, z."""
    grid = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1)
    return iga_nn.Body.from_patches([iga_nn.BSplineVolume((1, 1, 1), (LINE, LINE, LINE), grid)])


def graded_block(high: tuple[float, float, float], halvings: int) -> iga_nn.Body:
    """Return the box from 0, of degree 3, with spans that halve toward all edges of its face x = 0."""
    ends = 0.5 ** np.arange(halvings, 0.0, -1.0)
    to_start, to_both = ends, np.concatenate([0.5 * ends, 1.0 - 0.5 * ends[-2::-1]])
    knots = [np.concatenate([np.zeros(4), inside, np.ones(4)]) for inside in (to_start, to_both, to_both)]
    rows = [size * greville(row, 3) for size, row in zip(high, knots, strict=True)]
    grid = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)
    u, v, w = knots
    return iga_nn.Body.from_patches([iga_nn.BSplineVolume((3, 3, 3), (u, v, w), grid)])
