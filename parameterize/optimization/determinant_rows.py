"""Compiles the rows of determinant_penalty.py: coefficients of det J below a floor, and their derivatives.

One call makes all rows of a few spans: between shorter calls, threads would wait for one another.
"""

import numba
import numpy as np

from ..arrays import Array, IntArray
from ..spline.bernstein import add_products, cross_products

Three = tuple[Array, Array, Array]  # one array a direction


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def short_rows(
    control: Array, first: IntArray, weights: Array, volumes: Array, floors: Array, scales: Three, unscale: Array
) -> tuple[IntArray, Array, Array, IntArray]:
    """Return the spans (k,) that have coefficients below their floors, and these coefficients, span by span.

    For the coefficients, return the shortfalls (r,), the derivatives (r, 3, n, n, n) in the span's Bezier points, and
    the first row of each span (k + 1,).

    first, weights, volumes, floors: of the spans to be examined, as in determinant_penalty.py. scales: from differences
    of Bezier points to derivatives of F in scaled Bernstein form. unscale: (q, q, q), from there to the coefficients.
    """
    spans, n = len(first), weights.shape[2]
    points = _bezier_points(control, first, weights)
    slopes = [_derivative(points, scale, direction) for direction, scale in enumerate(scales)]
    by_u = cross_products(slopes[1], slopes[2])
    short = np.zeros((*unscale.shape, spans))
    for c in range(3):
        add_products(slopes[0][c], by_u[c], 1.0, short)
    short = short.reshape(unscale.size, spans)
    factors, counts, chosen, rest = unscale.ravel(), np.zeros(spans, np.int64), np.empty(spans, np.int64), 0
    for i in range(len(factors)):
        for s in range(spans):
            short[i, s] = floors[s] - short[i, s] * (factors[i] / volumes[s])
            counts[s] += short[i, s] > 0.0
    for s in range(spans):
        if counts[s]:
            chosen[rest] = s
            rest += 1
    chosen, starts = chosen[:rest], np.zeros(rest + 1, np.int64)
    for k in range(rest):
        starts[k + 1] = starts[k] + counts[chosen[k]]
    shortfall, rows = np.empty(starts[-1]), np.zeros((starts[-1], 3, n, n, n))
    slopes = [_on_chosen(slope, chosen) for slope in slopes]
    for direction in range(3):
        crossed = cross_products(slopes[(direction + 1) % 3], slopes[(direction + 2) % 3])
        for k in range(rest):
            s, r = chosen[k], starts[k]
            own = _on_one(crossed, k)
            for i in range(len(factors)):
                if short[i, s] > 0.0:
                    shortfall[r] = short[i, s]
                    _add_derivatives(i, own, scales[direction], factors[i] / volumes[s], direction, rows[r])
                    r += 1
    return chosen, shortfall, rows, starts


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _derivative(points: Array, scale: Array, direction: int) -> Array:
    """Return a derivative of F (3, ..., k) in scaled Bernstein form, from Bezier points (k, 3, n, n, n)."""
    n_u, n_v, n_w = scale.shape
    to_u, to_v, to_w = direction == 0, direction == 1, direction == 2
    found = np.empty((3, n_u, n_v, n_w, len(points)))
    for s in range(len(points)):
        for c in range(3):
            for i in range(n_u):
                for j in range(n_v):
                    for k in range(n_w):
                        change = points[s, c, i + to_u, j + to_v, k + to_w] - points[s, c, i, j, k]
                        found[c, i, j, k, s] = change * scale[i, j, k]
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _on_chosen(fields: Array, chosen: IntArray) -> Array:
    """Return the fields (3, ..., k) on the chosen spans (m,)."""
    size, n_u, n_v, n_w, _ = fields.shape
    found = np.empty((size, n_u, n_v, n_w, len(chosen)))
    for c in range(size):
        for i in range(n_u):
            for j in range(n_v):
                for k in range(n_w):
                    for s in range(len(chosen)):
                        found[c, i, j, k, s] = fields[c, i, j, k, chosen[s]]
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _on_one(fields: Array, span: int) -> Array:
    """Return the fields (3, ..., k) on one span, in one piece."""
    size, n_u, n_v, n_w, _ = fields.shape
    found = np.empty((size, n_u, n_v, n_w))
    for c in range(size):
        for i in range(n_u):
            for j in range(n_v):
                for k in range(n_w):
                    found[c, i, j, k] = fields[c, i, j, k, span]
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _add_derivatives(place: int, cross: Array, scale: Array, share: float, direction: int, row: Array) -> None:
    """Add to a row (3, n, n, n) the derivatives of a coefficient in the Bezier points, by one derivative of F.

    place: the number of the coefficient. cross: (3, ...), the product of the two other derivatives of F. scale: the
    factor from differences of Bezier points to the control net of that derivative.
    """
    size_u, size_v, size_w = cross.shape[1], cross.shape[2], cross.shape[3]
    count = size_w + scale.shape[2] - 1  # of the coefficients in each direction
    a, b, c = place // count**2, place // count % count, place % count
    step_u, step_v, step_w = direction == 0, direction == 1, direction == 2
    for component in range(3):
        for i in range(max(0, a - size_u + 1), min(scale.shape[0], a + 1)):
            for j in range(max(0, b - size_v + 1), min(scale.shape[1], b + 1)):
                here, ahead = row[component, i, j], row[component, i + step_u, j + step_v]
                factors, others = scale[i, j], cross[component, a - i, b - j]
                for k in range(max(0, c - size_w + 1), min(scale.shape[2], c + 1)):
                    change = share * factors[k] * others[c - k]
                    here[k] -= change
                    ahead[k + step_w] += change


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bezier_points(control: Array, first: IntArray, weights: Array) -> Array:
    """Return the Bezier points (k, 3, n, n, n) of spans with first control points (k, 3) and weights (k, 3, n, n)."""
    spans, n = len(first), weights.shape[2]
    points = np.empty((spans, 3, n**3), control.dtype)
    for s in range(spans):
        u, v, w = first[s]
        for c in range(3):
            field = points[s, c]
            for i in range(n):
                for j in range(n):
                    for k in range(n):
                        field[(i * n + j) * n + k] = control[c, u + i, v + j, w + k]
            _along_axes(field, weights[s, 0], weights[s, 1], weights[s, 2])
    return points.reshape(spans, 3, n, n, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _along_axes(field: Array, u: Array, v: Array, w: Array) -> None:
    """Apply matrices (n, n) along the axes of a field (n^3,), in place: each product makes the first axis the last."""
    n = len(u)
    for matrix in (u, v, w):
        applied = np.zeros((n, n * n), field.dtype)
        for i in range(n):
            for x in range(n):
                for r in range(n * n):
                    applied[i, r] += matrix[i, x] * field[x * n * n + r]
        for r in range(n * n):
            for i in range(n):
                field[r * n + i] = applied[i, r]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def combined(rows: Array, starts: IntArray, factors: Array, back: Array) -> Array:
    """Return the sum of each span's rows times their factors (r,), as windows (k, 3, n, n, n) of control points."""
    spans, n = len(starts) - 1, back.shape[2]
    flat, windows = rows.reshape(len(rows), 3, n**3), np.zeros((spans, 3, n**3), rows.dtype)
    for s in range(spans):
        for r in range(starts[s], starts[s + 1]):
            for c in range(3):
                for i in range(n**3):
                    windows[s, c, i] += factors[r] * flat[r, c, i]
        for c in range(3):
            _along_axes(windows[s, c], back[s, 0], back[s, 1], back[s, 2])
    return windows.reshape(spans, 3, n, n, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def squared(control: Array, first: IntArray, rows: Array, starts: IntArray, shares: Array) -> Array:
    """Return control points times each span's rows, their shares (r,) and the transposed rows, as windows.

    rows: the derivatives in control points.
    """
    spans, n = len(first), rows.shape[2]
    points = np.empty((spans, 3, n, n, n), rows.dtype)
    for s in range(spans):
        u, v, w = first[s]
        for c in range(3):
            for i in range(n):
                for j in range(n):
                    for k in range(n):
                        points[s, c, i, j, k] = control[c, u + i, v + j, w + k]
    factors = shares * _changes(rows, starts, points)
    flat, windows = rows.reshape(len(rows), 3 * n**3), np.zeros((spans, 3 * n**3), rows.dtype)
    for s in range(spans):
        for r in range(starts[s], starts[s + 1]):
            for i in range(3 * n**3):
                windows[s, i] += factors[r] * flat[r, i]
    return windows.reshape(spans, 3, n, n, n)


@numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})  # type: ignore[untyped-decorator]
def _changes(rows: Array, starts: IntArray, points: Array) -> Array:
    """Return the products of the rows of each span with its Bezier points (k, 3, n, n, n)."""
    flat, place = rows.reshape(len(rows), -1), points.reshape(len(points), -1)
    changes = np.empty(len(rows), rows.dtype)
    for s in range(len(points)):
        for r in range(starts[s], starts[s + 1]):
            change = rows.dtype.type(0.0)
            for i in range(flat.shape[1]):
                change += flat[r, i] * place[s, i]
            changes[r] = change
    return changes


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def diagonal_blocks(rows: Array, starts: IntArray, shares: Array) -> Array:
    """Return the blocks on the diagonal of `squared`, as windows (k, 6, n, n, n)."""
    n = rows.shape[2]
    flat, windows = rows.reshape(len(rows), 3, n**3), np.zeros((len(starts) - 1, 6, n**3), rows.dtype)
    for s in range(len(windows)):
        for r in range(starts[s], starts[s + 1]):
            for c in range(3):
                for other in range(c + 1):
                    entry = c * (c + 1) // 2 + other
                    for i in range(n**3):
                        windows[s, entry, i] += shares[r] * flat[r, c, i] * flat[r, other, i]
    return windows.reshape(len(windows), 6, n, n, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_windows(windows: Array, first: IntArray, total: Array) -> None:
    """Add windows (k, m, n, n, n) to control points (m, n_u, n_v, n_w); each starts at its first control point."""
    n = windows.shape[2]
    for s in range(len(first)):
        for c in range(windows.shape[1]):
            for i in range(n):
                for j in range(n):
                    for k in range(n):
                        total[c, first[s, 0] + i, first[s, 1] + j, first[s, 2] + k] += windows[s, c, i, j, k]
