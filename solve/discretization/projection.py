"""Projects a function onto the trial space in L2, in the parameters, one direction after the other."""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from .quadrature import spline_rule
from .space import TrialSpace


def projected(volume: BSplineVolume, space: TrialSpace, values: Callable[[Points], Array]) -> Array:
    """Return coefficients (c, n_u, n_v, n_w) of a function of points (3, ...) that returns (c, ...)."""
    rows = [spline_rule(knots, degree, 2 * degree) for knots, degree in zip(space.knots, space.degrees, strict=True)]
    found = np.asarray(values(Points.on(volume, *(points for points, _ in rows))), dtype=np.float64)
    for axis, (points, weights) in enumerate(rows):
        basis = collocation(space.knots[axis], space.degrees[axis], points).toarray()
        weighted = (weights[:, None] * basis).T
        projection = csr_array(np.linalg.solve(weighted @ basis, weighted))
        found = apply_along(projection, found, axis + 1)
    return found
