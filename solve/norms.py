"""Errors against an exact solution, integrated with degree + 2 Gauss points per span and direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.bspline import Array
from parameterize.volume import BSplineVolume

from . import kernels
from .planes import PlaneField, map_planes
from .quadrature import gauss_rule
from .space import TrialSpace


@dataclass(frozen=True)
class Errors:
    """L2 norm of u - u_h, the same over that of u (None where it is zero), and H1 seminorm (None without grad u)."""

    l2: float
    l2_relative: float | None
    h1_seminorm: float | None


def error_norms(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    exact: Callable[[Array, Array, Array], tuple[Array, Array | None]],
) -> Errors:
    """Error norms over the physical domain, slab by slab.

    exact: takes x, y, z and returns u and grad u (3, ...), or None in the gradient's place.
    """
    rule = gauss_rule(space, tuple(p + 2 for p in space.degrees))  # type: ignore[arg-type]
    spline = PlaneField(coefficients, rule.tabulate(space.degrees, space.knots))
    approximate, wanted = np.empty((4, *rule.plane_shape)), np.zeros((4, *rule.plane_shape))
    sums = np.zeros(3)
    has_gradient = True
    for q, fields in map_planes(volume, rule):
        spline.evaluate(q, approximate)
        wanted[0], gradient = exact(*fields[:, 0])
        has_gradient = gradient is not None
        if gradient is not None:
            wanted[1:] = gradient
        sums += kernels.plane_errors(fields, rule.plane_weights(q), approximate, wanted)
    l2, norm, seminorm = np.sqrt(sums).tolist()
    relative = l2 / norm if norm > 0.0 else None
    return Errors(l2, relative, seminorm if has_gradient else None)
