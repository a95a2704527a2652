"""B-splines: knot vectors, basis values and derivatives, collocation, knot insertion, tensor-product evaluation.

A knot vector is *open*: its first and last `degree + 1` knots coincide. The basis has `len(knots) - degree - 1`
functions. The recurrences are from Piegl and Tiller, *The NURBS Book* (2nd ed.), chapter 2.
scipy.interpolate is slow to load: it is imported where it is used.
"""

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from numbers import Integral

import numba
import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from ..arrays import Array, IntArray

_ROUNDING = 1e-9  # by which a parameter may lie outside of the cube


def open_uniform_knots(n_control_points: int, degree: int) -> Array:
    """Return the open knot vector on [0, 1] with equal spans, shape (n_control_points + degree + 1,).

    The paper calls these knots "quasi-uniform" (section 3.1).
    Raises ValueError for a degree that is no whole number or below 1, and for too few control points.
    """
    if not isinstance(degree, Integral) or degree < 1:
        raise ValueError(f"degree must be a whole number, at least 1, got {degree!r:.80}")
    if n_control_points <= degree:
        raise ValueError(f"degree {degree} needs at least {degree + 1} control points, got {n_control_points}")
    breaks = np.linspace(0.0, 1.0, n_control_points - degree + 1)
    return np.concatenate([np.zeros(degree), breaks, np.ones(degree)])


def real_array(values: ArrayLike, name: str) -> Array:
    """Return `values` in double precision; raise ValueError where they are not real numbers."""
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be real numbers, got {array.dtype}")
    return array.astype(np.float64, copy=False)


def check_knots(knots: ArrayLike, degree: int) -> Array:
    """Return `knots` as a float array; raise ValueError where it is not an open, non-decreasing knot vector."""
    values = real_array(knots, "knots")
    if degree < 1:
        raise ValueError(f"degree must be at least 1, got {degree}")
    if values.ndim != 1 or values.size < 2 * (degree + 1):
        raise ValueError(f"a knot vector of degree {degree} needs at least {2 * (degree + 1)} knots in one row")
    _check_row(values.tobytes(), degree)
    return values


@lru_cache(maxsize=256)
def _check_row(row: bytes, degree: int) -> None:
    """Check the knots of `check_knots`, the same ones only once: a body may have thousands of patches with them."""
    values = np.frombuffer(row)
    if not np.all(np.isfinite(values)) or np.any(np.diff(values) < 0.0):
        raise ValueError("knots must be finite and non-decreasing")
    if values[0] != values[degree] or values[-1] != values[-degree - 1] or values[0] == values[-1]:
        raise ValueError(f"the knot vector is not open: its first and last {degree + 1} knots must coincide")
    inner = values[degree + 1 : -degree - 1]
    if inner.size and (inner[0] == values[0] or inner[-1] == values[-1]):
        raise ValueError(f"the first and last knot must be repeated {degree + 1} times, not more")
    if inner.size and np.unique(inner, return_counts=True)[1].max() > degree:
        raise ValueError(f"an inner knot is repeated more than {degree} times: the spline would be discontinuous")


def breakpoints(knots: Array) -> Array:
    """Return the distinct knots, shape (n_spans + 1,): the ends of the spans."""
    return np.unique(knots)


def greville(knots: Array, degree: int) -> Array:
    """Return the Greville points, shape (n,): with them as control points the spline is the identity."""
    n = len(knots) - degree - 1
    return np.array([knots[i + 1 : i + degree + 1].mean() for i in range(n)])


def find_spans(knots: Array, degree: int, x: ArrayLike) -> IntArray:
    """Return the index i with knots[i] <= x < knots[i + 1] for each x, same shape as `x`; the last span is closed."""
    n = len(knots) - degree - 1
    spans = np.searchsorted(knots, np.asarray(x, dtype=np.float64), side="right") - 1
    last = int(np.searchsorted(knots, knots[n], side="left")) - 1
    return np.clip(spans, degree, last)


