"""Searches parts of a body, or of its boundary, for the largest value of a quantity."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from parameterize.arrays import Array, Mask
from parameterize.spline.patch_groups import group_of
from parameterize.spline.volume import FACE_NAMES

from ..ask import Place
from ..averaging import averaged_groups
from ..discretization.surface_rule import Faces
from ..field import FieldOnBody
from ..forms.region import FacesOfPoints, tolerance
from ..quantities import extremes_of, samples_per_span
from .parts import Part, Piece, QuantityOf, Scattered

SAMPLES = 2**20  # of a search, where one a span is not more
CANDIDATES = 8  # points around which places on faces are refined
ZOOMS = 20  # steps of this, each halving the square

Excluded = Callable[[Array], Mask]  # of points (m, 3)
Found = tuple[float, Place, int, Array]  # value, point, patch and parameters (3,)


def extreme_inside(
    part: Part, solution: FieldOnBody, quantity_of: QuantityOf, is_max: bool, is_excluded: Excluded | None
) -> Found:
    """Return the largest or the smallest value in a part of the body, with gradients averaged where patches meet.

    Raises ValueError where no sample lies there.
    """
    groups = averaged_groups(solution, part.body, part.problems)
    quantities = [[quantity_of(group.problem.form)] for group in groups if group.problem is not None]

    def inside(x: Any) -> Mask:
        found = part.holds(x)
        if is_excluded is None:
            return found
        points = np.asarray(x).reshape(3, -1).T
        return found & ~is_excluded(points).reshape(found.shape)

    per_span = samples_per_span(groups, SAMPLES)
    is_all = part.region is None and is_excluded is None
    (found,) = extremes_of(groups, quantities, per_span, None if is_all else inside)
    value, at, where = (
        (found.largest, found.largest_at, found.largest_parameters)
        if is_max
        else (found.least, found.least_at, found.least_parameters)
    )
    return value, at, int(part.body.locate([at])[0][0]), np.array(where)


def extreme_on_boundary(
    part: Part, solution: FieldOnBody, quantity_of: QuantityOf, is_max: bool, is_excluded: Excluded | None
) -> Found:
    """Return the largest or the smallest value on a part of the boundary: at quadrature points, refined on faces.

    Gradients are averaged where patches meet. Raises ValueError where no sample lies there.
    """
    groups = averaged_groups(solution, part.body, part.problems)
    sign, best = 1.0 if is_max else -1.0, list[tuple[float, Piece, Array, int]]()
    for piece in part.pieces(solution, groups):
        values = sign * np.ravel(piece.values(quantity_of))
        if is_excluded is not None:
            values = np.where(is_excluded(piece.points), -np.inf, values)
        axis = int(np.argmin(np.ptp(piece.places, axis=0)))
        for k in np.argsort(-values, kind="stable")[:CANDIDATES].tolist():
            best.append((float(values[k]), piece, piece.places[k], axis))
        best = sorted(best, key=lambda one: -one[0])[:CANDIDATES]
    best = [one for one in best if one[0] > -math.inf]
    if not best:
        raise ValueError("no sample of the boundary lies there")
    found = [_zoomed(part, *one, sign, quantity_of, is_excluded) for one in best]
    value, piece, place = max(found, key=lambda one: one[0])
    x, y, z = piece.group.maps.at(piece.rows[:1], place[None])[0].tolist()
    return sign * value, (x, y, z), int(piece.patches[0]), place


def _zoomed(
    part: Part,
    value: float,
    piece: Piece,
    place: Array,
    axis: int,
    sign: float,
    quantity_of: QuantityOf,
    is_excluded: Excluded | None,
) -> tuple[float, Piece, Array]:
    """Return a better value near a place on a face, and its place: the best of nine, in smaller and smaller squares."""
    patch, side = int(piece.patches[0]), int(round(place[axis]))
    faces = Faces.of(group_of(part.body.patches[patch]), axis, side)
    name = part.body.face_name(patch, FACE_NAMES[2 * axis + side])
    near, along = tolerance(faces.nets[0].T), [a for a in range(3) if a != axis]
    widths = np.array([0.5 / (len(np.unique(piece.group.values.knots[a])) - 1) for a in along])
    steps = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    for _ in range(ZOOMS):
        around = np.clip(place[along] + steps * widths, 0.0, 1.0)
        x, area = faces.points_and_areas(np.zeros(len(around), dtype=np.int64), around)
        normal = area / np.maximum(np.linalg.norm(area, axis=0), np.finfo(float).tiny)
        assert part.region is not None
        held = part.region.holds_on(x, normal, FacesOfPoints((name,), np.zeros(len(around), dtype=np.int64), near))
        if is_excluded is not None:
            held = held & ~is_excluded(x.T)
        some = faces.parameters(around)[held]
        if len(some):
            here = Scattered(piece.group, np.full(len(some), piece.rows[0]), some, np.ones(len(some)))
            values = sign * np.ravel(here.values(quantity_of))
            if values.max() > value:
                value, place = float(values.max()), some[values.argmax()]
        widths = widths / 2.0
    return value, piece, place
