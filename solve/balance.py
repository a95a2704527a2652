"""Problems that leave the solution's constant open, as pure Neumann data do: data in balance, and the mean."""

from __future__ import annotations

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .discretization.planes import PlaneField, map_planes
from .discretization.quadrature import gauss_rule
from .discretization.space import TrialSpace
from .forms.problem import BoundaryValueProblem

LARGEST_IMBALANCE = 0.01  # of the data's size; what quadrature leaves of data in balance is far below


def balanced(load: Array) -> Array:
    """Return the load (1, n_u, n_v, n_w) less its mean.

    The basis functions sum to one, so the load is then orthogonal to constants.

    Raises ValueError where the load's sum, the integral of source and fluxes, is not nearly zero.
    """
    total, size = float(load.sum()), float(np.abs(load).sum())
    if abs(total) > LARGEST_IMBALANCE * size:
        raise ValueError(
            f"incompatible Neumann data: source plus flux integrate to {total:.4g}, must be 0 where no Dirichlet face, "
            "no Robin face and no reaction fixes the solution"
        )
    return load - load.mean()


def missing_mean(volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: BoundaryValueProblem) -> float:
    """Return the constant that gives the solution the mean of `exact`, or mean zero without one."""
    rule = gauss_rule(space)
    spline = PlaneField(coefficients, rule.tabulate(space.degrees, space.knots))
    plane = np.empty((4, *rule.plane_shape))
    lack = size = 0.0
    for q, fields, x in map_planes(volume, rule):
        spline.evaluate(q, plane)
        wanted = 0.0 if problem.exact is None else problem.exact_at(x)[0][0]
        measure = rule.plane_weights(q) * np.abs(np.linalg.det(np.moveaxis(fields[:, 1:], (0, 1), (2, 3))))
        lack += float(((wanted - plane[0]) * measure).sum())
        size += float(measure.sum())
    return lack / size
