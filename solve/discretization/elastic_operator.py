"""The operator of linear elasticity, matrix-free, on vector-valued splines.

Nine numbers a Gauss point, F = sqrt(w / det J) times the rows of det J J^-1, turn a component's parametric gradient g
into sqrt(w det J) grad u = F^T g; the stress follows, and F takes it back. Arrays have the component first:
(3, n_u, n_v, n_w).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from ..threads import colours, in_parallel
from . import elastic_kernels, kernels
from .operator import PAIRS, Operator, Window, to_blocks
from .planes import PlaneField, count_folded, map_planes
from .quadrature import GaussRule, Table, span_tables
from .space import TrialSpace

PIECE = 12  # planes of Gauss points in a piece of the assembly
VectorFunction = Callable[[Array, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class ElasticOperator:
    """Symmetric positive semidefinite matrix of the form, never assembled; its kernel are the rigid motions.

    tables: the trial basis at the Gauss points. factors: (q_u, 3, 3, q_w, q_v), F by rows. constants: Lame's lambda
    and mu. window: the free coefficients of each component. threads: of a product.
    """

    space: TrialSpace
    tables: tuple[Table, Table, Table]
    factors: Array
    constants: tuple[float, float]
    window: Window
    threads: int = 1

    def apply(self, coefficients: Array) -> Array:
        """The product with coefficients (3, n_u, n_v, n_w), rows and columns that are not free included."""
        result = np.zeros((3, *self.space.shape))
        components = [PlaneField(component, self.tables) for component in coefficients]
        u, v, w = self.tables
        spans = len(span_tables(self.space, self.tables)[0].first)
        per_span = len(u.first) // spans

        def add(layers: NDArray[np.int64]) -> None:
            fields = np.empty((3, 4, *self.factors.shape[3:]))
            for q in range(per_span * layers[0], per_span * (layers[-1] + 1)):
                for component, out in zip(components, fields, strict=True):
                    component.evaluate(q, out)
                elastic_kernels.plane_stress(fields, self.factors[q], *self.constants)
                weights = np.ascontiguousarray(u.values[:, q])
                for field, total in zip(fields, result, strict=True):
                    elastic_kernels.spread_plane(field, u.first[q], weights, *v, *w, total)

        for pieces in colours(spans, self.space.degrees[0]):
            in_parallel(add, pieces, self.threads)
        return result

    def apply_free(self, free: Array) -> Array:
        """The product restricted to the free coefficients, (3, ...) of the window's shape."""
        full = np.zeros((3, *self.space.shape))
        full[:, *self.window] = free
        return self.apply(full)[:, *self.window]

    def block(self, component: int) -> Operator:
        """Return the diagonal block of one component: the scalar operator with kappa = mu I + (lambda + mu) e e^T."""
        lam, mu = self.constants
        q_u, _, _, q_w, q_v = self.factors.shape
        factors = np.empty((q_u, -(-q_v // kernels.LANES), q_w, len(PAIRS), kernels.LANES))

        def fill(q: int) -> None:
            rows = self.factors[q]  # (3, 3, q_w, q_v), row of the parametric direction
            for index, (a, b) in enumerate(PAIRS):
                term = mu * (rows[a] * rows[b]).sum(axis=0) + (lam + mu) * rows[a, component] * rows[b, component]
                factors[q, :, :, index] = to_blocks(term)

        in_parallel(fill, range(q_u), self.threads)
        return Operator(self.space, self.tables, factors, self.window, self.threads)


@dataclass(frozen=True, eq=False)
class ElasticSystem:
    """Operator, load (3, n_u, n_v, n_w), and how many of the Gauss points have det J < 0."""

    operator: ElasticOperator
    load: Array
    folded: int
    points: int


def assemble_elasticity(
    volume: BSplineVolume,
    space: TrialSpace,
    force: VectorFunction,
    constants: tuple[float, float],
    rule: GaussRule,
    window: Window,
    threads: int = 1,
) -> ElasticSystem:
    """Assemble operator and load in one pass over the Gauss points; `force` returns (3, q_w, q_v).

    threads: of this pass and of the operator; the result is the same for any number, and `force` must be safe to call
    from several threads. Where the map is folded, |det J| takes the place of det J.
    Raises ValueError where det J is zero at a Gauss point, naming it.
    """
    tables = rule.tabulate(space.degrees, space.knots)
    u, v, w = tables
    factors = np.empty((rule.shape[0], 3, 3, *rule.plane_shape))
    loads = np.empty((rule.shape[0], 3, *space.shape[1:]))  # of each plane of Gauss points, before direction u
    folded = []

    def fill(points: NDArray[np.int64]) -> None:
        for q, fields in map_planes(volume, rule, points):
            tangents = np.moveaxis(fields[:, 1:], (0, 1), (3, 2))  # (q_w, q_v, 3, 3): row a is dF / du_a
            cofactors = np.cross(np.roll(tangents, -1, axis=2), np.roll(tangents, -2, axis=2))
            det = (tangents[:, :, 0] * cofactors[:, :, 0]).sum(axis=-1)
            weights = rule.plane_weights(q)
            folded.append(count_folded(weights * det, rule, q))
            factors[q] = np.moveaxis(cofactors, (2, 3), (0, 1)) * np.sqrt(weights / np.abs(det))
            measure = weights * np.abs(det)
            for density, plane in zip(force(*fields[:, 0]), loads[q], strict=True):
                kernels.integrate_plane(density * measure, v.first, v.values[0], w.first, w.values[0], plane)

    in_parallel(fill, np.array_split(np.arange(rule.shape[0]), -(-rule.shape[0] // PIECE)), threads)
    load = np.zeros((3, *space.shape))
    for q, planes in enumerate(loads):  # in one order, whatever thread came first
        load[:, u.first[q] : u.first[q] + u.values.shape[2]] += u.values[0, q][:, None, None] * planes[:, None]
    operator = ElasticOperator(space, tables, factors, constants, window, threads)
    return ElasticSystem(operator, load, sum(folded), int(np.prod(rule.shape)))
