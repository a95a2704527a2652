"""Splines on planes of quadrature points: the slab by slab evaluation under assembly and error norms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from . import kernels
from .quadrature import GaussRule, Table


class PlaneField:
    """A scalar spline with its basis tabulated at a rule.

    coefficients: (n_u, n_v, n_w); tables: as `GaussRule.tabulate` returns them.
    """

    def __init__(self, coefficients: Array, tables: tuple[Table, Table, Table]) -> None:
        self._coefficients = np.ascontiguousarray(coefficients)
        self._tables = tables

    def evaluate(self, q: int, out: Array) -> None:
        """Write value and parametric gradient on the plane through point `q` of direction u: out (4, q_w, q_v)."""
        u, v, w = self._tables
        weights = np.ascontiguousarray(u.values[:, q])
        kernels.evaluate_plane(self._coefficients, u.first[q], weights, *v, *w, out)


def map_planes(
    volume: BSplineVolume, rule: GaussRule, points: Iterable[int] | None = None
) -> Iterator[tuple[int, Array, Points]]:
    """Yield for every point q of direction u: q, the map on its plane, and its points in space, (3, q_w, q_v).

    The map is (3, 4, q_w, q_v): components x value and gradient. points: the q wanted, default all. The arrays are
    reused from one step to the next.
    """
    tables = rule.tabulate(volume.degrees, volume.knots)
    components = [PlaneField(volume.control_points[..., c], tables) for c in range(3)]
    fields = np.empty((3, 4, *rule.plane_shape))
    u, v, w = rule.points
    for q in range(rule.shape[0]) if points is None else points:
        for component, out in zip(components, fields, strict=True):
            component.evaluate(q, out)
        yield q, fields, Points.of(fields[:, 0], (u[q : q + 1], v, w), (2, 1))


def count_folded(measure: Array, rule: GaussRule, q: int) -> int:
    """Count the points with det J < 0 on the plane of point `q`, from measure (q_w, q_v) = w det J.

    Raises ValueError where det J is zero, naming the place.
    """
    if measure.min() > 0.0:
        return 0
    flat = np.argwhere(measure == 0.0)
    if flat.size:
        w, v = flat[0]
        where = tuple(float(rule.points[a][i]) for a, i in enumerate((q, v, w)))
        raise ValueError(f"volume: det J is zero at the parameters {where}; such a map has no inverse there")
    return int(np.count_nonzero(measure < 0.0))
