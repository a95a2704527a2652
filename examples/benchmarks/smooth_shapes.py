"""Smooth surfaces with handles, by formula or as the zero set of a distance field."""

from __future__ import annotations

import numpy as np
from distance_fields import (
    Array,
    Field,
    Triangles,
    capsule,
    contour,
    cylinder,
    evened,
    joined,
    torus,
    tube,
    without,
)

TURN = np.linspace(0.0, 2.0 * np.pi, 600, endpoint=False)  # parameters of the points of a closed curve


def ring(radius: float, around: int, across: int) -> Triangles:
    """Return a torus of ring radius 1 on a grid of its two angles."""
    along, turn = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    u, v = 2.0 * np.pi * along.ravel() / around, 2.0 * np.pi * turn.ravel() / across
    out = 1.0 + radius * np.cos(v)
    vertices = np.stack([out * np.cos(u), out * np.sin(u), radius * np.sin(v)], axis=1)
    number = along * across + turn
    ahead = np.roll(number, -1, axis=0)
    corners = (number, ahead, np.roll(ahead, -1, axis=1), np.roll(number, -1, axis=1))
    a, b, c, d = (corner.ravel() for corner in corners)
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def thick_torus() -> Triangles:
    """Return a torus of radii 1 and .35."""
    return ring(0.35, 96, 32)


def thin_torus() -> Triangles:
    """Return a torus of radii 1 and .12."""
    return ring(0.12, 120, 14)


def torus_knot(turns: int, petals: int) -> Array:
    """Return points (600, 3) of a torus knot around a torus of radii 2 and 1; (2, 3): trefoil, (2, 5): knot 5_1."""
    out = 2.0 + np.cos(petals * TURN)
    return np.stack([out * np.cos(turns * TURN), out * np.sin(turns * TURN), np.sin(petals * TURN)], axis=1)


def trefoil() -> Triangles:
    """Return a tube along a trefoil knot."""
    return evened(*contour(tube(torus_knot(2, 3), 0.35), 0.07), 3000)


def knot_5_1() -> Triangles:
    """Return a tube along the knot 5_1."""
    return evened(*contour(tube(torus_knot(2, 5), 0.28), 0.06), 4000)


def tori(*places: float) -> Field:
    """Return the field of tori side by side along x, grown together."""
    return joined(0.25, *(torus([x, 0.0, 0.0], 0.8, 0.33) for x in places))


def double_torus() -> Triangles:
    """Return two tori side by side."""
    return evened(*contour(tori(-1.0, 1.0), 0.05), 2500)


def triple_torus() -> Triangles:
    """Return three tori in a row."""
    return evened(*contour(tori(-1.9, 0.0, 1.9), 0.05), 3600)


def twisted_double_torus() -> Triangles:
    """Return two tori side by side, twisted by 100 degrees about their axis and bent by as much around a circle."""
    vertices, faces = evened(*contour(tori(-1.0, 1.0), 0.05), 3200)
    x, y, z = vertices.T
    angle = 0.45 * x
    y, z = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    out = 1.0 / 0.45 + z
    return np.stack([out * np.sin(angle), y, out * np.cos(angle)], axis=1), faces


def cup(*handles: float) -> Field:
    """Return the field of a cup of radius 1 with a wall of .22 and handles at these angles, in radians."""
    around = []
    for angle in handles:
        arc = np.stack([1.0 + 0.62 * np.sin(TURN[:300]), 0.0 * TURN[:300], 0.62 * np.cos(TURN[:300])], axis=1)
        turn = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        start, end = [0.88, 0.0, 0.62], [0.88, 0.0, -0.62]
        around.append(tube(np.concatenate([[start], arc, [end]]) @ turn, 0.17))
    hollow = cylinder([0.0, 0.0, 0.5], 0.78, 1.45, 0.15)
    body = cylinder([0.0, 0.0, 0.0], 1.0, 1.2, 0.15)
    return without(0.08, joined(0.12, body, *around), hollow)


def mug() -> Triangles:
    """Return a mug."""
    return evened(*contour(cup(0.0), 0.05), 4500)


def cup_with_two_handles() -> Triangles:
    """Return a cup with two handles on opposite sides."""
    return evened(*contour(cup(0.0, np.pi), 0.05), 5000)


def knotted_tunnel() -> Triangles:
    """Return a ball with a tunnel that is knotted: genus 1, but no disc inside opens it, so it is no thick graph."""
    t = np.linspace(-1.0, 1.0, 900)[40:-40] * np.pi
    knot = np.stack([np.sin(t) + 2.0 * np.sin(2.0 * t), np.cos(t) - 2.0 * np.cos(2.0 * t), -np.sin(3.0 * t)], axis=1)
    steps = np.linspace(0.0, 4.5, 300)[:, None]
    ways = [end + steps * np.array([side, -1.0, -2.4 * side]) for end, side in ((knot[0], -0.25), (knot[-1], 0.25))]
    tunnel = tube(np.concatenate([ways[0], knot, ways[1]]), 0.33)
    return evened(*contour(without(0.1, capsule([0, 0, 0], [0, 0, 0], 4.2), tunnel), 0.1, 5.0), 8000)
