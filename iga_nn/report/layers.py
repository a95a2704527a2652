"""Makes the layers of the view: sharp edges, regions of loads and supports, and places where a gradient is infinite."""

from itertools import cycle, islice
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body
from solve.field import FieldOnBody
from solve.singular import SingularPlaces

from ..figures.fields import points_of
from ..figures.first_view import conditions_of
from ..figures.outline import is_by_face, outline
from ..figures.palette import TEN
from ..figures.region_numbers import numbers_of
from .packed import Drawn, numbered

MOST_MARKS = 3000  # of singular places


def layers_of(body: BodyLike, solution: FieldOnBody | None, drawn: Drawn) -> dict[str, Any]:
    """Return the layers for the script, by numbers of the samples on the outer faces that the page has.

    `edges` has the ends of pieces of sharp edges; `regions` the legend of the conditions and, at each sample, the
    number of its region and 1, or 0 for none; `singular` the texts of singular places and the samples next to them.
    """
    points, _ = drawn.thinned(points_of(body))
    found = outline(body, points)
    layers: dict[str, Any] = {"edges": numbered(found.edges), "regions": None, "singular": None}
    layers["blocks"] = len(as_body(body))
    if is_by_face(body):
        layers["smooth"] = int(found.faces.max()) + 1
    if conditions := conditions_of(solution):
        twice = slice(None, None, 2 * drawn.coarser)
        numbers = numbers_of(body, conditions)[:, twice, twice]
        colors = list(islice(cycle(TEN), len(conditions)))
        names = [f"{one.kind}: {one.region}{f' = {one.text}' if one.text else ''}" for one in conditions]
        layers["regions"] = {
            "legend": list(zip(colors, names, strict=True)),
            "numbers": numbered(np.minimum(numbers + 1, 255), np.uint8),
        }
    places: SingularPlaces = getattr(solution, "singular", SingularPlaces())
    if len(places):
        layers["singular"] = {"texts": [one.text for one in places], "marks": numbered(_nearest(places, points))}
    return layers


def _nearest(places: SingularPlaces, points: Array) -> Array:
    """Return the numbers of the samples (f, m, m, 3) that are nearest to points of singular places, each once."""
    known = np.concatenate([place.points for place in places])
    chosen = known[:: -(-len(known) // MOST_MARKS)]
    return np.unique(cKDTree(points.reshape(-1, 3)).query(chosen)[1])
