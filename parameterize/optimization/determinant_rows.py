"""Compiles the rows of determinant_penalty.py: coefficients of det J below a floor, and their derivatives.

One call makes all rows of a few spans: between shorter calls, threads would wait for one another.
"""

import numba
import numpy as np

from ..arrays import Array, IntArray
from ..spline.bernstein import along_second_axis, cross_products, dot_products, windows


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def short_rows(
    control: Array,
    first: IntArray,
    weights: Array,
    volumes: Array,
    floors: Array,
    whole: Array,
    scales: tuple[Array, Array, Array],
    unscale: Array,
) -> tuple[IntArray, Array, Array, IntArray]:
    """Return the spans (k,) that have coefficients below their floors, and these coefficients, span by span.

    For the coefficients, return the shortfalls (r,), the derivatives (r, 3, n, n, n) in the span's Bezier points, and
    the first row of each span (k + 1,).

    first, weights, volumes, floors: of the spans to be examined, as in determinant_penalty.py. whole: (n,), the
    binomials of degree n - 1. scales: from differences of Bezier points to derivatives of F in scaled Bernstein form.
    unscale: (q, q, q), from there to the coefficients.
    """
    spans, n = len(first), weights.shape[2]
    points = _bezier_points(control, first, weights)
    slopes = [_derivative(points, scale, direction) for direction, scale in enumerate(scales)]
    crosses = [cross_products(slopes[1], slopes[2])]
    short, factors = dot_products(slopes[0], crosses[0]).reshape(unscale.size, spans), unscale.ravel()
    chosen, starts = _taken_from(floors, short, factors, volumes)
    slopes, crosses = [_on_chosen(slope, chosen) for slope in slopes], [_on_chosen(crosses[0], chosen)]
    for direction in range(1, 3):
        crosses.append(cross_products(slopes[(direction + 1) % 3], slopes[(direction + 2) % 3]))
    shortfall, rows = np.empty(starts[-1]), np.zeros((starts[-1], 3, n, n, n))
    sums = np.empty((3, 4, 2 * n, 2 * n, 2 * n))
    for k in range(len(chosen)):
        s, r = chosen[k], starts[k]
        _write_sums(crosses, k, sums)
        for i in range(len(factors)):
            if short[i, s] > 0.0:
                shortfall[r] = short[i, s]
                _write_derivatives(i, sums, whole, factors[i] / volumes[s], rows[r])
                r += 1
    return chosen, shortfall, rows, starts


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _taken_from(floors: Array, short: Array, factors: Array, volumes: Array) -> tuple[IntArray, IntArray]:
    """Take coefficients in scaled form (q, k) from their floors, in place; return the spans where something is left.

    The first row of each of these spans follows, and the number of rows.
    """
    counts = np.zeros(len(floors), np.int64)
    for i in range(len(short)):
        for s in range(len(floors)):
            short[i, s] = floors[s] - short[i, s] * (factors[i] / volumes[s])
            counts[s] += short[i, s] > 0.0
    chosen = np.flatnonzero(counts)
    starts = np.zeros(len(chosen) + 1, np.int64)
    for k in range(len(chosen)):
        starts[k + 1] = starts[k] + counts[chosen[k]]
    return chosen, starts


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bezier_points(control: Array, first: IntArray, weights: Array) -> Array:
    """Return the Bezier points (3, n, n, n, k) of spans with first control points (k, 3) and weights (k, 3, n, n)."""
    spans, n = len(first), weights.shape[2]
    one, starts = np.zeros(spans, np.int64), np.ascontiguousarray(first.T)
    points = windows(control.reshape(1, *control.shape), one, starts, (n, n, n)).reshape(1, 3, n**3, spans)
    for axis in range(3):
        matrices = np.empty((n, n, spans))
        for i in range(n):
            for j in range(n):
                for s in range(spans):
                    matrices[i, j, s] = weights[s, axis, i, j]
        sizes = 3 * n**axis, n, n ** (2 - axis), spans
        points = along_second_axis(matrices, points.reshape(sizes))
    return points.reshape(3, n, n, n, spans)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _derivative(points: Array, scale: Array, direction: int) -> Array:
    """Return a derivative of F (3, ..., k) in scaled Bernstein form, from Bezier points (3, n, n, n, k)."""
    n_u, n_v, n_w = scale.shape
    to_u, to_v, to_w = direction == 0, direction == 1, direction == 2
    found = np.empty((3, n_u, n_v, n_w, points.shape[4]))
    for c in range(3):
        for i in range(n_u):
            for j in range(n_v):
                for k in range(n_w):
                    here, ahead = points[c, i, j, k], points[c, i + to_u, j + to_v, k + to_w]
                    out, factor = found[c, i, j, k], scale[i, j, k]
                    for s in range(out.size):
                        out[s] = (ahead[s] - here[s]) * factor
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
def _write_sums(crosses: list[Array], span: int, sums: Array) -> None:
    """Write what `_write_derivatives` needs of a span: sums (3, 4, 2 n, 2 n, 2 n).

    With X_d the cross product of the derivatives of F but the d-th, and e_d the step in direction d, these are for
    each m the numbers X_d(m + e_d) + X_d(m) of the three directions, and (n - 1) times the sum of all X_d(m). An entry
    of X outside is 0, and m starts at -1 in each direction.
    """
    sums[:] = 0.0
    last = sums.shape[2] // 2 - 1
    for d in range(3):
        cross, u, v, w = crosses[d], d == 0, d == 1, d == 2
        for c in range(3):
            for i in range(cross.shape[1]):
                for j in range(cross.shape[2]):
                    for k in range(cross.shape[3]):
                        value = cross[c, i, j, k, span]
                        sums[c, d, i + 1, j + 1, k + 1] += value
                        sums[c, d, i + 1 - u, j + 1 - v, k + 1 - w] += value
                        sums[c, 3, i + 1, j + 1, k + 1] += last * value


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _write_derivatives(place: int, sums: Array, whole: Array, share: float, row: Array) -> None:
    """Write a row (3, n, n, n), `share` times the derivatives of a coefficient in scaled form in the Bezier points.

    place: the number of the coefficient. whole: C(n - 1, i). With the sums S of `_write_sums` at the place minus
    (i, j, k), the derivative in the point (i, j, k) is C(n - 1, i) C(n - 1, j) C(n - 1, k) (i S_0 + j S_1 + k S_2 -
    S_3), because (n - 1) C(n - 2, i - 1) = i C(n - 1, i).
    """
    n = len(whole)
    count, wide = 3 * n - 3, 2 * n
    a, b, c = place // count**2 + 1, place // count % count + 1, place % count + 1  # of the entry for i = j = k = 0
    for component in range(3):
        for i in range(max(0, a - wide + 1), min(n, a + 1)):
            for j in range(max(0, b - wide + 1), min(n, b + 1)):
                factor, out = share * whole[i] * whole[j], row[component, i, j]
                in_u, in_v = sums[component, 0, a - i, b - j], sums[component, 1, a - i, b - j]
                in_w, rest = sums[component, 2, a - i, b - j], sums[component, 3, a - i, b - j]
                for k in range(max(0, c - wide + 1), min(n, c + 1)):
                    m = c - k
                    out[k] = factor * whole[k] * (i * in_u[m] + j * in_v[m] + k * in_w[m] - rest[m])


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
    flat, total = rows.reshape(len(rows), 3, n**3), np.zeros((spans, 3, n**3), rows.dtype)
    for s in range(spans):
        for r in range(starts[s], starts[s + 1]):
            for c in range(3):
                for i in range(n**3):
                    total[s, c, i] += factors[r] * flat[r, c, i]
        for c in range(3):
            _along_axes(total[s, c], back[s, 0], back[s, 1], back[s, 2])
    return total.reshape(spans, 3, n, n, n)


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
    flat, total = rows.reshape(len(rows), 3 * n**3), np.zeros((spans, 3 * n**3), rows.dtype)
    for s in range(spans):
        for r in range(starts[s], starts[s + 1]):
            for i in range(3 * n**3):
                total[s, i] += factors[r] * flat[r, i]
    return total.reshape(spans, 3, n, n, n)


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
    flat, total = rows.reshape(len(rows), 3, n**3), np.zeros((len(starts) - 1, 6, n**3), rows.dtype)
    for s in range(len(total)):
        for r in range(starts[s], starts[s + 1]):
            for c in range(3):
                for other in range(c + 1):
                    entry = c * (c + 1) // 2 + other
                    for i in range(n**3):
                        total[s, entry, i] += shares[r] * flat[r, c, i] * flat[r, other, i]
    return total.reshape(len(total), 6, n, n, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_windows(parts: Array, first: IntArray, total: Array) -> None:
    """Add windows `parts` (k, m, n, n, n) to control points (m, n_u, n_v, n_w); each starts at its first one."""
    n = parts.shape[2]
    for s in range(len(first)):
        for c in range(parts.shape[1]):
            for i in range(n):
                for j in range(n):
                    for k in range(n):
                        total[c, first[s, 0] + i, first[s, 1] + j, first[s, 2] + k] += parts[s, c, i, j, k]
