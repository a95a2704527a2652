"""Computes quadrature rules, Gauss' on every span or those of a spline space, and the geometry at their points.

The Gauss rules of a spline space integrate its functions exactly with half as many points as it has dimensions.
(Bressan, Calo, Hughes; Hiemstra, Calabro, Schillinger, Hughes, CMAME 316 (2017); Johannessen, CMAME 316 (2017).)
"""

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.sparse import csr_array, hstack
from scipy.sparse.linalg import splu

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import basis_derivatives, breakpoints, gauss_points, greville, sparse_rows
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from . import kernels
from .space import TrialSpace, same_smoothness

TOLERANCE = 1e-14  # of an integral, the interval's length being 1
MAX_STEPS = 60  # of Newton's method: uniform knots take 6 to 10, irregular ones up to 25
SPARE_POINTS = (0, 1, 2)  # the numbers of further points with which it is tried, one after another
LARGEST_STEP = 0.4  # of a weight over itself, and of a point over the distance to its neighbour
QUADRATURES = ("spline", "gauss", "gauss+1")
MANY_POINTS = 4  # degree from which on the rules of spline spaces suffice beside glued faces

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class GaussRule:
    """Hold a tensor-product rule: `points[a]` and `weights[a]`, each (q_a,), in the parametric directions."""

    points: tuple[Array, Array, Array]
    weights: tuple[Array, Array, Array]

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Return the number of points per direction."""
        return tuple(len(points) for points in self.points)

    @property
    def plane_shape(self) -> tuple[int, int]:
        """Return the shape (q_w, q_v) of the plane of points for one point of the first direction.

        Direction v runs fastest: the kernels contract w over rows of v.
        """
        return self.shape[2], self.shape[1]

    def plane_weights(self, q: int) -> Array:
        """Return the weights (q_w, q_v) of the plane through point `q` of the first direction."""
        w_u, w_v, w_w = self.weights
        return w_u[q] * (w_w[:, None] * w_v)

    def strips(self, most: int) -> list["GaussRule"]:
        """Return rules of consecutive points of w, at most `most` points a plane, which together are this rule."""
        (u, v, w), (weights_u, weights_v, weights_w) = self.points, self.weights
        step = max(1, most // len(v))
        parts = [slice(start, start + step) for start in range(0, len(w), step)]
        return [GaussRule((u, v, w[part]), (weights_u, weights_v, weights_w[part])) for part in parts]

    def tabulate(self, degrees: tuple[int, int, int], knots: Knots) -> kernels.Tables:
        """Return tables of any spline basis (the trial space's or the map's) at the points of this rule.

        The table of a direction is the number (q,) of the first function that is not zero at each point, the values and
        first derivatives (2, q, degree + 1) of the functions that are not zero, and a tuple of degree + 1 zeros.
        """
        u, v, w = (
            (*basis_derivatives(row, degree, points, derivatives=1), (0,) * (degree + 1))
            for row, degree, points in zip(knots, degrees, self.points, strict=True)
        )
        return u, v, w


def gauss_rule(space: TrialSpace, counts: Sequence[int] | None = None) -> GaussRule:
    """Return the Gauss rule on the spans of `space` with `counts` points per span (default: `space.gauss_points`)."""
    each = zip(space.whole.knots, counts or space.gauss_points, strict=True)
    return _tensor_rule(space, [gauss_on_spans(knots, count) for knots, count in each])


def operator_rule(space: TrialSpace, quadrature: str, rough: bool = True) -> GaussRule:
    """Return the quadrature rule of the operator.

    quadrature: a name as in `solve_problem`. rough: whether the factors vary much from span to span (`roughness`), so
    that more points are needed. Raises ValueError for any other quadrature.
    """
    if quadrature not in QUADRATURES:
        raise ValueError(f"quadrature must be one of {', '.join(QUADRATURES)}, got {quadrature!r}")
    if quadrature == "gauss":
        return gauss_rule(space)
    if quadrature == "gauss+1":
        return gauss_rule(space, [degree + 1 for degree in space.degrees])
    each = zip(space.whole.knots, space.degrees, space.gauss_points, space.glued_ends, strict=True)
    return _tensor_rule(space, [_with_ends(*direction, rough) for direction in each])


def _with_ends(knots: Array, degree: int, gauss: int, glued: tuple[bool, bool], rough: bool) -> tuple[Array, Array]:
    """Return points and weights of a direction; spans beside a glued face have degree + 1 Gauss points.

    glued: whether the first and the last face is glued: there the solution is only continuous. With the points of
    `_fewest_points` everywhere, errors on the frame of 20 patches with one face held were 67 % larger at degree 2 and
    20 % at degree 3, with these spans 19 % and 4 %; from degree 4 on nothing is gained.
    """
    breaks = breakpoints(knots)
    first, last = int(glued[0]), len(breaks) - 1 - int(glued[1])
    if degree >= MANY_POINTS or not any(glued):
        return _fewest_points(knots, degree, gauss, rough)
    if first >= last:
        return gauss_on_spans(knots, degree + 1)
    low, high = breaks[first], breaks[last]
    inner = knots[(knots > low) & (knots < high)]
    middle = _fewest_points(np.concatenate([[low] * (degree + 1), inner, [high] * (degree + 1)]), degree, gauss, rough)
    points, weights = (
        np.concatenate([on_spans[:first].ravel(), own, on_spans[last:].ravel()])
        for on_spans, own in zip(gauss_points(knots, degree + 1), middle, strict=True)
    )
    return points, weights


def _fewest_points(knots: Array, degree: int, gauss: int, rough: bool) -> tuple[Array, Array]:
    """Return points and weights of a direction: L2 errors stay within 0.5 % of those of degree + 1 Gauss points a span.

    The numbers were measured on the twisted cube and, for rough factors, on trained maps: degrees 4 and 5 would lose 1
    to 3 % there with 2 p, and degree 2 on smooth maps as much with 2 p - 1, but nothing with as many Gauss points on
    every span (`gauss`).
    """
    if rough:
        return spline_rule(knots, degree, 2 * degree + int(degree > 3))
    return gauss_on_spans(knots, gauss) if degree == 2 else spline_rule(knots, degree, 2 * degree - 1)


def _tensor_rule(space: TrialSpace, rows: Iterable[tuple[Array, Array]]) -> GaussRule:
    """Return the rule of three rows of points and weights; in u it has the points on this process's spans."""
    (u, v, w), (weights_u, weights_v, weights_w) = zip(*rows, strict=True)
    here = slice(*np.searchsorted(u, space.breaks[0][[0, -1]]))
    return GaussRule((u[here], v, w), (weights_u[here], weights_v, weights_w))


