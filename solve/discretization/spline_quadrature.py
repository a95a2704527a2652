"""Gauss rules of a spline space: they integrate its functions exactly with half as many points as it has dimensions.

On a box the operator's integrands are splines of degree 2 p that are one derivative less smooth than the trial space of
degree p: p / 2 + 1 points a span integrate these exactly, where Gauss' rule on each span needs p + 1.
(Bressan, Calo, Hughes; Hiemstra, Calabro, Schillinger, Hughes, CMAME 316 (2017); Johannessen, CMAME 316 (2017).)
"""

from __future__ import annotations

import logging
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, hstack
from scipy.sparse.linalg import splu

from parameterize.arrays import Array
from parameterize.spline.bspline import basis_derivatives, gauss_points, greville, sparse_rows

TOLERANCE = 1e-14  # of an integral, the interval's length being 1
MAX_STEPS = 60  # of Newton's method: uniform knots take 6 to 10, irregular ones up to 25
SPARE_POINTS = (0, 1, 2)  # the numbers of further points with which it is tried, one after another
LARGEST_STEP = 0.4  # of a weight over itself, and of a point over the distance to its neighbour

log = logging.getLogger(__name__)


def gauss_on_spans(knots: Array, count: int) -> tuple[Array, Array]:
    """Return points and weights, each (m,), of Gauss' rule with `count` points on every span, in order."""
    points, weights = gauss_points(knots, count)
    return points.ravel(), weights.ravel()


def spline_rule(knots: Array, degree: int, exact: int) -> tuple[Array, Array]:
    """Return points and positive weights, each (m,), of the Gauss rule that belongs to a trial space of one direction.

    knots: open knot vector of splines of degree `degree`. The rule is exact for splines of degree `exact` that are at
    every inner knot one derivative less smooth; 2 m is their number, or a few more. Points lie in order.
    Where splines on `knots` are only continuous somewhere, it is Gauss' rule on every span, `degree` + 1 points: fewer
    would miss some of their derivatives. Where Newton's method does not find the rule, a line of the log says so, and
    Gauss' rule on every span, exact for the same degree, takes its place.
    """
    return _cached_rule(tuple(knots.tolist()), degree, exact)


@lru_cache(maxsize=64)
def _cached_rule(knots: tuple[float, ...], degree: int, exact: int) -> tuple[Array, Array]:
    row = np.array(knots)
    integrated = integrated_knots(row, degree, exact)
    if np.unique(integrated[exact + 1 : -exact - 1], return_counts=True)[1].max(initial=0) > exact:
        return gauss_on_spans(row, degree + 1)
    tries = (_newton(integrated, exact, spare) for spare in SPARE_POINTS)
    found = next((rule for rule in tries if rule is not None), None)
    if found is None:
        log.warning("no spline quadrature found for a knot vector of %d knots: Gauss on every span instead", len(row))
        return gauss_on_spans(row, exact // 2 + 1)
    return found


def integrated_knots(knots: Array, degree: int, exact: int) -> Array:
    """Return the knot vector of the splines for which `spline_rule` is exact."""
    values, repeats = np.unique(knots, return_counts=True)
    repeats += exact - degree + 1  # smoothness = degree - multiplicity
    repeats[[0, -1]] = exact + 1
    return np.repeat(values, repeats)


def _newton(knots: Array, degree: int, spare: int) -> tuple[Array, Array] | None:
    """Return points and weights that integrate every B-spline of a knot vector, None where the iteration fails.

    Where the dimension is odd, or points are to spare, there are more unknowns than equations, and every step is the
    least that serves. Of an odd dimension the number of points is even: none lies at a breakpoint in the middle, where
    slopes may jump.
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
    """Return averaged Greville points, and as weights the integrals of the B-splines next to them."""
    n = len(integrals)
    m = (n // 2 if n % 2 == 0 else 2 * -(-n // 4)) + spare
    points = np.interp((np.arange(m) + 0.5) * n / m - 0.5, np.arange(n), greville(knots, degree))
    sums = np.concatenate([[0.0], np.cumsum(integrals)])
    return points, np.diff(np.interp(np.arange(m + 1) * n / m, np.arange(n + 1), sums))
