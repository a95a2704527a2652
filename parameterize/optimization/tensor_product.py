"""Evaluates tensor-product splines: Jacobians on a grid by banded matrices, and fast inverses.

operators.py explains the layout of control points and the sum of pieces of work.
"""

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import DTypeLike
from scipy.linalg import eigh

from ..arrays import Array, Floats, IntArray
from ..spline.bspline import breakpoints, collocation, gauss_points

_END_SPANS = 1
_PLANES = 4  # of quadrature points in one
_POINTS = 256  # at a time: their matrices stay in the cache
# Where entry (a, b) of symmetric 9 x 9 matrices stands among their 45 different ones.
SYMMETRIC = np.array([[max(a, b) * (max(a, b) + 1) // 2 + min(a, b) for b in range(9)] for a in range(9)])


def along(matrix: Floats, field: Floats, axis: int) -> Floats:
    """Return the product of a matrix (m, n) and a field along one axis, in as few products as the layout allows."""
    before, after = field.shape[:axis], field.shape[axis + 1 :]
    if not after:
        return (field.reshape(-1, field.shape[axis]) @ matrix.T).reshape(*before, len(matrix))
    return (matrix @ field.reshape(-1, field.shape[axis], math.prod(after))).reshape(*before, len(matrix), *after)


Band = tuple[Any, ...]  # of matrices: first columns (m,), entries from there on (m, k) each


class GaussGrid:
    """Hold a grid of quadrature points, at which Jacobians are computed, and transposed, plane by plane.

    The points lie in planes of constant u; in a plane they are in the order of w, then v. weights: (planes, points).
    The results of a piece of work have its points in the order of w, then u, then v (`flat`).
    """

    def __init__(
        self, knots: tuple[Array, ...], degrees: tuple[int, ...], n_gauss: int, *, inner: int | None = None
    ) -> None:
        """Make a grid of `n_gauss` points a span and direction.

        inner: the number of points on all spans but the first and the last. One point is enough there for smooth
        splines, which have one basis function a span (the half-point rule of Hughes, Reali, Sangalli, CMAME 199, 2010).
        """
        points, (u, v, w) = zip(
            *(_graded_points(k, n_gauss, n_gauss if inner is None else inner) for k in knots), strict=True
        )
        self.weights, self._points_in_v = u[:, None] * (w[:, None] * v).ravel(), len(v)
        self._spans = [np.searchsorted(breakpoints(k), x) - 1 for k, x in zip(knots, points, strict=True)]
        tables = [
            [np.asarray(collocation(k, p, x, d).toarray()) for d in range(2)]
            for k, p, x in zip(knots, degrees, points, strict=True)
        ]
        self._bands: dict[Any, tuple[tuple[Band, ...], tuple[Band, ...]]] = {}
        for dtype in (np.float32, np.float64):
            pairs: list[list[Array]] = [[m.astype(dtype) for m in pair] for pair in tables]
            bands = [(band(values, slopes), band(values.T, slopes.T)) for values, slopes in pairs]
            self._bands[np.dtype(dtype)] = tuple(f for f, _ in bands), tuple(t for _, t in bands)

    def planes(self) -> list[slice]:
        """Return the planes of each piece of work."""
        return [slice(begin, begin + _PLANES) for begin in range(0, len(self.weights), _PLANES)]

    def flat(self, values: Array, planes: slice) -> Array:
        """Return values (planes, points) at the points of a piece of work, (m,), in the order of its results."""
        rows = values[planes]
        return np.swapaxes(rows.reshape(len(rows), -1, self._points_in_v), 0, 1).ravel()

    def by_planes(self, parts: list[Array]) -> Array:
        """Return the results (m,) of all pieces of work as (planes, points)."""
        found = [
            part.reshape(-1, len(self.weights[planes]), self._points_in_v)
            for part, planes in zip(parts, self.planes(), strict=True)
        ]
        return np.concatenate([np.swapaxes(part, 0, 1) for part in found]).reshape(self.weights.shape)

    def sum_on_spans(self, values: Array) -> Array:
        """Return the sums (n_u, n_v, n_w) over the points of each span, of values (planes, points)."""
        u, v, w = self._spans
        found = np.swapaxes(values.reshape(len(u), len(w), len(v)), 1, 2)
        for axis, spans in enumerate((u, v, w)):
            found = np.add.reduceat(found, np.flatnonzero(np.diff(spans, prepend=-1)), axis=axis)
        return found

    def at_points(self, values: Array) -> Array:
        """Return the value of its span for each point, (planes, points), of values (n_u, n_v, n_w)."""
        u, v, w = self._spans
        return np.ascontiguousarray(np.swapaxes(values[np.ix_(u, v, w)], 1, 2)).reshape(self.weights.shape)

    def jacobian(self, control: Floats, planes: slice) -> Floats:
        """Return J (3, 3, m) at the points of some planes: component, direction, point; control: (3, n_u, n_v, n_w)."""
        return np.asarray(_jacobian(self._forward(planes, control.dtype), control))

    def adjoint(self, dual: Floats, planes: slice) -> tuple[int, Floats]:
        """Return the transpose of `jacobian`, as the first layer of control points and the values of all layers."""
        layer, backward = self._backward(planes, dual.dtype)
        return layer, _jacobian_adjoint(backward, dual)

    def squared(self, matrices: Floats, planes: slice) -> Callable[[Floats], tuple[int, Floats]]:
        """Return a function: `jacobian`, symmetric matrices (45, m) on its nine entries (SYMMETRIC), then `adjoint`."""
        forward, (layer, backward) = self._forward(planes, matrices.dtype), self._backward(planes, matrices.dtype)
        return lambda control: (layer, _squared_jacobian(forward, backward, matrices, control))

    def diagonal(self, matrices: Floats, planes: slice) -> tuple[int, Floats]:
        """Return the blocks on the diagonal of `squared`, as the first layer and the blocks (6, ...) of all layers."""
        layer, backward = self._backward(planes, matrices.dtype)
        squares = tuple((first, v * v, v * s, s * s) for first, v, s in backward)
        return layer, _squared_diagonal(squares, matrices)

    def _forward(self, planes: slice, dtype: Any) -> tuple[Band, ...]:
        (first, values, slopes), *across = self._bands[dtype][0]
        return (first[planes], values[planes], slopes[planes]), *across

    def _backward(self, planes: slice, dtype: Any) -> tuple[int, tuple[Band, ...]]:
        """Return the first layer of control points of these planes, and the transposed bands from that layer on."""
        (first, values, slopes), *_ = self._forward(planes, dtype)
        return int(first[0]), ((first - first[0], values, slopes), *self._bands[dtype][1][1:])

    def collect(self, parts: list[tuple[int, Floats]], like: Floats) -> Floats:
        """Return control points in the shape of `like`: the sum of the layers of all pieces of work, added in order."""
        total = np.zeros_like(like)
        for first, layers in parts:
            total[:, first : first + layers.shape[1]] += layers
        return total


def band(*matrices: Array) -> Band:
    """Return matrices (m, n) as a band: the first column of each row, and the matrices' entries from it on."""
    used = np.any([matrix != 0.0 for matrix in matrices], axis=0)
    low, high = used.argmax(axis=1), used.shape[1] - used[:, ::-1].argmax(axis=1)
    width = int((high - low).max())
    first = np.minimum(low, used.shape[1] - width)
    columns = first[:, None] + np.arange(width)
    return first, *(np.take_along_axis(matrix, columns, axis=1) for matrix in matrices)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def apply_band(first: IntArray, entries: Array, field: Array, out: Array) -> None:
    """Add the product of a banded matrix and a field (n, r) to out (m, r).

    Two entries are added in one pass over a row: half as many passes take two thirds of the time.
    """
    width = entries.shape[1]
    for m in range(len(first)):
        row = out[m]
        for k in range(0, width - 1, 2):
            a, b, above, below = entries[m, k], entries[m, k + 1], field[first[m] + k], field[first[m] + k + 1]
            for i in range(row.size):
                row[i] += a * above[i] + b * below[i]
        if width % 2:
            last, values = entries[m, width - 1], field[first[m] + width - 1]
            for i in range(row.size):
                row[i] += last * values[i]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _jacobian(bands: tuple[Band, Band, Band], control: Array) -> Array:
    """Return the derivatives (3, 3, points) of control points (3, n_u, n_v, n_w) at all points.

    The planes stand side by side in the rows that a band multiplies: long rows take less than half the time of short
    ones.
    """
    (first_u, values_u, slopes_u), (first_v, values_v, slopes_v), (first_w, values_w, slopes_w) = bands
    _, n_u, n_v, n_w = control.shape
    planes, m_v, m_w = len(first_u), len(first_v), len(first_w)
    out = np.zeros((3, 3, m_w, planes * m_v), control.dtype)
    for c in range(3):
        field = control[c].reshape(n_u, n_v * n_w)
        plain, steep = np.zeros((planes, n_v * n_w), control.dtype), np.zeros((planes, n_v * n_w), control.dtype)
        apply_band(first_u, values_u, field, plain)
        apply_band(first_u, slopes_u, field, steep)
        levels, slants = _side_by_side(plain, n_v), _side_by_side(steep, n_v)
        part = np.zeros((3, m_v, planes * n_w), control.dtype)
        apply_band(first_v, values_v, slants, part[0])
        apply_band(first_v, slopes_v, levels, part[1])
        apply_band(first_v, values_v, levels, part[2])
        for direction in range(3):
            entries = slopes_w if direction == 2 else values_w
            apply_band(first_w, entries, _exchanged(part[direction], planes), out[c, direction])
    return out.reshape(3, 3, m_w * planes * m_v)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _exchanged(field: Array, planes: int) -> Array:
    """Return a field (n, planes * m) as (m, planes * n)."""
    n, m = len(field), field.shape[1] // planes
    out = np.empty((m, planes, n), field.dtype)
    for plane in range(planes):
        own = field[:, plane * m : (plane + 1) * m]
        for j in range(m):
            row = out[j, plane]
            for i in range(n):
                row[i] = own[i, j]
    return out.reshape(m, planes * n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _side_by_side(field: Array, size: int) -> Array:
    """Return fields (n, size * m) as (size, n * m)."""
    n, m = len(field), field.shape[1] // size
    out = np.empty((size, n, m), field.dtype)
    for i in range(n):
        for j in range(size):
            row, own = out[j, i], field[i, j * m : (j + 1) * m]
            for k in range(m):
                row[k] = own[k]
    return out.reshape(size, n * m)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _jacobian_adjoint(bands: tuple[Band, Band, Band], dual: Array) -> Array:
    """Return the transpose of `_jacobian` applied to `dual`, as all layers (3, layers, n_v, n_w).

    The bands of v and w are already transposed.
    """
    (first_u, values_u, slopes_u), (first_v, values_v, slopes_v), (first_w, values_w, slopes_w) = bands
    planes, n_v, n_w, width = len(first_u), len(first_v), len(first_w), values_u.shape[1]
    m_w = first_w[-1] + values_w.shape[1]
    field = dual.reshape(3, 3, m_w, dual.shape[2] // m_w)
    m_v = field.shape[3] // planes
    out = np.zeros((3, first_u[-1] + width, n_v * n_w), dual.dtype)
    for c in range(3):
        part = np.zeros((3, n_w, planes * m_v), dual.dtype)
        for direction in range(3):
            entries = slopes_w if direction == 2 else values_w
            apply_band(first_w, entries, field[c, direction], part[direction])
        levels, slants = np.zeros((n_v, planes * n_w), dual.dtype), np.zeros((n_v, planes * n_w), dual.dtype)
        apply_band(first_v, values_v, _exchanged(part[0], planes), slants)
        apply_band(first_v, slopes_v, _exchanged(part[1], planes), levels)
        apply_band(first_v, values_v, _exchanged(part[2], planes), levels)
        plain, steep = _side_by_side(levels, planes), _side_by_side(slants, planes)
        for m in range(planes):
            flat, upright = plain[m], steep[m]
            for k in range(width):
                value, slope, layer = values_u[m, k], slopes_u[m, k], out[c, first_u[m] + k]
                for i in range(layer.size):
                    layer[i] += value * flat[i] + slope * upright[i]
    return out.reshape(3, out.shape[1], n_v, n_w)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _times_matrices(matrices: Array, vectors: Array) -> Array:
    """Return the products of symmetric matrices, with entries (45, m), and vectors (9, m)."""
    out = np.zeros_like(vectors)
    for begin in range(0, vectors.shape[1], _POINTS):
        end = begin + _POINTS
        for a in range(9):
            total, of_row = out[a, begin:end], SYMMETRIC[a]
            for b in range(0, 9, 3):  # three products in one pass
                p, x = matrices[of_row[b], begin:end], vectors[b, begin:end]
                q, y = matrices[of_row[b + 1], begin:end], vectors[b + 1, begin:end]
                r, z = matrices[of_row[b + 2], begin:end], vectors[b + 2, begin:end]
                for i in range(total.size):
                    total[i] += p[i] * x[i] + q[i] * y[i] + r[i] * z[i]
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _squared_jacobian(
    forward: tuple[Band, Band, Band], backward: tuple[Band, Band, Band], matrices: Array, control: Array
) -> Array:
    """Return all layers (3, layers, n_v, n_w): `_jacobian`, symmetric matrices (45, points), `_jacobian_adjoint`."""
    change = _jacobian(forward, control)
    dual = _times_matrices(matrices, change.reshape(9, change.shape[2]))
    return _jacobian_adjoint(backward, dual.reshape(change.shape))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _squared_diagonal(squares: tuple[Band, Band, Band], matrices: Array) -> Array:
    """Return the blocks on the diagonal of `_squared_jacobian`, as all layers (6, layers, n_v, n_w).

    squares: bands as in `_jacobian_adjoint`, of the products value^2, value * slope and slope^2 of a basis function.
    """
    first_u, first_v, first_w = squares[0][0], squares[1][0], squares[2][0]
    planes, n_v, n_w, width = len(first_u), len(first_v), len(first_w), squares[0][1].shape[1]
    m_w = first_w[-1] + squares[2][1].shape[1]
    m_v = matrices.shape[1] // (planes * m_w)
    field = matrices.reshape(45, m_w, planes * m_v)
    out = np.zeros((6, first_u[-1] + width, n_v * n_w), matrices.dtype)
    entry = 0
    for c in range(3):
        for other in range(c + 1):
            for d in range(3):
                for e in range(d + 1):
                    # a direction's basis function has its slope in none, one or both of the derivatives d and e
                    in_u, in_v, in_w = (d == 0) + (e == 0), (d == 1) + (e == 1), (d == 2) + (e == 2)
                    values_u = squares[0][1] if in_u == 0 else squares[0][2] if in_u == 1 else squares[0][3]
                    values_v = squares[1][1] if in_v == 0 else squares[1][2] if in_v == 1 else squares[1][3]
                    values_w = squares[2][1] if in_w == 0 else squares[2][2] if in_w == 1 else squares[2][3]
                    across = field[SYMMETRIC[3 * c + d, 3 * other + e]]
                    if d != e:
                        across = across + field[SYMMETRIC[3 * c + e, 3 * other + d]]
                    part = np.zeros((n_w, planes * m_v), out.dtype)
                    plain = np.zeros((n_v, planes * n_w), out.dtype)
                    apply_band(first_w, values_w, across, part)
                    apply_band(first_v, values_v, _exchanged(part, planes), plain)
                    flat = _side_by_side(plain, planes)
                    for m in range(planes):
                        own = flat[m]
                        for k in range(width):
                            value, layer = values_u[m, k], out[entry, first_u[m] + k]
                            for i in range(layer.size):
                                layer[i] += value * own[i]
            entry += 1
    return out.reshape(6, out.shape[1], n_v, n_w)


def _graded_points(knots: Array, outer: int, inner: int) -> tuple[Array, Array]:
    """Return Gauss points and weights (m,): `outer` points on the first and last span, `inner` points on the others."""
    fine, coarse = gauss_points(knots, outer), gauss_points(knots, inner)
    split = min(_END_SPANS, len(fine[0]) // 2)
    middle = slice(split, len(fine[0]) - split)
    points, weights = (
        np.concatenate([f[:split].ravel(), c[middle].ravel(), f[len(f) - split :].ravel()])
        for f, c in zip(fine, coarse, strict=True)
    )
    return points, weights


class KroneckerInverse:
    """Apply the inverse of A_0 x M x M + M x A_1 x M + M x M x A_2 + shift * M x M x M (Lynch, Rice, Thomas 1964).

    matrices: three symmetric matrices A_d (n, n). mass: three matrices M_d. dtype: the precision of the vectors. The
    constructor solves three generalised eigenproblems; an application consists of products only.

    `solve.linear.preconditioner` has a class of its own: there the inverse is scaled by the operator's diagonal, keeps
    to the complement of a kernel, and is shared by processes. Both have in common SciPy's `eigh` for three pairs of
    small matrices and the sum of eigenvalues: less code than a base class would take.
    """

    def __init__(
        self, matrices: tuple[Array, ...], mass: tuple[Array, ...], shift: float = 0.0, dtype: DTypeLike = np.float64
    ) -> None:
        (u, v, w), vectors = zip(*(eigh(a, m) for a, m in zip(matrices, mass, strict=True)), strict=True)
        self._vectors = [matrix.astype(dtype) for matrix in vectors]
        self._inverse: Floats = (1.0 / (u[:, None, None] + v[:, None] + w + shift)).astype(dtype)

    def __call__(self, residual: Floats) -> Floats:
        """Return the inverse applied to a residual (3, n_u, n_v, n_w), in the same shape."""
        for axis, vectors in enumerate(self._vectors, start=1):
            residual = along(vectors.T, residual, axis)
        residual = residual * self._inverse
        for axis, vectors in enumerate(self._vectors, start=1):
            residual = along(vectors, residual, axis)
        return residual
