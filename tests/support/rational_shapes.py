"""Rational volumes by formula: a quarter of a ring and of a spherical shell, exact circles and spheres."""

import numpy as np

from parameterize.spline.volume import BSplineVolume

ARC = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])  # a quarter of the unit circle, with ARC_WEIGHTS
ARC_WEIGHTS = np.array([1.0, np.sqrt(0.5), 1.0])
LINEAR, QUADRATIC = np.array([0.0, 0.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


def quarter_ring(inner: float = 1.0, outer: float = 2.0, height: float = 1.0) -> BSplineVolume:
    """Return the quarter x, y >= 0 of a ring about z: u runs along the radius, v along the angle, w along z."""
    points = np.zeros((2, 3, 2, 3))
    for i, radius in enumerate((inner, outer)):
        points[i, ..., :2] = radius * ARC[:, None]
    points[..., 1, 2] = height
    weights = np.broadcast_to(ARC_WEIGHTS[:, None], (2, 3, 2))
    return BSplineVolume((1, 2, 1), (LINEAR, QUADRATIC, LINEAR), points, weights)


def octant(inner: float = 1.0, outer: float = 2.0) -> BSplineVolume:
    """Return the part x, y, z >= 0 of a spherical shell: u runs along the radius, v to the north, w to the west.

    The face v1 shrinks to an edge on the axis z.
    """
    points = np.zeros((2, 3, 3, 3))
    for i, radius in enumerate((inner, outer)):
        points[i, ..., :2] = radius * ARC[:, 0, None, None] * ARC[:, ::-1]
        points[i, ..., 2] = radius * ARC[:, 1, None]
    weights = np.broadcast_to(ARC_WEIGHTS[:, None] * ARC_WEIGHTS, (2, 3, 3))
    return BSplineVolume((1, 2, 2), (LINEAR, QUADRATIC, QUADRATIC), points, weights)


def bent_bar(seed: int = 0) -> BSplineVolume:
    """Return a rational volume of three degrees on uneven knots, with random weights and control points that waver."""
    random = np.random.default_rng(seed)
    shape, degrees = (6, 5, 4), (3, 2, 1)
    knots = (
        np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.6, 1.0, 1.0, 1.0, 1.0]),
        np.array([0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0]),
        np.array([0.0, 0.0, 0.3, 0.7, 1.0, 1.0]),
    )
    rows = [np.linspace(0.0, 1.0, n) for n in shape]
    points = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1) + 0.03 * random.standard_normal((*shape, 3))
    return BSplineVolume(degrees, knots, points, random.uniform(0.5, 2.0, shape))


def coil(quarters: int, rise: float, inner: float = 1.0, outer: float = 2.0, height: float = 1.0) -> BSplineVolume:
    """Return a rod around z of some quarters of a turn, exact circles seen along z, that rises by `rise` a turn.

    u runs along the radius, v along the angle, continuous at the quarters' ends, w along z.
    """
    steps = np.arange(2 * quarters + 1)
    odd = steps % 2 == 1
    weights = np.where(odd, np.sqrt(0.5), 1.0)
    points = np.zeros((2, len(steps), 2, 3))
    circle = np.stack([np.cos(steps * np.pi / 4), np.sin(steps * np.pi / 4)], axis=-1) / weights[:, None]
    for i, radius in enumerate((inner, outer)):
        points[i, ..., :2] = radius * circle[:, None]
    points[..., 2] = rise * steps[:, None] / 8.0 + np.array([0.0, height])
    knots = np.concatenate([[0.0], np.repeat(np.linspace(0.0, 1.0, quarters + 1), 2), [1.0]])
    net = np.broadcast_to(weights[:, None], points.shape[:3])
    return BSplineVolume((1, 2, 1), (LINEAR, knots, LINEAR), points, net)
