"""Errors against an exact solution, integrated with degree + 2 Gauss points per span and direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.volume import BSplineVolume

from . import kernels
from .planes import PlaneField, map_planes
from .quadrature import gauss_rule
from .space import TrialSpace
from .threads import in_parallel

PLANES = 16  # of points of u, in a piece of work


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
    threads: int = 1,
) -> Errors:
    """Error norms over the physical domain, slab by slab.

    exact: takes x, y, z and returns u and grad u (3, ...), or None in the gradient's place.
    """
    rule = gauss_rule(space, tuple(p + 2 for p in space.degrees))  # type: ignore[arg-type]
    spline = PlaneField(coefficients, rule.tabulate(space.degrees, space.knots))
    sums = np.zeros((rule.shape[0], 3))  # plane by plane: the same total for any number of threads
    has_gradient = []

    def integrate(points: range) -> None:
        approximate, wanted = np.empty((4, *rule.plane_shape)), np.zeros((4, *rule.plane_shape))
        for q, fields in map_planes(volume, rule, points):
            spline.evaluate(q, approximate)
            wanted[0], gradient = exact(*fields[:, 0])
            has_gradient.append(gradient is not None)
            if gradient is not None:
                wanted[1:] = gradient
            sums[q] = kernels.plane_errors(fields, rule.plane_weights(q), approximate, wanted)

    planes = range(rule.shape[0])
    in_parallel(integrate, [planes[start : start + PLANES] for start in planes[::PLANES]], threads)
    l2, norm, seminorm = np.sqrt(sums.sum(axis=0)).tolist()
    relative = l2 / norm if norm > 0.0 else None
    return Errors(l2, relative, seminorm if all(has_gradient) else None)
