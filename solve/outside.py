"""Searches extremes of gradients and stresses outside of the singular places, where they are infinite.

Where patches meet their gradients are averaged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from parameterize.arrays import Mask

from .averaging import averaged_groups
from .field import FieldOnBody
from .field_groups import FieldGroup, groups_of
from .forms.form import Form, Quantity
from .quantities import (
    PER_SPAN,
    SAMPLES,
    Extremes,
    all_extremes,
    extremes,
    extremes_of,
    form_of,
    quantity_of,
    samples_per_span,
)
from .singular import SPANS, SingularPlaces

RADII = (SPANS, SPANS / 2.0, SPANS / 4.0)  # in spans: smaller ones where all of a coarse mesh lies within the first
_BESIDE = 2.2  # times the radius: a mesh of spans twice as long left this out, up to its rounding


@dataclass
class _Outside:
    """Say where points lie farther than so many spans from singular places, and whether any did."""

    places: SingularPlaces
    spans: float
    are_there: bool = False

    def __call__(self, x: Any) -> Mask:
        """Return the mask (...) of points (3, ...)."""
        points = np.moveaxis(np.asarray(x), 0, -1)
        found = ~self.places.is_near(points.reshape(-1, 3), self.spans).reshape(points.shape[:-1])
        self.are_there |= bool(found.any())
        return found


def extremes_outside(solution: FieldOnBody, what: str | Quantity, places: SingularPlaces) -> Extremes:
    """Return the extremes of a quantity, of one that is infinite at singular places those outside of them."""
    if not needs_gradient(form_of(groups_of(solution)[0]), what):
        return extremes(solution, what)
    return _found(averaged_groups(solution), [what], PER_SPAN, places)[0]


def all_extremes_outside(solution: FieldOnBody, places: SingularPlaces) -> dict[str, Extremes]:
    """Return the extremes of the quantities in reports, by name, as `extremes_outside` does for each."""
    groups = averaged_groups(solution)
    form = form_of(groups[0])
    names = [name for name in form.reported if needs_gradient(form, name)]
    if not names or not len(places) and groups[0].gradients is None:
        return all_extremes(solution)
    per_span, rest = samples_per_span(groups, SAMPLES), [name for name in form.reported if name not in names]
    found = dict(zip(names, _found(groups, names, per_span, places), strict=True))
    if rest:
        quantities = [[quantity_of(form_of(group), name) for name in rest] for group in groups]
        found |= dict(zip(rest, extremes_of(groups, quantities, per_span), strict=True))
    return {name: found[name] for name in form.reported}


def _found(
    groups: Sequence[FieldGroup], whats: Sequence[str | Quantity], per_span: int, places: SingularPlaces
) -> list[Extremes]:
    """Return the extremes outside of the largest radius that leaves something of the body."""
    quantities = [[quantity_of(form_of(group), what) for what in whats] for group in groups]
    if not len(places):
        return extremes_of(groups, quantities, per_span)
    for spans in RADII:
        outside = _Outside(places, spans)
        try:
            found = extremes_of(groups, quantities, per_span, outside)
        except ValueError:
            if outside.are_there:
                raise
            continue
        points = [one.largest_at for one in found]
        beside = places.is_near(points, _BESIDE * spans).tolist()
        radius = spans / SPANS * max(place.radius for place in places)
        return [replace(o, spans=spans, radius=radius, beside=near) for o, near in zip(found, beside, strict=True)]
    return [replace(one, spans=0.0, beside=True) for one in extremes_of(groups, quantities, per_span)]


def needs_gradient(form: Form, what: str | Quantity) -> bool:
    """Return whether a quantity depends on the gradient: whether it is no number where the gradient is none."""
    quantity, x = quantity_of(form, what), np.zeros((3, 1))
    try:
        with np.errstate(all="ignore"):
            found = quantity(np.ones((form.components, 1)), np.full((form.components, 3, 1), np.nan), x)
        return bool(np.isnan(np.asarray(found, dtype=np.float64)).any())
    except (TypeError, ValueError, LookupError, AttributeError, ArithmeticError):
        return True  # the search says what is wrong with it
