"""One pass over the quadrature points: a law's operator and its load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from ..forms.form import Form
from ..threads import colours, in_parallel
from . import kernels
from .form_operator import FormOperator
from .operator import Operator, Window, free_window, to_blocks
from .planes import count_folded, map_planes
from .quadrature import GaussRule, operator_rule
from .space import TrialSpace

Source = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Assembled:
    """Operator, load (c, n_u, n_v, n_w), and how many of the quadrature points have det J < 0."""

    operator: Operator | FormOperator
    load: Array
    folded: int
    points: int


def assemble(
    volume: BSplineVolume,
    space: TrialSpace,
    form: Form,
    source: Source | None = None,
    rule: GaussRule | None = None,
    *,
    window: Window | None = None,
    is_scalar: bool = True,
    threads: int = 1,
) -> Assembled:
    """Return operator and load of a law on a volume.

    source: takes the points (3, q_w, q_v) of a plane and returns (c, q_w, q_v); None for zero.
    window: the free coefficients, as `free_window` gives them (default: all but those of the six faces).
    is_scalar: the law is symmetric, has one component and does not couple u with its gradient: six numbers a point, or
        seven with a reaction, hold it.
    threads: of this pass and of the operator; the functions must then be safe to call from several at a time.

    Where the map is folded, |det J| takes the place of det J. The geometry is the volume's own, evaluated exactly
    whatever the trial space. Raises ValueError where det J is zero at a point, naming it.
    """
    rule, window = rule or operator_rule(space), window or free_window(space)
    operator: Operator | FormOperator
    if is_scalar:
        operator = Operator.empty(space, rule, form.has_reaction, window, threads)
    else:
        rows = np.empty((rule.shape[0], 3, 3, *rule.plane_shape)) if form.fused is not None else None
        tables = rule.tabulate(space.degrees, space.knots)
        operator = FormOperator(volume, form, space, rule, tables, rows, window, threads)
    u, v, w = operator.tables
    load = np.zeros((form.components, *space.shape))
    folded = []

    def fill(points: IntArray) -> None:
        measure, plane = np.empty(rule.plane_shape), np.empty(space.shape[1:])
        for q, fields, x in map_planes(volume, rule, points):
            weights = rule.plane_weights(q)
            if isinstance(operator, Operator):
                _write_factors(form, fields, x, weights, measure, operator.factors[q])
            else:
                rows = np.empty((3, 3, *rule.plane_shape)) if operator.rows is None else operator.rows[q]
                kernels.plane_rows(fields, weights, rows, measure)
            folded.append(count_folded(measure, rule, q))
            if source is None:
                continue
            for density, total in zip(source(x), load, strict=True):
                field = (density * np.abs(measure))[None, :, None]
                kernels.integrate_plane(field, 0, v.first, v.values[0], w.first, w.values[0], plane)
                total[u.first[q] : u.first[q] + u.values.shape[2]] += np.multiply.outer(u.values[0, q], plane)

    for pieces in colours(u.first, space.degrees[0], threads):
        in_parallel(fill, pieces, threads)
    return Assembled(operator, load, sum(folded), int(np.prod(rule.shape)))


def _write_factors(form: Form, fields: Array, x: Points, weights: Array, measure: Array, factors: Array) -> None:
    """Write the factors of a scalar law on a plane, and measure (q_w, q_v) = w det J."""
    tensor = form.tensor(x)
    if tensor is None or tensor.ndim == 2:
        kappa = np.ones(weights.shape) if tensor is None else np.ascontiguousarray(tensor)
        kernels.plane_factors(fields, weights, kappa, factors, measure)
        if measure.min() < 0.0:  # measured with |det J|, the form stays positive: an answer to show, if not to trust
            factors[:, :, :6] *= to_blocks(np.sign(measure))[:, :, None]
    else:
        rows = np.empty((3, 3, *weights.shape))
        kernels.plane_rows(fields, weights, rows, measure)
        factors[-1] = 0.0  # the last block may exceed the plane
        kernels.tensor_factors(rows, np.ascontiguousarray(tensor), factors)
    if form.has_reaction:
        factors[:, :, 6] = to_blocks(form.mass(x) * np.abs(measure))
