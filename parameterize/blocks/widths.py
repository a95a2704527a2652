"""How wide a thin section of a body may be: by rays from a curve to the surface."""

import numpy as np

from ..arrays import Array
from .frames import unit
from .inside import Body

THIN = 0.55  # of the way to the surface: half the width of a section
_CORNER = 0.8  # of the way to the surface: where a section's corners lie at most
_FLAT = 2.0  # times the shorter way: half the width of a section at most, however wide the body is
_BEND = 0.6  # of the radius of curvature: half the width at most, or sections would meet at the centre of a bend
_SIGNS = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])


def half_widths(points: Array, across: Array, beside: Array, curvature: Array, body: Body) -> Array:
    """Return half the widths (k, 2) of sections at points (k, 3) inside a body.

    across, beside: (k, 3) the unit vectors along the two sides of each section. curvature: (k, 3) the curvature
    vectors of the curve. A section fits its neighbours: each width is at most the mean of theirs and its own.
    """
    axes = np.stack([across, beside], axis=1)  # (k, 2, 3)
    ways = np.minimum(body.rays(points[:, None], axes), body.rays(points[:, None], -axes))
    half = THIN * np.minimum(ways, _FLAT * ways.min(axis=1, keepdims=True))
    bends = np.abs(np.einsum("kda,ka->kd", axes, curvature))
    half = np.minimum(half, _BEND / np.maximum(bends, 1e-12))
    offsets = np.einsum("cd,kd,kda->kca", _SIGNS, half, axes)  # (k, 4, 3)
    reach = body.rays(points[:, None], unit(offsets)) / np.maximum(np.linalg.norm(offsets, axis=-1), 1e-300)
    half *= np.minimum(1.0, _CORNER * reach.min(axis=1))[:, None]
    padded = np.pad(half, ((1, 1), (0, 0)), mode="edge")
    return np.asarray(np.minimum(half, (padded[:-2] + half + padded[2:]) / 3.0))
