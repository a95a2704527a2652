"""Smooth things with handles as they stand about a house, of genus 1 to 12."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
from distance_fields import (
    Array,
    Field,
    Triangles,
    box,
    capsule,
    contour,
    cylinder,
    ellipsoid,
    evened,
    joined,
    torus,
    tube,
    without,
)
from scipy.interpolate import CubicSpline


def curve(points: list[list[float]], closed: bool = False, count: int = 600) -> Array:
    """Return points (count, 3) of a smooth curve through given ones; a closed one leads back to the first."""
    given = np.array([*points, points[0]] if closed else points, dtype=np.float64)
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(given, axis=0), axis=1))])
    spline = CubicSpline(steps, given, bc_type="periodic" if closed else "natural")
    return np.asarray(spline(np.linspace(0.0, steps[-1], count)))


def chain_link() -> Triangles:
    """Return a link of a chain, a round bar bent to a long ring."""
    half, bend = 1.2, 0.8
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 200)
    arc = np.stack([half + bend * np.cos(angle), bend * np.sin(angle), 0.0 * angle], axis=1)
    sides = [np.stack([np.linspace(-half, half, 200), np.full(200, y), np.zeros(200)], axis=1) for y in (-bend, bend)]
    line = np.concatenate([arc, arc * [-1.0, 1.0, 1.0], *sides])
    return evened(*contour(tube(line, 0.3), 0.05), 2400)


def hook_with_eye() -> Triangles:
    """Return a crane's hook under an eye: one handle and a limb that grows thinner to its tip."""
    points = [[0, 0, 0.2], [0, 0, -0.5], [0.35, 0, -1.1], [0.2, 0, -2.0], [-0.6, 0, -2.2], [-1.05, 0, -1.6]]
    hook = tube(curve(points), np.interp(np.linspace(0.0, 1.0, 600), [0.0, 0.5, 1.0], [0.24, 0.33, 0.14]))
    return evened(*contour(joined(0.2, torus([0, 0, 0.75], 0.5, 0.2, axis=1), hook), 0.05), 2600)


def carabiner() -> Triangles:
    """Return a carabiner, a D-shaped ring that is thicker along its back."""
    points = [[-0.7, 1.6, 0], [0.3, 1.9, 0], [1.0, 1.2, 0], [0.75, -0.4, 0], [0.2, -1.6, 0], [-0.5, -1.4, 0]]
    line = curve([*points, [-0.75, 0.1, 0]], closed=True)
    radius = 0.2 + 0.07 * np.clip(line[:, 0], -1.0, 1.0)
    return evened(*contour(tube(line, radius), 0.04), 2600)


def kettle() -> Triangles:
    """Return a solid kettle with a spout and a handle over its lid."""
    belly = joined(0.2, ellipsoid([0, 0, 0], [1.2, 1.2, 0.85]), ellipsoid([0, 0, 0.85], [0.3, 0.3, 0.22]))
    spout = capsule([0.9, 0, 0.0], [1.9, 0, 0.75], 0.32, 0.16)
    points = [[0.75, 0, 0.55], [0.95, 0, 1.2], [0.0, 0, 1.85], [-0.95, 0, 1.2], [-0.75, 0, 0.55]]
    return evened(*contour(joined(0.15, belly, spout, tube(curve(points), 0.14)), 0.05), 4000)


def eyeglasses() -> Triangles:
    """Return the frame of a pair of glasses: two rings, a bridge and two long bows with bent ends."""
    parts: list[Field] = [tube(curve([[-0.35, 0, 0.2], [0, 0.05, 0.35], [0.35, 0, 0.2]]), 0.11)]
    for side in (-1.0, 1.0):
        parts.append(torus([side * 1.0, 0, 0], 0.72, 0.12, axis=1))
        bow = [[1.68, 0.0, 0.25], [2.0, 0.25, 0.3], [2.0, 1.3, 0.3], [1.95, 2.6, 0.25], [1.9, 3.1, -0.3]]
        parts.append(tube(curve([[side * x, y, z] for x, y, z in bow]), 0.11))
    return evened(*contour(joined(0.1, *parts), 0.035), 5000)


def scissors() -> Triangles:
    """Return a closed pair of scissors: crossed bars with a ring at the end of each."""
    parts: list[Field] = []
    for side in (-1.0, 1.0):
        parts.append(capsule([side * 0.55, 0.06 * side, -1.4], [-side * 0.55, 0.06 * side, 2.4], 0.17, 0.08))
        parts.append(torus([side * 0.85, 0.06 * side, -1.95], 0.5, 0.15, axis=1))
    return evened(*contour(joined(0.12, *parts), 0.04), 3600)


def lattice_cell() -> Triangles:
    """Return a cell of a lattice: the edges of a cube and its four long diagonals, of genus 12."""
    corners = [np.array(corner) for corner in product((-1.0, 1.0), repeat=3)]
    bars = [(a, b) for a, b in combinations(corners, 2) if np.linalg.norm(a - b) < 2.1]
    bars += [(corner, np.zeros(3)) for corner in corners]
    return evened(*contour(joined(0.12, *(capsule(a, b, 0.17) for a, b in bars)), 0.04), 6000)


def hand_truck() -> Triangles:
    """Return a hand truck of bent tube: a long loop, three rungs across it, and a toe plate."""
    points = [[0.6, 0, -1.6], [0.6, 0, 0.8], [0.5, -0.3, 1.9], [0.0, -0.4, 2.2]]
    half = curve(points)
    loop = tube(np.concatenate([half, half * [-1.0, 1.0, 1.0]]), 0.11)
    rungs = [capsule([-0.6, 0, z], [0.6, 0, z], 0.1) for z in (-1.0, -0.2, 0.6)]
    toe = box([0.0, 0.35, -1.65], [0.75, 0.55, 0.12], 0.1)
    return evened(*contour(joined(0.08, loop, toe, *rungs), 0.035), 5000)


def wrench() -> Triangles:
    """Return a wrench with a ring at one end and an open jaw at the other."""
    ring = without(0.05, cylinder([0, 0, 0], 0.6, 0.2, 0.08), cylinder([0, 0, 0], 0.33, 1.0))
    jaw = without(0.05, cylinder([3.2, 0, 0], 0.75, 0.2, 0.08), box([3.6, 0, 0], [0.75, 0.32, 1.0], 0.05))
    shaft = box([1.5, 0, 0], [1.2, 0.22, 0.15], 0.1)
    return evened(*contour(joined(0.15, ring, jaw, shaft), 0.04, 5.0), 3200)
