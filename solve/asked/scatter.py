"""Measures how a linear functional of a difference varies around its places: it may vanish there by chance."""

from itertools import product

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import breakpoints

from ..solution import PatchSolution, Solution
from .samples import Samples

MOST = 256  # points of a functional that may cancel by chance; an integral over many does not
SHIFTS = np.array(list(product((0.25, 0.75), repeat=3)))  # of its points, in spans


def scatter(samples: Samples, one: Solution, other: Solution) -> float:
    """Return the root mean square of a functional of the difference of two solutions, over shifts of its points.

    Points are shifted within their spans of the first solution. 0 for functionals of many points.
    """
    if len(samples.patches) > MOST:
        return 0.0
    found = np.zeros(len(SHIFTS))
    for number in np.unique(samples.patches).tolist():
        own = np.flatnonzero(samples.patches == number)
        places = _shifted(one.patches[number], samples.places[own])
        pairs = zip(_fields(one.patches[number], places), _fields(other.patches[number], places), strict=True)
        u, grad = ((new - old).reshape(len(SHIFTS), len(own), *old.shape[1:]) for old, new in pairs)
        rows = len(samples.of_u)
        found += np.einsum("cm,smc->s", samples.of_u[:, own], u[..., :rows])
        found += np.einsum("cdm,smcd->s", samples.of_grad[:, :, own], grad)
    return float(np.sqrt(np.mean(found**2)))


def _shifted(patch: PatchSolution, places: Array) -> Array:
    """Return places (8 m, 3): those of each shift, in the spans of the places (m, 3)."""
    found = np.empty((len(SHIFTS), *places.shape))
    for axis, knots in enumerate(patch.knots):
        breaks = breakpoints(knots)
        span = np.clip(np.searchsorted(breaks, places[:, axis], side="right") - 1, 0, len(breaks) - 2)
        low, size = breaks[span], np.diff(breaks)[span]
        inside = (places[:, axis] - low) / size
        found[:, :, axis] = low + size * ((inside + SHIFTS[:, axis, None]) % 1.0)
    return found.reshape(-1, 3)


def _fields(patch: PatchSolution, places: Array) -> tuple[Array, Array]:
    """Return u (m, c), with a pressure in the last column where there is one, and its gradient (m, c, 3)."""
    u = patch.quantity(lambda u, grad, x: u, places)
    if patch.pressure is not None:
        u = np.column_stack([u, patch.quantity(lambda u, grad, x: x.pressure, places)])
    return u, patch.quantity(lambda u, grad, x: grad, places)
