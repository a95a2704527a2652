"""Curves in space and the frames that are transported along them without a turn about the curve.

The vector across a curve goes from one tangent to the next by the smallest rotation between the two, the discrete
parallel transport of Bergou et al., "Discrete elastic rods", ACM Trans. Graph. 27 (2008).
"""

import numpy as np

from ...arrays import Array


def unit(vectors: Array) -> Array:
    """Return vectors (..., 3) divided by their lengths; zero stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def arc_lengths(points: Array) -> Array:
    """Return the length (k,) of a polygon (k, 3) from its first point to each point."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def at_lengths(points: Array, lengths: Array) -> Array:
    """Return the points (m, 3) of a polygon (k, 3) at arc lengths (m,); beyond its ends it goes on straight."""
    along = arc_lengths(points)
    inner = np.stack([np.interp(lengths, along, points[:, axis]) for axis in range(3)], axis=-1)
    before, after = np.minimum(lengths, 0.0)[:, None], np.maximum(lengths - along[-1], 0.0)[:, None]
    return np.asarray(inner + before * unit(points[1] - points[0]) + after * unit(points[-1] - points[-2]))


def tangents(points: Array) -> Array:
    """Return the unit tangents (k, 3) of a curve through points (k, 3), evenly spaced."""
    return unit(np.gradient(points, axis=0))


def rotated(vectors: Array, first: Array, second: Array) -> Array:
    """Return vectors (..., 3) turned by the smallest rotation that takes one unit vector (3,) to another (3,).

    The two must not be opposite.
    """
    axis, cosine = np.cross(first, second), float(first @ second)
    once = np.cross(axis, vectors)
    return np.asarray(vectors + once + np.cross(axis, once) / (1.0 + cosine))


def parallel_transport(start: Array, along: Array) -> Array:
    """Return the parallel transport (k, 3) of a vector (3,) across a curve along its tangents (k, 3)."""
    across = start - along[0] * (along[0] @ start)
    rows = [unit(across)]
    for before, after in zip(along, along[1:], strict=False):
        moved = rotated(rows[-1], before, after)
        rows.append(unit(moved - after * (after @ moved)))
    return np.array(rows)


def turned(across: Array, along: Array, angles: Array) -> Array:
    """Return vectors (k, 3) across a curve turned about its tangents (k, 3) by angles (k,)."""
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(cosine * across + sine * np.cross(along, across))


def angle_about(axis: Array, first: Array, second: Array) -> float:
    """Return the angle about a unit vector (3,) from one vector (3,) to another, in (-pi, pi]."""
    return float(np.arctan2(np.cross(first, second) @ axis, first @ second - (first @ axis) * (second @ axis)))
