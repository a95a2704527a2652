"""Errors against an exact solution, integrated with degree + 2 Gauss points per span and direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from ..threads import in_parallel
from . import kernels
from .planes import PlaneField, map_planes
from .quadrature import gauss_rule
from .space import TrialSpace

PLANES = 16  # of points of u, in a piece of work


@dataclass(frozen=True)
class Errors:
    """L2 norm and H1 seminorm of u - u_h, and the same over those of u.

    None: the relative errors where u or its gradient is zero, both of H1 where the gradient of u is unknown.
    """

    l2: float
    l2_relative: float | None
    h1_seminorm: float | None
    h1_relative: float | None

    @classmethod
    def from_squares(cls, squares: Array, has_gradient: bool) -> Errors:
        """From the integrals (4,) of (u - u_h)^2, u^2, |grad u - grad u_h|^2 and |grad u|^2."""
        l2, norm, seminorm, slope = np.sqrt(squares).tolist()
        return cls(
            l2,
            l2 / norm if norm > 0.0 else None,
            seminorm if has_gradient else None,
            seminorm / slope if has_gradient and slope > 0.0 else None,
        )


def error_norms(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    exact: Callable[[Array], tuple[Array, Array | None]],
    threads: int = 1,
) -> Errors:
    """Return error norms over the physical domain, over all components (c, n_u, n_v, n_w) together.

    exact: takes points (3, ...) and returns u (c, ...) and grad u (c, 3, ...), or None in the gradient's place.
    """
    rule = gauss_rule(space, tuple(p + 2 for p in space.degrees))  # type: ignore[arg-type]
    tables = rule.tabulate(space.degrees, space.knots)
    splines = [PlaneField(component, tables) for component in coefficients]
    sums = np.zeros((rule.shape[0], 4))  # plane by plane: the same total for any number of threads
    has_gradient = []

    def integrate(points: range) -> None:
        approximate, wanted = np.empty((4, *rule.plane_shape)), np.zeros((4, *rule.plane_shape))
        for q, fields, x in map_planes(volume, rule, points):
            values, gradients = exact(x)
            has_gradient.append(gradients is not None)
            for c, spline in enumerate(splines):
                spline.evaluate(q, approximate)
                wanted[0] = values[c]
                if gradients is not None:
                    wanted[1:] = gradients[c]
                sums[q] += kernels.plane_errors(fields, rule.plane_weights(q), approximate, wanted)

    planes = range(rule.shape[0])
    in_parallel(integrate, [planes[start : start + PLANES] for start in planes[::PLANES]], threads)
    return Errors.from_squares(sums.sum(axis=0), all(has_gradient))
