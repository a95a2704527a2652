"""How much the operator's factors vary from span to span: what the choice of its quadrature rests on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import midpoints
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from ..forms.jets import SYMMETRIC
from .planes import map_planes
from .quadrature import GaussRule
from .space import TrialSpace

SAMPLES = 6  # places a direction, each three neighbouring spans
LIMIT = 0.03  # trained maps reach 0.06 and more after two refinements, the twisted cube 0.02 with 14 elements

Tensor = Callable[[Points], Array | None]


def is_rough(volume: BSplineVolume, space: TrialSpace, tensor: Tensor) -> bool:
    """Return whether G = det J J^-1 kappa J^-T varies much from span to span of a trial space.

    Measured are second differences of G between the middles of three neighbouring spans, relative to G, at SAMPLES^3
    places. G is rough where their root mean square exceeds LIMIT in a direction, and on fewer than three spans.
    tensor: takes points (3, ...) and returns kappa, a scalar (...) or six entries (6, ...), or None for the identity.
    """
    u, v, w = (_stencils(knots) for knots in space.knots)
    rule = GaussRule((u, v, w), (np.ones_like(u), np.ones_like(v), np.ones_like(w)))
    with np.errstate(all="ignore"):  # of a map without an inverse the assembly speaks
        factors = np.stack([_factors(fields, tensor(x)) for _, fields, x in map_planes(volume, rule)])
        return not all(_bend(factors, axis) <= LIMIT for axis in range(3))


def _stencils(knots: Array) -> Array:
    """Return the middles of SAMPLES times three neighbouring spans, of all spans where there are fewer than three."""
    middles = midpoints(knots)
    if len(middles) < 3:
        return middles
    centers = np.linspace(1, len(middles) - 2, SAMPLES).round().astype(int)
    return middles[(centers[:, None] + [-1, 0, 1]).ravel()]


def _factors(fields: Array, kappa: Array | None) -> Array:
    """Return G (q_w, q_v, 3, 3) on a plane from a map's fields (3, 4, q_w, q_v)."""
    tangents = np.moveaxis(fields[:, 1:], (0, 1), (3, 2))  # (q_w, q_v, 3, 3): row a is dF / du_a
    rows = np.cross(np.roll(tangents, -1, axis=2), np.roll(tangents, -2, axis=2))  # of det J J^-1
    det = (tangents[:, :, 0] * rows[:, :, 0]).sum(axis=-1)
    flux = np.swapaxes(rows, 2, 3)
    if kappa is not None and kappa.ndim == 2:
        flux = kappa[..., None, None] * flux
    elif kappa is not None:
        flux = np.moveaxis(kappa[list(SYMMETRIC)], (0, 1), (2, 3)) @ flux
    found: Array = rows @ flux / np.abs(det)[..., None, None]
    return found


def _bend(factors: Array, axis: int) -> float:
    """Return the root mean square of relative second differences along an axis of triples; infinite without triples."""
    if factors.shape[axis] < 3:
        return np.inf
    low, middle, high = (np.moveaxis(factors, axis, 0)[i::3] for i in range(3))
    squares = ((low - 2.0 * middle + high) ** 2).sum(axis=(-2, -1)) / (middle**2).sum(axis=(-2, -1))
    return float(np.sqrt(squares.mean()))
