"""Fits a spline to a curve in the plane, with as many spans as it needs."""

import numpy as np

from ...arrays import Array
from ...spline.bspline import collocation, open_uniform_knots
from ..planar.curves import Curve

_CLOSE = 1e-4  # of the diagonal: the distance of a fitted curve from the outline's curve, at most
_OWN = 0.25  # of the distance between curve and polygonal line: closer is not worth more spans, unless this is large
_FINEST = 1e-6  # of the diagonal
_TRIED = (1, 2, 3, 4, 6, 8, 12, 16, 24)  # spans
_DENSE = 8  # samples of a span


def fitted(curve: Curve, knots: Array, degree: int) -> Array:
    """Return the control points (n, 2) of the spline that is nearest to a curve, with its ends."""
    places = np.linspace(0.0, 1.0, _DENSE * (len(knots) - 2 * degree) + 1)
    matrix, goal = collocation(knots, degree, places).toarray(), curve.at(places)
    ends = goal[[0, -1]]
    inner = np.linalg.lstsq(matrix[:, 1:-1], goal - matrix[:, [0, -1]] @ ends, rcond=None)[0]
    return np.concatenate([ends[:1], inner, ends[1:]])


def needed_spans(curve: Curve, degree: int, diagonal: float) -> int:
    """Return the fewest spans of a spline that is close enough to a curve."""
    if curve.is_straight:
        return 1
    for spans in _TRIED:
        knots = open_uniform_knots(degree + spans, degree)
        places = np.linspace(0.0, 1.0, 4 * _DENSE * spans + 1)
        gap = collocation(knots, degree, places) @ fitted(curve, knots, degree) - curve.at(places)
        if np.linalg.norm(gap, axis=1).max() <= tolerance_of(curve, diagonal):
            return spans
    return _TRIED[-1]


def tolerance_of(curve: Curve, diagonal: float) -> float:
    """Return how far a spline may be from a curve."""
    middles = 0.5 * (curve.places[1:] + curve.places[:-1])
    own = float(np.linalg.norm(curve.at(middles) - 0.5 * (curve.points[1:] + curve.points[:-1]), axis=1).max())
    return min(max(_OWN * own, _FINEST * diagonal), _CLOSE * diagonal)


def deviation(curve: Curve, knots: Array, degree: int, control: Array) -> float:
    """Return the largest distance of a spline from the polygonal line of a curve."""
    places = np.linspace(0.0, 1.0, 4 * _DENSE * (len(knots) - 2 * degree) + 1)
    points = collocation(knots, degree, places) @ control
    start, along = curve.points[:-1], np.diff(curve.points, axis=0)
    gap = points[:, None] - start
    share = np.clip(np.sum(gap * along, axis=-1) / np.sum(along**2, axis=-1), 0.0, 1.0)
    return float(np.linalg.norm(gap - share[..., None] * along, axis=-1).min(axis=1).max())
