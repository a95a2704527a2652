"""Derivatives of formulas as arrays, for the tests."""

import numpy as np

from solve.forms.jets import coordinates, stacked


def gradient(expression, x, y, z):
    """Value (...) and gradient (3, ...) at points given by arrays of equal shape."""
    return _derivatives(expression, (), x, y, z)[:2]


def hessian(expression, x, y, z):
    """Value (...), gradient (3, ...) and Hessian (6, ...): xx, xy, xz, yy, yz, zz."""
    return _derivatives(expression, (0.0,) * 6, x, y, z)


def _derivatives(expression, seconds, *points):
    points = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in points)))
    jet, shape = expression.jet(coordinates(points, seconds)), points.shape[1:]
    return stacked([jet.value], shape)[0], stacked(jet.gradient, shape), stacked(jet.hessian[: len(seconds)], shape)
