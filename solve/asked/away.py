"""Keeps largest values of stresses and gradients away from places where these are infinite, and says so of the others.

A largest value is looked for outside of a radius of two spans around such places: within it the number depends on the
mesh. The radius is that of one mesh for all solutions that are compared.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from parameterize.arrays import Array, Mask, listed

from ..outside import needs_gradient
from ..singular import SPANS, SingularPlaces
from ..solution import Solution
from .functional import AtPlace, Extreme, Functional

SHARES = (1.0, 0.5, 0.25)  # of SPANS: smaller radii where a part lies within the first
MOST_PLACES = 2  # that are named

Asked = TypeVar("Asked", bound=Functional)
Near = TypeVar("Near", AtPlace, Extreme)


def away(asked: Functional, solution: Solution) -> Functional:
    """Return a functional whose largest value lies away from the singular places of a solution's mesh."""
    if not isinstance(asked, Extreme | AtPlace) or not needs_gradient(asked.form, asked.quantity_of(asked.form)):
        return asked
    places = solution.singular
    if not len(places):
        return asked
    if isinstance(asked, AtPlace):
        point = solution.body.points(np.array([asked.patch]), asked.parameters[None])
        near = places.is_near(point)[0]
        return _unknown(asked, f"within {SPANS:g} spans of {_named(places)}, where it is infinite") if near else asked
    return _outside(asked, solution, places)


def _outside(asked: Extreme, solution: Solution, places: SingularPlaces) -> Functional:
    """Return the extreme outside of the largest radius that leaves something of its part."""
    for share in SHARES:
        spans = share * SPANS

        def is_near(points: Array, spans: float = spans) -> Mask:
            return places.is_near(points, spans)

        pieces = asked.part.pieces(solution)
        if any(not is_near(piece.points).all() for piece in pieces):
            radius = share * max(place.radius for place in places)
            unit = "span" if spans == 1.0 else "spans"
            said = f"farther than {spans:g} {unit} (at most {radius:.3g}) from {_named(places)}, where it is infinite"
            return replace(_saying(asked, said), is_excluded=is_near)
    return _unknown(asked, f"a number without meaning: all of the mesh there lies near to {_named(places)}")


def _unknown(asked: Near, said: str) -> Near:
    """Return a functional that has no interval: near a singular place no error can be seen."""
    return replace(_saying(asked, said), unknown="near a place where it is infinite, what a mesh adds says nothing")


def _named(places: SingularPlaces) -> str:
    return listed([place.text for place in places], MOST_PLACES)


def _saying(asked: Asked, said: str) -> Asked:
    return replace(asked, said="; ".join(filter(None, (asked.said, said))))
