"""Quantities of a solution: its gradient, its flux, stresses, or an expression of one's own; and its extremes.

A quantity is a function of u (c, ...), grad (c, 3, ...) and x (3, ...), as a law's flux is, and returns (...) or
(k, ...), (k, l, ...). A law names those it gives (`Form.quantities`). Derivatives of a spline converge one order more
slowly than the spline: a stress is less accurate than the displacement.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, in_brackets
from parameterize.spline.bspline import divided_spans, evaluate_at, evaluate_grid, real_array
from parameterize.spline.volume import BSplineVolume

from .discretization.estimate import FIRST
from .field import Points, SplineField
from .forms.form import Form, Quantity

Place = tuple[float, float, float]
_PER_SPAN = 3  # intervals a span and direction in which extremes are looked for
_CANDIDATES = 8  # samples around which they are refined
_ZOOMS = 30  # steps of this, each halving the box
_POINTS = 2**16  # evaluated at once


@dataclass(frozen=True)
class Extremes:
    """The least and the largest value of a quantity that were found, where in space, and at which parameters.

    The search samples every span and refines the best samples, so a sharp peak between samples may be missed.

    Attributes
    ----------
    least, largest : float
    least_at, largest_at : three float
        Points in space.
    least_parameters, largest_parameters : three float

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="2*x"))
    >>> found = solution.extremes(lambda u, grad, x: grad[0, 0])
    >>> round(found.least, 2), round(found.largest, 2)
    (2.0, 2.0)
    """

    least: float
    least_at: Place
    least_parameters: Place
    largest: float
    largest_at: Place
    largest_parameters: Place

    def __str__(self) -> str:
        least, largest = in_brackets(self.least_at), in_brackets(self.largest_at)
        return f"from {self.least:.6g} at {least} to {self.largest:.6g} at {largest}"


def quantity_of(form: Form, what: str | Quantity) -> Quantity:
    """Return a quantity by its name, or the function itself. Raises ValueError for a name the law does not give."""
    if callable(what):
        return what
    given = form.quantities
    if what not in given:
        raise ValueError(f"{type(form).__name__} gives no {what!r}; it gives {', '.join(given)}, or take a function")
    return given[what]


def volume_of(field: SplineField) -> BSplineVolume:
    """Return the volume of a field. Raises ValueError where it is not known."""
    if field.geometry is None:
        raise ValueError("a quantity needs the field's volume: dataclasses.replace(field, geometry=volume)")
    return field.geometry


def at_points(field: SplineField, form: Form, what: str | Quantity, points: ArrayLike) -> Array:
    """Return a quantity (m, ...) at parameters (m, 3); NaN where these are NaN, as of points outside of the volume."""
    where = np.atleast_2d(real_array(points, "points"))
    if where.ndim != 2 or where.shape[1] != 3:
        raise ValueError(f"points must have shape (m, 3), got {np.shape(points)}")
    inside = ~np.isnan(where).any(axis=1)
    found = _values(field, quantity_of(form, what), where[inside])
    values = np.full((len(where), *found.shape[:-1]), np.nan)
    values[inside] = np.moveaxis(found, -1, 0)
    return values


def _values(field: SplineField, quantity: Quantity, where: Array) -> Array:
    """Return a quantity (..., m) at parameters (m, 3)."""
    volume = volume_of(field)
    spline = (field.degrees, field.knots, _vectors(field), where)
    slopes = np.stack([evaluate_at(*spline, order) for order in FIRST], axis=-1)  # (m, c, 3)
    return _evaluated(
        quantity,
        np.moveaxis(evaluate_at(*spline), 0, -1),
        np.moveaxis(slopes, 0, -1),
        np.moveaxis(volume.jacobian(where), 0, -1),
        Points.at(np.ascontiguousarray(volume(where).T), where),
    )


def on_grid(field: SplineField, form: Form, what: str | Quantity, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
    """Return a quantity (len(u), len(v), len(w), ...) on a tensor grid of parameters."""
    rows = [np.atleast_1d(np.asarray(row, dtype=np.float64)) for row in (u, v, w)]
    values = grid_values(field, quantity_of(form, what), *rows)
    return np.moveaxis(values, (-3, -2, -1), (0, 1, 2))


def grid_values(field: SplineField, quantity: Quantity, u: Array, v: Array, w: Array) -> Array:
    """Return a quantity (..., n_u, n_v, n_w) on a grid."""
    volume = volume_of(field)
    spline = (field.degrees, field.knots, _vectors(field), (u, v, w))
    slopes = np.stack([evaluate_grid(*spline, order) for order in FIRST], axis=-1)  # (.., c, 3)
    return _evaluated(
        quantity,
        np.moveaxis(evaluate_grid(*spline), -1, 0),
        np.moveaxis(slopes, (-2, -1), (0, 1)),
        np.moveaxis(volume.grid_jacobian(u, v, w), (-2, -1), (0, 1)),
        Points.on(volume, u, v, w),
    )


def _vectors(field: SplineField) -> Array:
    """Return the coefficients (m_u, m_v, m_w, c), also of one component."""
    return field.coefficients[..., None] if field.coefficients.ndim == 3 else field.coefficients


def _evaluated(quantity: Quantity, u: Array, slopes: Array, jacobian: Array, x: Points) -> Array:
    """Return a quantity (..., shape) from u (c, shape), slopes (c, 3, shape) in the parameters, and J (3, 3, shape).

    Raises ValueError for a function that fails or does not return numbers of the points' shape.
    """
    inverse = np.moveaxis(np.linalg.inv(np.moveaxis(jacobian, (0, 1), (-2, -1))), (-2, -1), (0, 1))
    grad = np.einsum("cb...,ba...->ca...", slopes, inverse)
    try:
        found = np.asarray(quantity(u, grad, x), dtype=np.float64)
    except (TypeError, LookupError, AttributeError, ArithmeticError) as error:
        raise ValueError(f"the quantity fails: {type(error).__name__}: {error}") from error
    shape = x.shape[1:]
    if found.ndim == 0:
        return np.broadcast_to(found, shape)
    if found.shape[found.ndim - len(shape) :] != shape:
        raise ValueError(f"a quantity must return an array (..., {', '.join(map(str, shape))}), got {found.shape}")
    return found


def extremes(field: SplineField, form: Form, what: str | Quantity) -> Extremes:
    """Return the least and the largest value of a quantity of one number a point, and where they are."""
    quantity = quantity_of(form, what)
    least, largest = (_extreme(field, quantity, sign) for sign in (-1.0, 1.0))
    return Extremes(*least, *largest)


def _extreme(field: SplineField, quantity: Quantity, sign: float) -> tuple[float, Place, Place]:
    """Return the largest value of sign times the quantity, without that sign, its point and its parameters."""
    rows = [divided_spans(knots, _PER_SPAN) for knots in field.knots]
    places, values = np.empty((0, 3)), np.empty(0)
    for u in slabs(*rows):
        found = sign * grid_values(field, quantity, u, *rows[1:])
        if math.prod(found.shape[:-3]) != 1:
            raise ValueError(
                f"extremes are of one number a point, this quantity has the shape {found.shape[:-3]}: "
                "choose a part of it, as in lambda u, grad, x: u[0]"
            )
        if not np.all(np.isfinite(found)):
            raise ValueError("extremes are of finite numbers; this quantity has others")
        found = found.reshape(found.shape[-3:])
        best = np.argsort(-found, axis=None, kind="stable")[:_CANDIDATES]
        i, j, k = np.unravel_index(best, found.shape)
        places = np.concatenate([places, np.column_stack([u[i], rows[1][j], rows[2][k]])])
        values = np.concatenate([values, found.ravel()[best]])
    order = np.argsort(-values, kind="stable")[:_CANDIDATES]
    places, values = _zoomed(field, quantity, sign, places[order], values[order], [_widest(row) for row in rows])
    best_place = places[np.argmax(values)]
    point = volume_of(field)(best_place)[0]
    return float(sign * values.max()), tuple(point.tolist()), tuple(best_place.tolist())


def _zoomed(
    field: SplineField, quantity: Quantity, sign: float, places: Array, values: Array, widths: Sequence[float]
) -> tuple[Array, Array]:
    """Return better places (k, 3) and their values: the best of the 27 points around each, in ever smaller boxes."""
    steps = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3) * widths
    for _ in range(_ZOOMS):
        around = np.clip(places[:, None] + steps, 0.0, 1.0)  # (k, 27, 3)
        found = sign * _values(field, quantity, around.reshape(-1, 3)).reshape(len(places), -1)
        top = found.argmax(axis=1)
        places, values = around[np.arange(len(places)), top], found[np.arange(len(places)), top]
        steps = steps / 2.0
    return places, values


def _widest(row: Array) -> float:
    return float(np.diff(row).max())


def slabs(u: Array, v: Array, w: Array) -> Iterator[Array]:
    """Yield the parameters u in pieces, so that a grid over each and all v, w has not too many points."""
    step = max(1, _POINTS // (len(v) * len(w)))
    for start in range(0, len(u), step):
        yield u[start : start + step]
