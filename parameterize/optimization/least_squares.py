"""Fits the first spline to the trained network: least squares on pairs (G(x), x), slightly smoothed (section 4.3.2)."""

import numpy as np

from ..arrays import Array, Knots
from ..conjugate_gradients import conjugate_gradients
from ..spline.bspline import basis_derivatives
from ..spline.spline_map import SplineMap
from .bending import bending_operator, grams
from .operators import ControlRows, weighted_sum
from .tensor_product import KroneckerInverse


def fit_pairs(
    parameters: Array,
    points: Array,
    weights: Array,
    knots: Knots,
    degree: int,
    *,
    fairness: float,
    tolerance: float = 1e-5,
) -> SplineMap:
    """Return the map that minimises sum w |F(parameters) - points|^2 + fairness int |Hessian|^2.

    parameters: (m, 3) in the unit cube. points: (m, 3). weights: (m,), with sum 1. This is the discrete form of the
    paper's least squares on G(F(x)) = x. In spans without samples the smoothing term alone determines the map.
    tolerance: of the linear system's residual, relative.
    """
    sizes, span = [len(k) - degree - 1 for k in knots], (degree + 1) ** 3
    tables = [basis_derivatives(k, degree, parameters[:, d]) for d, k in enumerate(knots)]
    i, j, k = (first[:, None] + np.arange(degree + 1) for first, _ in tables)
    u, v, w = (values[0] for _, values in tables)
    columns = (i[:, :, None, None] * sizes[1] + j[:, None, :, None]) * sizes[2] + k[:, None, None, :]
    basis = u[:, :, None, None] * v[:, None, :, None] * w[:, None, None, :]
    rows = ControlRows(columns.reshape(-1, span), basis.reshape(-1, span))
    matrices = grams(knots, (degree,) * 3)
    mass, _, curve = matrices
    smooth = bending_operator(matrices, fairness)
    precondition = KroneckerInverse(tuple(fairness * c for c in curve), mass, shift=1.0)
    operator = weighted_sum([(1.0, rows.squared(weights[:, None, None] * np.eye(3))), (1.0, smooth)])
    right = rows.adjoint(weights[:, None] * points, np.zeros((3, *sizes)))
    found = conjugate_gradients(operator, right, precondition, tolerance, max_iterations=300)
    return SplineMap.on_cube(degree, knots, found.x)
