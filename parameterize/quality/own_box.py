"""Measures the box of a block: the mean lengths of the map's derivatives, against which its distortion is measured."""

import numpy as np

from ..arrays import Array
from ..spline.bspline import gauss_points
from ..spline.multipatch import MultiPatch, as_multipatch
from ..spline.volume import BSplineVolume

_GAUSS = 2  # points a span and direction: lengths are means, for which few points suffice


def box_lengths(body: BSplineVolume | MultiPatch) -> Array:
    """Return the mean lengths (patches, 3) of the derivatives of each patch in its three directions."""
    return np.array([_lengths(patch) for patch in as_multipatch(body)])


def _lengths(patch: BSplineVolume) -> Array:
    points, weights = zip(*(gauss_points(row, _GAUSS) for row in patch.knots), strict=True)
    lengths = np.linalg.norm(patch.grid_jacobian(*(x.ravel() for x in points)), axis=-2)  # (..., direction)
    u, v, w = (x.ravel() for x in weights)
    return np.asarray(np.einsum("i,j,k,ijkd->d", u, v, w, lengths))