def basis_derivatives(knots: Array, degree: int, x: ArrayLike, derivatives: int = 0) -> tuple[IntArray, Array]:
    """Return values and derivatives of the `degree + 1` basis functions that are nonzero at each point.

    That is `first` (m,), the index of the first such function, and `values` (derivatives + 1, m, degree + 1).
    Points outside the knot range continue the polynomial of the nearest span.
    (The NURBS Book, algorithms A2.2 and A2.3; derivatives by differencing lower-degree values, eq. 2.7.)
    """
    points = np.atleast_1d(np.asarray(x, dtype=np.float64))
    spans = find_spans(knots, degree, points)
    values = np.zeros((derivatives + 1, points.size, degree + 1))
    fill_basis(knots, degree, points.ravel(), spans.ravel(), values)
    return spans - degree, values


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fill_basis(knots: Array, degree: int, x: Array, spans: IntArray, out: Array) -> None:
    """Write values and derivatives of the functions that are not zero at points (m,) of spans into out (d, m, p + 1).

    Row q of `table` has the q + 1 values of degree q (Cox-de Boor).
    """
    table = np.zeros((degree + 1, degree + 1))
    for m in range(len(x)):
        span = spans[m]
        table[0, 0] = 1.0
        for q in range(1, degree + 1):
            table[q, 0] = 0.0
            for r in range(q):
                right, left = knots[span + r + 1], knots[span + r + 1 - q]
                share = table[q - 1, r] / (right - left)
                table[q, r] += (right - x[m]) * share
                table[q, r + 1] = (x[m] - left) * share
        for k in range(min(len(out), degree + 1)):
            for r in range(degree - k + 1):
                out[k, m, r] = table[degree - k, r]
            for q in range(degree - k + 1, degree + 1):
                out[k, m, q] = 0.0
                for r in range(q - 1, -1, -1):
                    slope = q * out[k, m, r] / (knots[span + r + 1] - knots[span + r + 1 - q])
                    out[k, m, r + 1] += slope
                    out[k, m, r] = -slope


def collocation(knots: Array, degree: int, x: ArrayLike, derivative: int = 0) -> csr_array:
    """Return the sparse matrix (m, n) with the given derivative of every basis function at every point."""
    first, values = basis_derivatives(knots, degree, x, derivative)
    width = values.shape[2]
    return sparse_rows(values[derivative], first[:, None] + np.arange(width), len(knots) - degree - 1)


def sparse_rows(values: Array, columns: IntArray, count: int) -> csr_array:
    """Return the sparse matrix (m, count) with the entries `values` (m, k) in `columns` (m, k) of each row."""
    starts = np.arange(0, values.size + 1, values.shape[1])
    return csr_array((values.ravel(), columns.ravel(), starts), shape=(len(values), count))


def gauss_points(knots: Array, n_points: int) -> tuple[Array, Array]:
    """Return Gauss-Legendre points and weights on every span, each of shape (n_spans, n_points)."""
    nodes, weights = np.polynomial.legendre.leggauss(n_points)
    breaks = breakpoints(knots)
    half = np.diff(breaks)[:, None] / 2.0
    middle = (breaks[:-1] + breaks[1:])[:, None] / 2.0
    return middle + half * nodes, half * weights


def insert_knots(knots: Array, degree: int, new: ArrayLike) -> tuple[Array, csr_array]:
    """Return the finer knot vector, and the matrix (n_new, n) from the old control points to the new ones.

    The spline itself does not change. Raises ValueError for a knot outside the open range. (The NURBS Book, eq. 5.15.)
    """
    finer, points = knots, np.eye(len(knots) - degree - 1)
    for t in np.sort(np.atleast_1d(np.asarray(new, dtype=np.float64))):
        if not knots[0] < t < knots[-1]:
            raise ValueError(f"new knot {t} lies outside the open interval ({knots[0]}, {knots[-1]})")
        span = int(np.searchsorted(finer, t, side="right")) - 1
        near = np.arange(span - degree + 1, span + 1)
        share = ((t - finer[near]) / (finer[near + degree] - finer[near]))[:, None]
        mixed = share * points[near] + (1.0 - share) * points[near - 1]
        points = np.concatenate([points[: span - degree + 1], mixed, points[span:]])
        finer = np.insert(finer, span + 1, t)
    return finer, csr_array(points)


def insertion_into(knots: Array, degree: int, finer: Array) -> csr_array:
    """Return the matrix (n_finer, n) that inserts the knots which a finer knot vector has in addition."""
    own, wanted = Counter(knots.tolist()), Counter(finer.tolist())
    if own - wanted:
        raise ValueError("the finer knot vector must hold every knot of the coarser one")
    return insert_knots(knots, degree, list((wanted - own).elements()))[1]


def divided_spans(knots: Array, parts: int) -> Array:
    """Return the ends of `parts` equal parts of every span, in order."""
    breaks = breakpoints(knots)
    return np.interp(np.arange(parts * (len(breaks) - 1) + 1) / parts, np.arange(len(breaks)), breaks)


def between(knots: Array, degree: int, low: float, high: float) -> tuple[slice, Array]:
    """Return which coefficients are those of the part between two knots, and the part's knots, from 0 to 1.

    Splines must be only continuous at both knots, or end there.
    """
    first = int(np.searchsorted(knots, low, side="right")) - 1 - degree
    last = int(np.searchsorted(knots, high))
    inner = (knots[first + degree + 1 : last] - low) / (high - low)
    return slice(first, last), np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])


def midpoints(knots: Array) -> Array:
    """Return the middle of every span."""
    breaks = breakpoints(knots)
    return (breaks[:-1] + breaks[1:]) / 2.0


def halved(knots: Array) -> Array:
    """Return the knot vector in which every span is halved."""
    return np.sort(np.concatenate([knots, midpoints(knots)]))


