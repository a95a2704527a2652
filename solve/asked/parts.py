"""Defines Part: a body, a part of it, or a part of its boundary, with quadrature points for a solution on it."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, IntArray, Mask, in_brackets
from parameterize.spline.body import Body, all_control_points
from parameterize.spline.bspline import breakpoints, gauss_points

from ..discretization.surface_rule import SurfaceRule
from ..field import FieldOnBody
from ..field_groups import FieldGroup, groups_of
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.form import Form, Quantity
from ..forms.region import FacesOfPoints, Region, tolerance
from ..integrals import surface_rules_on
from ..quantities import at_places
from .cut_cells import points_inside

POINTS = 2**16  # at once
MORE = 2  # Gauss points a direction beyond the degree, as for errors

QuantityOf = Callable[[Form], Quantity]  # laws differ from patch to patch


@dataclass(frozen=True, eq=False)
class Piece:
    """Hold m points of patches of a group: places (m, 3), parameters, of patches at rows (m,) with weights (m,).

    normal: (3, m), outward unit normals of points on the boundary, otherwise None.
    """

    group: FieldGroup
    rows: IntArray
    places: Array
    weights: Array
    normal: Array | None = None

    def values(self, quantity_of: QuantityOf) -> Array:
        """Return a quantity (..., m)."""
        return at_places(self.group, quantity_of(self.form), self.rows, self.places)

    @property
    def form(self) -> Form:
        """Return the law of the group."""
        assert self.group.problem is not None
        return self.group.problem.form

    @property
    def patches(self) -> IntArray:
        """Return the numbers (m,) of the patches."""
        return self.group.numbers[self.rows]


@dataclass(frozen=True, eq=False)
class Part:
    """Hold a part of a body, or of its boundary.

    region: placed in the body; None for all of the body. on_boundary: whether it is a part of the boundary.
    """

    body: Body
    problems: Sequence[BoundaryValueProblem]  # of the patches
    region: Region | None = None
    on_boundary: bool = False
    # What is found first serves every solution on the same spans: values of two solutions then differ by no rule.
    _counts: dict[int, int] = field(default_factory=dict, repr=False)
    _rules: dict[int, list[tuple[int, SurfaceRule]]] = field(default_factory=dict, repr=False)

    def groups(self, solution: FieldOnBody) -> tuple[FieldGroup, ...]:
        """Return the patches of a solution in groups."""
        return groups_of(solution, self.body, self.problems)

    def holds(self, x: Array) -> Mask:
        """Return whether points (3, ...) lie in the part; for a part of the body."""
        if self.region is None:
            return np.ones(x.shape[1:], dtype=bool)
        points = np.asarray(x)
        return self.region.holds_on(points, np.zeros_like(points), self._nowhere)

    def demand_some(self) -> None:
        """Raise ValueError where the part is empty."""
        if self.region is None:
            return
        if self.on_boundary:
            next(surface_rules_on(self.body.patches, self.body, [self.region]))
            return
        for group in self.body.groups:
            for _ in points_inside(group.stack, [breakpoints(row) for row in group.knots], self.holds, 1):
                return
        raise ValueError(f"no part of the body lies in {str(self.region)!r}; {_told(self.body)}")

    @cached_property
    def _nowhere(self) -> FacesOfPoints:
        """Return the faces of points inside: none."""
        return FacesOfPoints(("",), np.array(0), tolerance(all_control_points(self.body).T))

    def pieces(self, solution: FieldOnBody) -> Iterator[Piece]:
        """Yield the quadrature points of the part. Raises ValueError where it is empty."""
        groups = self.groups(solution)
        spans = sum(len(group) * math.prod(len(breakpoints(row)) - 1 for row in group.values.knots) for group in groups)
        if self.on_boundary:
            yield from self._on_boundary(solution, groups, spans)
            return
        most = max(max(*group.values.degrees, *group.maps.degrees) for group in groups)
        count, is_empty = self._counts.setdefault(spans, most + MORE), True
        for group in groups:
            for piece in self._in_group(group, count):
                is_empty = False
                yield piece
        if is_empty:
            raise ValueError(f"no part of the body lies in {str(self.region)!r}; {_told(self.body)}")

    def _on_boundary(self, solution: FieldOnBody, groups: Sequence[FieldGroup], spans: int) -> Iterator[Piece]:
        assert self.region is not None
        if spans not in self._rules:
            self._rules[spans] = list(surface_rules_on(solution.patches, self.body, [self.region]))
        places = {int(number): (group, row) for group in groups for row, number in enumerate(group.numbers)}
        for number, rule in self._rules[spans]:
            group, row = places[number]
            rows = np.full(len(rule.weights), row)
            yield Piece(group, rows, rule.at.parameters, rule.weights, rule.at.normal)

    def _in_group(self, group: FieldGroup, count: int) -> Iterator[Piece]:
        """Yield the points of a group, those of whole spans first."""
        breaks = [breakpoints(row) for row in group.values.knots]
        spans = math.prod(len(row) - 1 for row in breaks)
        patches = max(1, POINTS // (spans * count**3))
        for start in range(0, len(group), patches):
            own = group.take(slice(start, start + patches))
            if self.region is None:
                yield from _whole(own, count)
            else:
                for rows, places, weights in points_inside(own.maps, breaks, self.holds, count):
                    yield Piece(own, rows, places, weights * _size(own, rows, places))


def _told(body: Body) -> str:
    """Return between which points the body lies."""
    net = all_control_points(body)
    return f"the body lies between {in_brackets(net.min(axis=0))} and {in_brackets(net.max(axis=0))}"


def _whole(group: FieldGroup, count: int) -> Iterator[Piece]:
    """Yield Gauss points of all spans."""
    pairs = [gauss_points(knots, count) for knots in group.values.knots]
    (u, v, w), (a, b, c) = ([part.ravel() for part in parts] for parts in zip(*pairs, strict=True))
    step = max(1, POINTS // (len(v) * len(w) * len(group)))
    for start in range(0, len(u), step):
        here = slice(start, start + step)
        places = np.stack(np.meshgrid(u[here], v, w, indexing="ij"), axis=-1).reshape(-1, 3)
        weights = np.einsum("i,j,k->ijk", a[here], b, c).ravel()
        rows = np.repeat(np.arange(len(group)), len(places))
        every = np.tile(places, (len(group), 1))
        yield Piece(group, rows, every, np.tile(weights, len(group)) * _size(group, rows, every))


def _size(group: FieldGroup, rows: IntArray, places: Array) -> Array:
    """Return the volume element (m,)."""
    return np.asarray(np.abs(np.linalg.det(group.maps.slopes_at(rows, places))))
