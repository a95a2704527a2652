"""Defines Part: a body, a part of it, or a part of its boundary, with quadrature points for a solution on it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from parameterize.arrays import Array, IntArray, Mask, in_brackets
from parameterize.quality.rotations import cofactors_and_determinants
from parameterize.spline.body import Body, all_control_points
from parameterize.spline.bspline import breakpoints, gauss_points

from ..discretization.surface_rule import SurfaceRule
from ..field import FieldOnBody
from ..field_groups import FieldGroup, groups_of
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.form import Form, Quantity
from ..forms.region import FacesOfPoints, Region, tolerance
from ..integrals import surface_rules_on
from ..quantities import at_places, group_values
from .cut_cells import points_in, spans_of

POINTS = 2**16  # at once
MORE = 1  # Gauss points a direction beyond the degree, as of an operator

QuantityOf = Callable[[Form], Quantity]  # laws differ from patch to patch


class Piece(ABC):
    """Describe m quadrature points of patches of a group.

    group: of k patches. weights: (m,), in space. normal: (3, m), outward unit normals of points on the boundary,
    otherwise None.
    """

    group: FieldGroup
    weights: Array
    normal: Array | None = None

    if TYPE_CHECKING:  # Scattered has fields of these names

        @property
        def rows(self) -> IntArray:
            """Return the places (m,) of the patches in the group."""

        @property
        def places(self) -> Array:
            """Return the parameters (m, 3)."""

    @abstractmethod
    def values(self, quantity_of: QuantityOf) -> Array:
        """Return a quantity (..., m)."""

    @property
    def points(self) -> Array:
        """Return the points (m, 3) in space."""
        return self.group.maps.at(self.rows, self.places)

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
class Scattered(Piece):
    """Hold points one by one."""

    group: FieldGroup
    rows: IntArray
    places: Array
    weights: Array
    normal: Array | None = None

    def values(self, quantity_of: QuantityOf) -> Array:
        """Return a quantity (..., m)."""
        return at_places(self.group, quantity_of(self.form), self.rows, self.places)


@dataclass(frozen=True, eq=False)
class OnGrid(Piece):
    """Hold the points of a tensor grid of parameters of every patch, whose values take a tenth of the time."""

    group: FieldGroup
    grid: tuple[Array, Array, Array]
    weights: Array

    @property
    def rows(self) -> IntArray:
        """Return the places (m,) of the patches in the group."""
        return np.repeat(np.arange(len(self.group)), math.prod(map(len, self.grid)))

    @property
    def places(self) -> Array:
        """Return the parameters (m, 3)."""
        own = np.stack(np.meshgrid(*self.grid, indexing="ij"), axis=-1).reshape(-1, 3)
        return np.tile(own, (len(self.group), 1))

    def values(self, quantity_of: QuantityOf) -> Array:
        """Return a quantity (..., m)."""
        found = group_values(self.group, quantity_of(self.form), *self.grid)
        return found.reshape(*found.shape[:-4], -1)


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
        if not any(spans_of(group.stack, group.knots, self.holds)[1].any() for group in self.body.groups):
            raise ValueError(f"no part of the body lies in {str(self.region)!r}; {_told(self.body)}")

    @cached_property
    def _nowhere(self) -> FacesOfPoints:
        """Return the faces of points inside: none."""
        return FacesOfPoints(("",), np.array(0), tolerance(all_control_points(self.body).T))

    def pieces(self, solution: FieldOnBody, groups: Sequence[FieldGroup] = ()) -> Iterator[Piece]:
        """Yield the quadrature points of the part. Raises ValueError where it is empty.

        groups: of the patches of the solution; by default those with each patch's own gradients.
        """
        groups = groups or self.groups(solution)
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
            yield Scattered(group, rows, rule.at.parameters, rule.weights, rule.at.normal)

    def _in_group(self, group: FieldGroup, count: int) -> Iterator[Piece]:
        """Yield the points of a group, those of whole spans first."""
        spans = math.prod(len(breakpoints(row)) - 1 for row in group.values.knots)
        patches = max(1, POINTS // (spans * count**3))
        for start in range(0, len(group), patches):
            own = group.take(slice(start, start + patches))
            if self.region is None:
                yield from _whole(own, count)
                continue
            every, some = spans_of(own.maps, own.values.knots, self.holds)
            kept = np.flatnonzero(every.any(axis=(1, 2, 3)))
            if len(kept):
                yield from _whole(own.take(kept), count, every[kept])
            for rows, places, weights in points_in(own.maps, own.values.knots, some & ~every, self.holds, count):
                size = np.abs(np.linalg.det(own.maps.slopes_at(rows, places)))
                yield Scattered(own, rows, places, weights * size)


def _whole(group: FieldGroup, count: int, spans: Mask | None = None) -> Iterator[Piece]:
    """Yield Gauss points of spans (k, s_u, s_v, s_w), by default of all; others have no weight."""
    pairs = [gauss_points(knots, count) for knots in group.values.knots]
    (u, v, w), (a, b, c) = ([part.ravel() for part in parts] for parts in zip(*pairs, strict=True))
    step = count * max(1, POINTS // (len(v) * len(w) * len(group) * count))
    for start in range(0, len(u), step):
        here = slice(start, start + step)
        slopes = np.moveaxis(group.maps.grid_slopes(u[here], v, w), (-2, -1), (0, 1))
        _, det = cofactors_and_determinants(np.ascontiguousarray(slopes).reshape(3, 3, -1))
        weights = np.einsum("i,j,k,nijk->nijk", a[here], b, c, np.abs(det).reshape(slopes.shape[2:]))
        if spans is not None:
            own = spans[:, start // count : -(-(start + step) // count)]
            if not own.any():
                continue
            for axis in (1, 2, 3):
                own = np.repeat(own, count, axis=axis)
            weights *= own
        yield OnGrid(group, (u[here], v, w), weights.ravel())


def _told(body: Body) -> str:
    """Return between which points the body lies."""
    net = all_control_points(body)
    return f"the body lies between {in_brackets(net.min(axis=0))} and {in_brackets(net.max(axis=0))}"
