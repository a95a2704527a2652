"""Chains lines in the plane into curves between corners, and fits splines to these."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, IntArray
from ...spline.bspline import collocation, open_uniform_knots
from ...surface.features import chains_between, runs_on
from .plane_warp import PlaneWarp
from .polygons import cross

WIDEST = np.pi / 2.0 + 0.05  # radians by which a piece turns at most: it becomes an edge of a quadrangle
SAMPLES = 33  # of a piece, in equal steps of its parameter
_LONGER = 3.0  # times the next line: such a line is a straight part of an outline, beside an arc of short lines
_CLOSE = 1e-4  # of the diagonal: the distance of a fitted curve from the outline's curve, at most
_OWN = 0.25  # of the distance between curve and polygonal line: closer is not worth more spans, unless this is large
_FINEST = 1e-6  # of the diagonal
_TRIED = (1, 2, 3, 4, 6, 8, 12, 16, 24)  # spans
_DENSE = 8  # samples of a span


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve between two nodes through the points of a polygonal line.

    Attributes
    ----------
    ends : two int
        The numbers of its nodes.
    points : (k, 2) array
        From the first node to the last, k >= 2.
    tangents : (k, 2) array
        Unit vectors at the points.
    """

    ends: tuple[int, int]
    points: Array
    tangents: Array

    @cached_property
    def places(self) -> Array:
        """Return the parameter (k,) of each point from 0 to 1, in proportion to the lengths of the lines."""
        lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])
        return np.asarray(lengths / lengths[-1])

    @property
    def length(self) -> float:
        """Return the length of the polygonal line."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())

    @cached_property
    def is_straight(self) -> bool:
        """Return whether it is a straight line."""
        along = self.points[-1] - self.points[0]
        return bool(np.abs(cross(self.points - self.points[0], along)).max() <= 1e-12 * (along @ along))

    def at(self, places: Array) -> Array:
        """Return the points (n, 2) at parameters (n,): cubic between two points of the line, with tangents there."""
        if self.is_straight:
            return np.asarray(self.points[0] + places[:, None] * (self.points[-1] - self.points[0]))
        k = np.clip(np.searchsorted(self.places, places, side="right") - 1, 0, len(self.points) - 2)
        s = ((places - self.places[k]) / (self.places[k + 1] - self.places[k]))[:, None]
        a, b = self.points[k], self.points[k + 1]
        size = np.linalg.norm(b - a, axis=1)[:, None]
        bends = s * (1.0 - s) ** 2 * size * self.tangents[k] - s**2 * (1.0 - s) * size * self.tangents[k + 1]
        return np.asarray((1.0 + 2.0 * s) * (1.0 - s) ** 2 * a + s**2 * (3.0 - 2.0 * s) * b + bends)

    @cached_property
    def samples(self) -> Array:
        """Return points (SAMPLES, 2) in equal steps of the parameter."""
        return self.at(np.linspace(0.0, 1.0, SAMPLES))

    @property
    def reversed(self) -> "Curve":
        """Return the same curve, run through the other way."""
        return Curve(self.ends[::-1], self.points[::-1], -self.tangents[::-1])

    def part(self, first: int, last: int, ends: tuple[int, int]) -> "Curve":
        """Return the part between two of its points, with given nodes."""
        return Curve(ends, self.points[first : last + 1], self.tangents[first : last + 1])

    def with_point(self, place: float) -> tuple["Curve", int]:
        """Return the curve with a point near a place from 0 to 1, and the number of the point.

        It is one of its own unless they are far from there.
        """
        inner = self.places[1:-1]
        near = int(np.abs(inner - place).argmin()) + 1 if len(inner) else 0
        if near and abs(self.places[near] - place) < 0.5 * min(place, 1.0 - place):
            return self, near
        k = int(np.clip(np.searchsorted(self.places, place), 1, len(self.places) - 1))
        between = self.places[k - 1 : k + 1]
        if not self.is_straight:
            place = float(between.mean())
        along = self.points[k] - self.points[k - 1]
        tangent = (along / np.linalg.norm(along))[None]
        points = np.concatenate([self.points[:k], self.at(np.array([place])), self.points[k:]])
        return Curve(self.ends, points, np.concatenate([self.tangents[:k], tangent, self.tangents[k:]])), k

    def moved(self, field: PlaneWarp) -> "Curve":
        """Return the curve in the plane that a field has moved."""
        return Curve(self.ends, field(self.points), field.directions(self.points, self.tangents))

    def halves(self, node: int) -> tuple["Curve", "Curve"]:
        """Return two parts with a new node between them, near the middle."""
        curve, k = self.with_point(0.5)
        last = len(curve.points) - 1
        return curve.part(0, k, (self.ends[0], node)), curve.part(k, last, (node, self.ends[1]))


@dataclass(frozen=True, eq=False)
class Chain:
    """A smooth chain of lines between two corners, or a closed one without corners (then its ends are equal).

    points: (k, 2), of a closed chain the first is not repeated. ends: the numbers of the corners; () of a closed one.
    """

    points: Array
    ends: tuple[int, ...]

    @cached_property
    def turns(self) -> Array:
        """Return the turn (k,) in radians at each point, 0 at corners."""
        along = np.diff(self._ring, axis=0)
        inner = np.arctan2(cross(along[:-1], along[1:]), np.sum(along[:-1] * along[1:], axis=1))
        return inner if not self.ends else np.concatenate([[0.0], inner, [0.0]])

    @property
    def _ring(self) -> Array:
        """Return the points, those of a closed chain with the last before and the first after them."""
        return self.points if self.ends else np.concatenate([self.points[-1:], self.points, self.points[:1]])

    @cached_property
    def tangents(self) -> Array:
        """Return unit tangents (k, 2): of the line between the neighbours, at ends of a parabola."""
        ring = self._ring
        inner = ring[2:] - ring[:-2]
        if self.ends:
            along = np.diff(ring, axis=0)
            along /= np.linalg.norm(along, axis=1)[:, None]
            inner = inner / np.maximum(np.linalg.norm(inner, axis=1), 1e-300)[:, None]
            first = 2.0 * (along[0] @ inner[0]) * along[0] - inner[0] if len(inner) else along[0]
            last = 2.0 * (along[-1] @ inner[-1]) * along[-1] - inner[-1] if len(inner) else along[0]
            inner = np.concatenate([first[None], inner, last[None]])
        return np.asarray(inner / np.linalg.norm(inner, axis=1)[:, None])


def chains_of(points: Array, lines: IntArray, sharp: float, *, straight: bool = False) -> tuple[list[int], list[Chain]]:
    """Return the points that are corners, and the chains between them.

    A corner is where other than two lines meet, or two that turn by more than `sharp`, in degrees. straight: whether
    straight parts of smooth outlines are chains of their own, as the sides of a slot.
    """
    around: dict[int, list[int]] = {}
    for a, b in lines.tolist():
        around.setdefault(a, []).append(b)
        around.setdefault(b, []).append(a)
    bend = float(np.cos(np.radians(sharp)))
    corners = [
        v
        for v in sorted(around)
        if not runs_on(points, v, around[v], bend) or (straight and _ends_straight(points, v, around[v]))
    ]
    number = {vertex: k for k, vertex in enumerate(corners)}
    paths = chains_between(around, set(corners))
    return corners, [
        Chain(points[path], (number[path[0]], number[path[-1]])) if path[0] in number else Chain(points[path[:-1]], ())
        for path in paths
    ]


def _ends_straight(points: Array, vertex: int, ends: list[int]) -> bool:
    """Return whether one of the two lines at a vertex is much longer than the other one."""
    one, other = np.linalg.norm(points[ends] - points[vertex], axis=1)
    return bool(max(one, other) > _LONGER * min(one, other))


def fitted(curve: Curve, knots: Array, degree: int) -> Array:
    """Return the control points (n, 2) of the spline that is nearest to a curve, with its ends."""
    places = np.linspace(0.0, 1.0, _DENSE * (len(knots) - 2 * degree) + 1)
    matrix, goal = collocation(knots, degree, places).toarray(), curve.at(places)
    ends = goal[[0, -1]]
    inner = np.linalg.lstsq(matrix[:, 1:-1], goal - matrix[:, [0, -1]] @ ends, rcond=None)[0]
    return np.concatenate([ends[:1], inner, ends[1:]])


def needed_spans(curve: Curve, degree: int, diagonal: float) -> int:
    """Return the fewest spans of a spline that is close enough to a curve."""
    if curve.is_straight:
        return 1
    for spans in _TRIED:
        knots = open_uniform_knots(degree + spans, degree)
        places = np.linspace(0.0, 1.0, 4 * _DENSE * spans + 1)
        gap = collocation(knots, degree, places) @ fitted(curve, knots, degree) - curve.at(places)
        if np.linalg.norm(gap, axis=1).max() <= tolerance_of(curve, diagonal):
            return spans
    return _TRIED[-1]


def tolerance_of(curve: Curve, diagonal: float) -> float:
    """Return how far a spline may be from a curve."""
    middles = 0.5 * (curve.places[1:] + curve.places[:-1])
    own = float(np.linalg.norm(curve.at(middles) - 0.5 * (curve.points[1:] + curve.points[:-1]), axis=1).max())
    return min(max(_OWN * own, _FINEST * diagonal), _CLOSE * diagonal)


def deviation(curve: Curve, knots: Array, degree: int, control: Array) -> float:
    """Return the largest distance of a spline from the polygonal line of a curve."""
    places = np.linspace(0.0, 1.0, 4 * _DENSE * (len(knots) - 2 * degree) + 1)
    points = collocation(knots, degree, places) @ control
    start, along = curve.points[:-1], np.diff(curve.points, axis=0)
    gap = points[:, None] - start
    share = np.clip(np.sum(gap * along, axis=-1) / np.maximum(np.sum(along**2, axis=-1), 1e-300), 0.0, 1.0)
    return float(np.linalg.norm(gap - share[..., None] * along, axis=-1).min(axis=1).max())
