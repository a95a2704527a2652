"""Evaluates quantities of a solution: its gradient, its flux, stresses, or a user's expression; and their extremes.

A quantity is a function of u (c, ...), grad (c, 3, ...) and x (3, ...), as a law's flux is, and returns (...) or (k,
...), (k, l, ...). A law names its quantities in `Form.quantities`. Derivatives of a spline converge one order more
slowly than the spline: a stress is less accurate than the displacement.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, IntArray, Mask, in_brackets
from parameterize.quality.rotations import cofactors_and_determinants
from parameterize.spline.bspline import breakpoints, divided_spans, evaluate_at, real_array
from parameterize.spline.volume import UNITS, BSplineVolume

from .field import FieldOnBody, Points, SplineField
from .field_groups import FieldGroup, groups_of
from .forms.form import Form, Quantity

Place = tuple[float, float, float]
Inside = Callable[[Any], Mask]  # whether an extreme may lie at points (3, ...)
PER_SPAN = 3  # intervals a span and direction in which extremes are looked for
SAMPLES = 2**16  # of a search for all extremes, where one a span is not more
_CANDIDATES = 8  # samples around which they are refined
_ZOOMS = 20  # steps of this, each halving the box
_POINTS = 2**16  # evaluated at once


class Beside(NamedTuple):
    """State which columns a function has beside its values: so many internal variables, then perhaps a pressure."""

    states: int
    has_pressure: bool

    @classmethod
    def of(cls, group: FieldGroup) -> "Beside":
        """Return those of a group."""
        return cls(group.states, group.has_pressure)

    @property
    def columns(self) -> int:
        """Return the number of these columns."""
        return self.states + self.has_pressure


@dataclass(frozen=True)
class Extremes:
    """Hold the least and the largest value found of a quantity, with their points in space and their parameters.

    The search samples every span and refines the best samples, so a sharp peak between samples may be missed.

    Attributes
    ----------
    least, largest : float
    least_at, largest_at : three float
        Points in space.
    least_parameters, largest_parameters : three float
    spans : float, optional
        The search left out what lies within so many spans of a singular place; 0 where nothing else is left of a coarse
        mesh, and None where the body has no such place, or the quantity none there.
    radius : float
        The largest distance that so many spans are.
    beside : bool
        Whether the largest value lies where the mesh of one refinement less left it out.

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
    spans: float | None = None
    radius: float = 0.0
    beside: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return the values and the points for report.json."""
        names = ("least", "least_at", "largest", "largest_at")
        names += () if self.spans is None else ("spans", "radius", "beside")  # type: ignore[assignment]
        return {name: getattr(self, name) for name in names}

    def __str__(self) -> str:
        least, largest = in_brackets(self.least_at), in_brackets(self.largest_at)
        found = f"from {self.least:.6g} at {least} to {self.largest:.6g} at {largest}"
        if self.spans is None:
            return found
        far = f"farther than {self.spans:g} spans from" if self.spans else "all of the mesh near to"
        return f"{found}, {far} where it is infinite"


def quantity_of(form: Form, what: str | Quantity) -> Quantity:
    """Return a quantity by its name, or the function itself. Raises ValueError for a name the law does not have."""
    if callable(what):
        return what
    given = form.quantities
    if what not in given:
        raise ValueError(f"{type(form).__name__} gives no {what!r}; it gives {', '.join(given)}, or take a function")
    return given[what]


def volume_of(field: SplineField) -> BSplineVolume:
    """Return the volume of a field. Raises ValueError for a field without a volume."""
    if field.geometry is None:
        raise ValueError("a quantity needs the field's volume: dataclasses.replace(field, geometry=volume)")
    return field.geometry


def at_points(field: SplineField, form: Form, what: str | Quantity, points: ArrayLike) -> Array:
    """Return a quantity (m, ...) at parameters (m, 3); NaN for parameters NaN, as of points outside of the volume."""
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
    spline = (field.degrees, field.knots, field.columns, where)
    slopes = np.stack([evaluate_at(*spline, order) for order in UNITS], axis=-1)  # (m, c, 3)
    return _evaluated(
        quantity,
        np.moveaxis(evaluate_at(*spline), 0, -1),
        np.moveaxis(slopes, 0, -1),
        np.moveaxis(volume.jacobian(where), 0, -1),
        Points.at(np.ascontiguousarray(volume(where).T), where),
        Beside(0 if field.state is None else field.state.shape[-1], field.pressure is not None),
    )


def on_grid(field: SplineField, form: Form, what: str | Quantity, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
    """Return a quantity (len(u), len(v), len(w), ...) on a tensor grid of parameters."""
    rows = [np.atleast_1d(np.asarray(row, dtype=np.float64)) for row in (u, v, w)]
    values = grid_values(field, quantity_of(form, what), *rows)
    return np.moveaxis(values, (-3, -2, -1), (0, 1, 2))


def grid_values(field: SplineField, quantity: Quantity, u: Array, v: Array, w: Array) -> Array:
    """Return a quantity (..., n_u, n_v, n_w) on a grid."""
    volume_of(field)
    (group,) = groups_of(field)
    return group_values(group, quantity, u, v, w)[..., 0, :, :, :]


def group_values(group: FieldGroup, quantity: Quantity, u: Array, v: Array, w: Array) -> Array:
    """Return a quantity (..., k, n_u, n_v, n_w) on a grid of each of k patches."""
    values, x = np.moveaxis(group.values.grid(u, v, w), -1, 0), group.points_on(u, v, w)
    if group.gradients is not None:
        return _found(quantity, values, _in_rows(group.gradients.grid(u, v, w)), x, Beside.of(group))
    slopes, jacobian = group.values.grid_slopes(u, v, w), group.maps.grid_slopes(u, v, w)
    slopes, jacobian = (np.moveaxis(part, (-2, -1), (0, 1)) for part in (slopes, jacobian))
    return _evaluated(quantity, values, slopes, jacobian, x, Beside.of(group))


def _in_rows(gradients: Array) -> Array:
    """Return gradients (c, 3, ...) of an array (..., 3 c)."""
    return np.moveaxis(gradients, -1, 0).reshape(-1, 3, *gradients.shape[:-1])


def _evaluated(quantity: Quantity, u: Array, slopes: Array, jacobian: Array, x: Points, more: Beside) -> Array:
    """Return a quantity (..., shape) from u (c, shape), slopes (c, 3, shape) in the parameters, and J (3, 3, shape).

    Arguments and errors are those of `_found`.
    """
    slopes = slopes[: len(slopes) - more.columns]
    cofactors, det = cofactors_and_determinants(np.ascontiguousarray(jacobian).reshape(3, 3, -1))
    if not det.all():
        raise np.linalg.LinAlgError("Singular matrix")
    # grad_a = sum_b slope_b dU_b / dx_a, the inverse of J being the transposed cofactors over det J
    grad = np.einsum("cbm,abm->cam", slopes.reshape(len(slopes), 3, -1), cofactors) / det
    return _found(quantity, u, grad.reshape(slopes.shape), x, more)


def _found(quantity: Quantity, u: Array, grad: Array, x: Points, more: Beside) -> Array:
    """Return a quantity (..., shape) from u (c, shape) and its gradient (c, 3, shape) at points.

    more: what the last components of u are instead, which the points x take to the quantity; they have no gradient.
    Raises ValueError for a function that fails or does not return numbers of the points' shape.
    """
    if more.has_pressure:
        u, x.pressure = u[:-1], u[-1]
    if more.states:
        u, x.state = u[: -more.states], u[-more.states :]
    try:
        found = np.asarray(quantity(u, grad, x), dtype=np.float64)
    except (TypeError, LookupError, AttributeError, ArithmeticError) as error:
        raise ValueError(f"the quantity fails: {type(error).__name__}: {error}") from error
    return _of_shape(found, x.shape[1:])


def _of_shape(found: Array, shape: tuple[int, ...]) -> Array:
    """Return values (..., shape) at points of a shape; one number is repeated. Raises ValueError for other shapes."""
    if found.ndim == 0:
        return np.broadcast_to(found, shape)
    if found.shape[found.ndim - len(shape) :] != shape:
        raise ValueError(f"a quantity must return an array (..., {', '.join(map(str, shape))}), got {found.shape}")
    return found


def extremes(solution: FieldOnBody, what: str | Quantity) -> Extremes:
    """Return the least and the largest value of a quantity of one number a point, and their places."""
    groups = groups_of(solution)
    (found,) = extremes_of(groups, [[quantity_of(form_of(group), what)] for group in groups], PER_SPAN)
    return found


def all_extremes(solution: FieldOnBody) -> dict[str, Extremes]:
    """Return the extremes of the quantities in reports (`Form.reported`), by name, from one search for all quantities.

    The search uses fewer samples a span than `extremes`, so that it takes a small part of the time of a solve.
    """
    groups = groups_of(solution)
    per_span = samples_per_span(groups, SAMPLES)
    names = form_of(groups[0]).reported
    quantities = [[quantity_of(form_of(group), name) for name in names] for group in groups]
    return dict(zip(names, extremes_of(groups, quantities, per_span), strict=True))


def samples_per_span(groups: Sequence[FieldGroup], most: int) -> int:
    """Return how many intervals a span and direction a search takes that has no more samples than `most`, if it can."""
    spans = sum(len(group) * math.prod(len(breakpoints(knots)) - 1 for knots in group.values.knots) for group in groups)
    return max(1, min(PER_SPAN, int((most / spans) ** (1.0 / 3.0))))


def form_of(group: FieldGroup) -> Form:
    """Return the law of a group."""
    assert group.problem is not None, "a solution knows its problem"
    return group.problem.form


@dataclass(frozen=True, eq=False)
class _Candidates:
    """Hold places where r quantities are large.

    values: (r, m). group: (r, m), the number of the group of each place. rows: (r, m), the patch in the group. places:
    (r, m, 3), parameters. widths: (r, m, 3), of the boxes in which better places are looked for.
    """

    values: Array
    group: IntArray
    rows: IntArray
    places: Array
    widths: Array

    @classmethod
    def joined(cls, parts: "Sequence[_Candidates]") -> "_Candidates":
        """Return the best candidates of all parts."""
        names = [field.name for field in fields(cls)]
        every = cls(*(np.concatenate([getattr(part, name) for part in parts], axis=1) for name in names))
        best = np.argsort(-every.values, axis=1, kind="stable")[:, :_CANDIDATES]
        return every.chosen(best)

    def chosen(self, columns: IntArray) -> "_Candidates":
        """Return some of the candidates of each quantity. columns: (r, m)."""
        each = np.arange(len(columns))[:, None]
        return _Candidates(*(getattr(self, field.name)[each, columns] for field in fields(self)))


def extremes_of(
    groups: Sequence[FieldGroup],
    quantities: Sequence[Sequence[Quantity]],
    per_span: int,
    inside: Inside | None = None,
) -> list[Extremes]:
    """Return the extremes of q quantities, refined from the best samples.

    quantities: those of each group. inside: where they may lie, anywhere by default. Raises ValueError where no sample
    lies there. The arrays inside have 2 q rows: first the negative quantities, whose largest
    values give the least values, then the quantities.
    """
    together = [_together(own, inside) for own in quantities]
    parts = [
        part for number, group in enumerate(groups) for part in _sampled(group, number, together[number], per_span)
    ]
    found = _zoomed(groups, together, _Candidates.joined(parts))
    best = found.chosen(found.values.argmax(axis=1)[:, None])
    if np.isneginf(best.values).any():
        raise ValueError("no sample of the body lies there")
    count = len(best.values) // 2
    peaks = [_peak(groups, best, row) for row in range(2 * count)]
    pairs = zip(peaks[:count], peaks[count:], strict=True)
    return [Extremes(-least[0], least[1], least[2], *largest) for least, largest in pairs]


def _together(quantities: Sequence[Quantity], inside: Inside | None) -> Quantity:
    """Return the quantity (2 q, ...) of q quantities with both signs, minus infinity where extremes may not lie."""

    def values(u: Array, grad: Array, x: Array) -> Array:
        found = np.stack([_one_number(quantity(u, grad, x), x.shape[1:]) for quantity in quantities])
        both = np.concatenate([-found, found])
        return both if inside is None else np.where(inside(x), both, -np.inf)

    return values


def _sampled(group: FieldGroup, number: int, together: Quantity, per_span: int) -> Iterator[_Candidates]:
    """Yield the best samples of a group, piece after piece."""
    rows = [divided_spans(knots, per_span) for knots in group.values.knots]
    widths, patches = [float(np.diff(row).max()) for row in rows], max(1, _POINTS // math.prod(map(len, rows)))
    for start in range(0, len(group), patches):
        for u in slabs(*rows):
            found = group_values(group.take(slice(start, start + patches)), together, u, *rows[1:])
            flat = found.reshape(len(found), -1)
            best = np.argpartition(-flat, min(_CANDIDATES, flat.shape[1]) - 1)[:, :_CANDIDATES]
            patch, i, j, k = np.unravel_index(best, found.shape[1:])
            places = np.stack([u[i], rows[1][j], rows[2][k]], axis=-1)
            values = np.take_along_axis(flat, best, axis=1)
            yield _Candidates(
                values, np.full(best.shape, number), start + patch, places, np.broadcast_to(widths, places.shape)
            )


def _one_number(found: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return a quantity's values at points of that shape. Raises ValueError unless each value is one finite number."""
    values = _of_shape(np.asarray(found, dtype=np.float64), shape)
    extra = values.shape[: values.ndim - len(shape)]
    if math.prod(extra) != 1:
        raise ValueError(
            f"extremes are of one number a point, this quantity has the shape {extra}: "
            "choose a part of it, as in lambda u, grad, x: u[0]"
        )
    if not np.all(np.isfinite(values)):
        raise ValueError("extremes are of finite numbers; this quantity has others")
    return values.reshape(shape)


