"""The operator of any law, matrix-free: evaluate on a plane of points, pull back, the law, push forward, spread.

With R the rows of J^-1 times the root of w |det J|, a parametric gradient g becomes R^T g = sqrt(w |det J|) grad u; the
law is linear, so its flux s has the same factor, and R s is what parametric gradients of tests meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from ..forms.form import Form, Fused, reaction
from ..threads import colours, in_parallel
from . import kernels
from .operator import Operator, Window, to_blocks
from .planes import PlaneField, map_planes
from .quadrature import GaussRule, Table
from .space import TrialSpace


@dataclass(frozen=True, eq=False)
class FormOperator:
    """Matrix of a law's form, never assembled. Coefficients are (c, n_u, n_v, n_w).

    tables: the trial basis at the rule's points. window: the free coefficients of each component. threads: of a
    product. rows: (q_u, 3, 3, q_w, q_v), R above, kept for a law with a compiled version; else R follows from the map.
    """

    volume: BSplineVolume
    form: Form
    space: TrialSpace
    rule: GaussRule
    tables: tuple[Table, Table, Table]
    rows: Array | None
    window: Window
    threads: int = 1

    def apply(self, coefficients: Array) -> Array:
        """Return the product with coefficients (c, n_u, n_v, n_w), those that are not free included."""
        result = np.zeros((self.form.components, *self.space.shape))
        components = [PlaneField(component, self.tables) for component in coefficients]
        u, v, w = self.tables

        def add(points: IntArray) -> None:
            fields = np.empty((len(components), 4, *self.rule.plane_shape))
            for q, rows, turn in self._laws(points):
                for component, out in zip(components, fields, strict=True):
                    component.evaluate(q, out)
                turn(fields, rows)
                weights = np.ascontiguousarray(u.values[:, q])
                for field, total in zip(fields, result, strict=True):
                    kernels.spread_plane(field, u.first[q], weights, *v, *w, self.form.has_reaction, total)

        for pieces in self._pieces:
            in_parallel(add, pieces, self.threads)
        return result

    @cached_property
    def _pieces(self) -> tuple[list[IntArray], list[IntArray]]:
        return colours(self.tables[0].first, self.space.degrees[0], self.threads)

    def _laws(self, points: IntArray) -> Iterator[tuple[int, Array, Fused]]:
        """Yield q, R and what turns values and gradients by the parameters into reactions and fluxes, in place."""
        fused = self.form.fused
        if fused is not None and self.rows is not None:
            yield from ((q, self.rows[q], fused) for q in points)
        else:
            for q, rows, measure, x in self._geometry(points):
                yield q, rows, partial(_law, self.form, measure, x)

    def _geometry(self, points: IntArray) -> Iterator[tuple[int, Array, Array, Points]]:
        """Yield q, and R, w |det J| and the points in space on its plane."""
        rows, measure = np.empty((3, 3, *self.rule.plane_shape)), np.empty(self.rule.plane_shape)
        for q, fields, x in map_planes(self.volume, self.rule, points):
            kernels.plane_rows(fields, self.rule.plane_weights(q), rows, measure)
            yield q, rows, np.abs(measure), x

    def apply_free(self, free: Array) -> Array:
        """Return the product restricted to the free coefficients, (c, ...) of the window's shape."""
        full = np.zeros((self.form.components, *self.space.shape))
        full[:, *self.window] = free
        return self.apply(full)[:, *self.window]

    def block(self, component: int) -> Operator:
        """Return the symmetric part of a component's diagonal block: the law of its own gradient and value."""
        operator = Operator.empty(self.space, self.rule, self.form.has_reaction, self.window, self.threads)

        def fill(points: IntArray) -> None:
            for q, rows, measure, x in self._geometry(points):
                factors = operator.factors[q]
                factors[-1] = 0.0  # the last block may exceed the plane
                tensor = Form.tensor(self.form, x, component)  # six entries, whatever shorter form the law has
                assert tensor is not None
                kernels.tensor_factors(rows, tensor, factors)
                if self.form.has_reaction:
                    factors[:, :, 6] = to_blocks(self.form.mass(x, component) * measure)

        for pieces in self._pieces:
            in_parallel(fill, pieces, self.threads)
        return operator


def _law(form: Form, measure: Array, x: Points, fields: Array, rows: Array) -> None:
    """Apply a law to fields (c, 4, q_w, q_v) on a plane, in place."""
    scale, gradient = np.sqrt(measure), np.empty_like(fields[:, 1:])
    values = fields[:, 0] * scale
    kernels.turn(rows, fields[:, 1:], gradient, False)
    fields[:, 0] = reaction(form, values, gradient, x) * scale
    flux = np.ascontiguousarray(form.flux(values, gradient, x), dtype=np.float64)
    kernels.turn(rows, flux, fields[:, 1:], True)
