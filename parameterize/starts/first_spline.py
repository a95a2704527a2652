"""Makes the first F of starts that know the places of inner points in the cube: a fit to these and to the boundary."""

import numpy as np

from ..arrays import Array
from ..optimization.least_squares import fit_pairs
from ..optimization.surface_distance import Correspondence
from ..spline.spline_map import SplineMap

COARSE = 5 / 9  # of the spans a direction, in the first rounds: enough for the shape, at a fraction of the time
_BOUNDARY_SHARE = 0.2  # weight of the surface's samples; those inside have the rest of 1, and so decide where F folds
_FAIRNESS = 1e-7  # of the fit: determines coefficients without samples, and hardly moves the rest


def first_spline(inside: Array, places: Array, fit: Correspondence) -> SplineMap:
    """Return the spline fitted by least squares to places (k, 3) and points (k, 3), and to the boundary.

    inside: the points in the solid. places: their places in the cube. fit: the points of the surface with their
    parameters. This is step 2 of section 4.3.2.
    """
    weights = [
        np.full(len(inside), (1.0 - _BOUNDARY_SHARE) / max(len(inside), 1)),
        np.full(len(fit.points), _BOUNDARY_SHARE / len(fit.points)),
    ]
    return fit_pairs(
        np.concatenate([places, fit.places.parameters]),
        np.concatenate([inside, fit.points]),
        np.concatenate(weights),
        fit.places.knots,
        fit.places.nets.degree,
        fairness=_FAIRNESS,
    )