def _zoomed(groups: Sequence[FieldGroup], together: Sequence[Quantity], start: _Candidates) -> _Candidates:
    """Return better places of each of r quantities, and their values.

    Each place moves to the best of the 27 points around it, in smaller and smaller boxes.
    """
    steps = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    found = start
    for _ in range(_ZOOMS):
        around = np.clip(found.places[..., None, :] + steps * found.widths[..., None, :], 0.0, 1.0)  # (r, m, 27, 3)
        values = np.empty(around.shape[:3])
        for number in np.unique(found.group).tolist():
            row, column = np.nonzero(found.group == number)
            owners = np.repeat(found.rows[row, column], len(steps))
            every = at_places(groups[number], together[number], owners, around[row, column].reshape(-1, 3))
            own = every.reshape(len(every), len(row), len(steps))[row, np.arange(len(row))]  # of each row its quantity
            values[row, column] = own
        top = values.argmax(axis=2)[..., None]
        found = replace(
            found,
            values=np.take_along_axis(values, top, axis=2)[..., 0],
            places=np.take_along_axis(around, top[..., None], axis=2)[:, :, 0],
            widths=found.widths / 2.0,
        )
    return found


def at_places(group: FieldGroup, quantity: Quantity, owners: IntArray, where: Array) -> Array:
    """Return a quantity (..., m) at parameters (m, 3) of patches (m,) of a group."""
    u = np.moveaxis(group.values.at(owners, where), 0, -1)
    x = Points.at(np.ascontiguousarray(group.maps.at(owners, where).T), where)
    if group.gradients is not None:
        return _found(quantity, u, _in_rows(group.gradients.at(owners, where)), x, Beside.of(group))
    slopes, jacobian = group.values.slopes_at(owners, where), group.maps.slopes_at(owners, where)
    slopes, jacobian = (np.moveaxis(part, 0, -1) for part in (slopes, jacobian))
    return _evaluated(quantity, u, slopes, jacobian, x, Beside.of(group))


def _peak(groups: Sequence[FieldGroup], best: _Candidates, row: int) -> tuple[float, Place, Place]:
    """Return the best value of one row, its point and its parameters."""
    group, where = groups[int(best.group[row, 0])], best.places[row]
    point = group.maps.at(best.rows[row], where)
    return float(best.values[row, 0]), tuple(point[0].tolist()), tuple(where[0].tolist())


def slabs(u: Array, v: Array, w: Array) -> Iterator[Array]:
    """Yield the parameters u in pieces, so that the grid of a piece and all v, w does not have too many points."""
    step = max(1, _POINTS // (len(v) * len(w)))
    for start in range(0, len(u), step):
        yield u[start : start + step]