def with_full_knots(knots: Array, degree: int, values: Sequence[float]) -> Array:
    """Return a knot vector in which each value is a knot `degree` times at least: there splines are only continuous."""
    missing = [np.full(max(0, degree - int(np.count_nonzero(knots == value))), value) for value in values]
    return np.sort(np.concatenate([knots, *missing]))


def apply_along(matrix: csr_array, field: Array, axis: int) -> Array:
    """Return `field` with a sparse matrix (m, n) applied along one axis, whose length goes from n to m."""
    moved = np.moveaxis(field, axis, 0)
    flat = np.asarray(matrix @ moved.reshape(moved.shape[0], -1))
    return np.moveaxis(flat.reshape(len(flat), *moved.shape[1:]), 0, axis)


def interpolate_grid(knots: Sequence[Array], degree: int, values: Array) -> Array:
    """Return the coefficients of the spline that has `values` (n_u, n_v, n_w, c) at the Greville points.

    Values at the ends, and values that are constant along a direction, are kept to the last bit: a plane face stays in
    its plane.
    """
    from scipy.interpolate import make_interp_spline

    for axis, row in enumerate(knots):
        moved = np.moveaxis(values, axis, 0)
        first = moved[:1]
        found = first + make_interp_spline(greville(row, degree), moved - first, degree, row).c
        found[[0, -1]] = moved[[0, -1]]
        values = np.moveaxis(found, 0, axis)
    return values


def evaluate_at(
    degrees: Sequence[int],
    knots: Sequence[Array],
    coefficients: Array,
    points: ArrayLike,
    derivative: Sequence[int] = (0, 0, 0),
) -> Array:
    """Evaluate a trivariate spline, or one of its partial derivatives, at points (m, 3).

    coefficients: (n_u, n_v, n_w) or (n_u, n_v, n_w, c); returns (m,) or (m, c).
    """
    net = np.ascontiguousarray(coefficients).reshape(1, *coefficients.shape[:3], -1)
    only = np.zeros(len(np.atleast_2d(points)), dtype=np.int64)
    values = evaluate_each(degrees, knots, net, only, points, derivative)
    return values.reshape(len(values), *coefficients.shape[3:])


def checked_parameters(points: ArrayLike) -> Array:
    """Return parameters (m, 3) as a float array; raise ValueError for other shapes and numbers outside of 0 to 1."""
    where = np.atleast_2d(np.asarray(points, dtype=np.float64))
    if where.ndim != 2 or where.shape[1] != 3:
        raise ValueError(f"points must have shape (m, 3), got {where.shape}")
    if np.any(outside := ~(np.abs(where - 0.5) <= 0.5 + _ROUNDING).all(axis=1)):  # NaN included
        raise ValueError(f"points are parameters from 0 to 1, got {where[outside][0].tolist()}")
    return where


def evaluate_each(
    degrees: Sequence[int],
    knots: Sequence[Array],
    coefficients: Array,
    members: IntArray,
    points: ArrayLike,
    derivative: Sequence[int] = (0, 0, 0),
) -> Array:
    """Evaluate trivariate splines on the same knots at points (m, 3), each in the spline of one of the members (m,).

    coefficients: (k, n_u, n_v, n_w, c); returns (m, c). Raises ValueError as `evaluate_at`.
    """
    where = checked_parameters(points)
    rows = zip(knots, degrees, where.T, derivative, strict=True)
    firsts, values = zip(*(basis_derivatives(row, p, np.ascontiguousarray(x), d) for row, p, x, d in rows), strict=True)
    u, v, w = (basis[d] for basis, d in zip(values, derivative, strict=True))
    return np.asarray(_sums(coefficients, members, np.stack(firsts), u, v, w))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _sums(coefficients: Array, members: IntArray, first: IntArray, u: Array, v: Array, w: Array) -> Array:
    """Return values (m, c) of members (m,) from basis values (m, p + 1) of the functions from first (3, m) on."""
    found = np.zeros((len(members), coefficients.shape[4]))
    for m in range(len(members)):
        net = coefficients[members[m], first[0, m] :, first[1, m] :, first[2, m] :]
        for i in range(u.shape[1]):
            for j in range(v.shape[1]):
                for k in range(w.shape[1]):
                    factor = u[m, i] * v[m, j] * w[m, k]
                    for c in range(found.shape[1]):
                        found[m, c] += factor * net[i, j, k, c]
    return found


def evaluate_grid(
    degrees: Sequence[int],
    knots: Sequence[Array],
    coefficients: Array,
    points: Sequence[ArrayLike],
    derivative: Sequence[int] = (0, 0, 0),
) -> Array:
    """Evaluate on the tensor grid of three rows of points: (len(u), len(v), len(w)) or (len(u), len(v), len(w), c)."""
    field = coefficients
    for a in sorted(range(3), key=lambda axis: np.size(points[axis])):  # the shortest row first: least work
        field = apply_along(collocation(knots[a], degrees[a], points[a], derivative[a]), field, a)
    return field