def gauss_on_spans(knots: Array, count: int) -> tuple[Array, Array]:
    """Return points and weights, (m,) each, of Gauss' rule with `count` points on every span, in ascending order."""
    points, weights = gauss_points(knots, count)
    return points.ravel(), weights.ravel()


def spline_rule(knots: Array, degree: int, exact: int) -> tuple[Array, Array]:
    """Return points and positive weights, (m,) each, of the Gauss rule that belongs to a trial space of one direction.

    knots: the open knot vector of splines of degree `degree`. The rule is exact for splines of degree `exact` that are
    at every inner knot one derivative less smooth; the number of these splines is 2 m or a few less. Points lie in
    ascending order. Where splines on `knots` are only continuous somewhere, the rule is Gauss' rule on every span with
    `degree` + 1 points, because fewer points would miss some of their derivatives. Where Newton's method does not find
    the rule, the log says so, and Gauss' rule on every span, exact for the same degree, takes its place.
    """
    return _cached_rule(tuple(knots.tolist()), degree, exact)


@lru_cache(maxsize=1024)
def _cached_rule(knots: tuple[float, ...], degree: int, exact: int) -> tuple[Array, Array]:
    row = np.array(knots)
    integrated = same_smoothness(row, degree - 1, exact)
    if np.unique(integrated[exact + 1 : -exact - 1], return_counts=True)[1].max(initial=0) > exact:
        return gauss_on_spans(row, degree + 1)
    for spare in SPARE_POINTS:
        if (found := _newton(integrated, exact, spare)) is not None:
            return found
    log.warning("no spline quadrature found for a knot vector of %d knots: Gauss on every span instead", len(row))
    return gauss_on_spans(row, exact // 2 + 1)


def _newton(knots: Array, degree: int, spare: int) -> tuple[Array, Array] | None:
    """Return points and weights that integrate every B-spline of a knot vector; None where the iteration fails.

    Where the dimension is odd, or there are spare points, there are more unknowns than equations, and every step is the
    least solution. For an odd dimension the number of points is even: no point lies at a breakpoint in the middle,
    where slopes may jump.
    """
    integrals = (knots[degree + 1 :] - knots[: -degree - 1]) / (degree + 1)
    points, weights = _first_guess(knots, degree, integrals, spare)
    length = knots[-1] - knots[0]
    for _ in range(MAX_STEPS):
        first, basis = basis_derivatives(knots, degree, points, derivatives=1)
        columns = first[:, None] + np.arange(degree + 1)
        values, slopes = (csr_array(sparse_rows(table, columns, len(integrals)).T) for table in basis)
        missing = integrals - values @ weights
        if np.abs(missing).max() <= TOLERANCE * length:
            return points, weights
        gaps = np.diff(points, prepend=knots[0], append=knots[-1])
        room = np.minimum(gaps[:-1], gaps[1:])
        jacobian = csr_array(hstack([values * weights, slopes * (weights * room)]))  # unknowns are relative changes
        try:
            step = jacobian.T @ splu((jacobian @ jacobian.T).tocsc(), permc_spec="NATURAL").solve(missing)
        except RuntimeError:  # a singular matrix
            break
        step *= min(1.0, LARGEST_STEP / np.abs(step).max())
        weights = weights * (1.0 + step[: len(weights)])
        points = points + room * step[len(weights) :]
    return None


def _first_guess(knots: Array, degree: int, integrals: Array, spare: int) -> tuple[Array, Array]:
    """Return averaged Greville points, with the integrals of the B-splines next to them as weights."""
    n = len(integrals)
    m = (n // 2 if n % 2 == 0 else 2 * -(-n // 4)) + spare
    points = np.interp((np.arange(m) + 0.5) * n / m - 0.5, np.arange(n), greville(knots, degree))
    sums = np.concatenate([[0.0], np.cumsum(integrals)])
    return points, np.diff(np.interp(np.arange(m + 1) * n / m, np.arange(n + 1), sums))


def map_planes(
    volume: BSplineVolume, rule: GaussRule, points: Iterable[int] | None = None
) -> Iterator[tuple[int, Array, Points]]:
    """Yield for every point q of direction u: q, the map on its plane, and its points in space, (3, q_w, q_v).

    The map is (3, 4, q_w, q_v): value and gradient of its components. points: the numbers q, all by default. The arrays
    are reused from one step to the next. A rational volume is the quotient of splines that the kernels evaluate.
    """
    u, v, w = rule.points
    splines = np.empty((3 if volume.weights is None else 4, 4, *rule.plane_shape))
    fields = splines[:3]
    for q, components, tables in map_rows(volume, rule, points):
        for component, out in zip(components, splines, strict=True):
            kernels.evaluate_plane(component, q, tables, out)
        if len(splines) > 3:
            divide(fields, splines[3])
        yield q, fields, Points.of(fields[:, 0], (u[q : q + 1], v, w), (2, 1))


def map_rows(
    volume: BSplineVolume, rule: GaussRule, points: Iterable[int] | None = None
) -> Iterator[tuple[int, Array, kernels.Tables]]:
    """Yield for every point q of direction u: q, the control points that count there, and their tables.

    The control points are (3 or 4, p + 1, n_v, n_w), a row of each component or, of a rational volume, homogeneous
    component: all rows at once would be a second map. points: the numbers q, all by default.
    """
    net = volume.control_points if volume.weights is None else volume.homogeneous
    (first, basis, functions), table_v, table_w = rule.tabulate(volume.degrees, volume.knots)
    tables = (np.zeros_like(first), basis, functions), table_v, table_w
    row, components = -1, np.empty((net.shape[-1], 0, 0, 0))
    for q in range(rule.shape[0]) if points is None else points:
        if first[q] != row:
            row = int(first[q])
            components = np.ascontiguousarray(np.moveaxis(net[row : row + len(functions)], -1, 0))
        yield q, components, tables


def divide(fields: Array, weight: Array) -> None:
    """Divide components A (3, 4, q_w, q_v), values and gradients, by the weight W (4, q_w, q_v) in place."""
    fields[:, 0] /= weight[0]
    fields[:, 1:] = (fields[:, 1:] - fields[:, :1] * weight[1:]) / weight[0]
