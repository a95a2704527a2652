"""Compiled sum-factorization kernels, one plane of quadrature points (a fixed point of direction u) at a time.

Arrays of a plane have shape (q_w, q_v); v runs fastest, so that contractions in w are sums of contiguous rows.
A table is `first` (q,) and `values` (2, q, degree + 1), as in `quadrature.Table`. Every kernel works for any degree.
The order of the six factors of a symmetric matrix is uu, uv, uw, vv, vw, ww.
"""

from __future__ import annotations

import numpy as np

from parameterize.arrays import Array, IntArray

from ..compiled import compiled

LANES = 24  # points of direction v in a block of factors


@compiled
def contract_uv(
    coefficients: Array, first_u: int, u: Array, first_v: IntArray, v: Array, planes: Array, out: Array
) -> None:
    """Contract directions u and v: out (3, n_w, q_v) = value, u derivative, v derivative.

    u: (2, degree_u + 1) at the one point; planes (2, n_v, n_w) is workspace.
    """
    _, n_v, n_w = planes.shape
    planes[:] = 0.0
    for i in range(u.shape[1]):
        value, slope = u[0, i], u[1, i]
        for j in range(n_v):
            source, row, row_u = coefficients[first_u + i, j], planes[0, j], planes[1, j]
            for k in range(n_w):
                row[k] += value * source[k]
                row_u[k] += slope * source[k]
    rows = np.empty((3, n_w))
    row, row_u, row_v = rows[0], rows[1], rows[2]
    for q in range(v.shape[1]):
        rows[:] = 0.0
        for j in range(v.shape[2]):
            value, slope = v[0, q, j], v[1, q, j]
            plane, plane_u = planes[0, first_v[q] + j], planes[1, first_v[q] + j]
            for k in range(n_w):
                row[k] += value * plane[k]
                row_u[k] += value * plane_u[k]
                row_v[k] += slope * plane[k]
        for k in range(n_w):
            out[0, k, q], out[1, k, q], out[2, k, q] = row[k], row_u[k], row_v[k]


@compiled
def evaluate_plane(
    coefficients: Array, first_u: int, u: Array, first_v: IntArray, v: Array, first_w: IntArray, w: Array, out: Array
) -> None:
    """Evaluate a spline and its parametric gradient on a plane: out (4, q_w, q_v) = value, d/du, d/dv, d/dw."""
    _, n_v, n_w = coefficients.shape
    lines = np.empty((3, n_w, v.shape[1]))
    contract_uv(coefficients, first_u, u, first_v, v, np.empty((2, n_v, n_w)), lines)
    out[:] = 0.0
    for q in range(w.shape[1]):
        row, row_u, row_v, row_w = out[0, q], out[1, q], out[2, q], out[3, q]
        for k in range(w.shape[2]):
            value, slope, at = w[0, q, k], w[1, q, k], first_w[q] + k
            line, line_u, line_v = lines[0, at], lines[1, at], lines[2, at]
            for m in range(line.size):
                row[m] += value * line[m]
                row_u[m] += value * line_u[m]
                row_v[m] += value * line_v[m]
                row_w[m] += slope * line[m]


@compiled
def integrate_plane(
    fields: Array, index: int, first_v: IntArray, v: Array, first_w: IntArray, w: Array, out: Array
) -> None:
    """Integrate a field of a plane, weights included, against products of functions: out (n_v, n_w).

    fields: (v blocks, q_w, fields, points of v in a block); the field with number `index` is integrated.
    v: (q_v, degree_v + 1) and w: (q_w, degree_w + 1) hold the functions' values.
    """
    n_v, n_w = out.shape
    blocks, width = fields.shape[0], fields.shape[3]
    lines = np.zeros((n_w, blocks * width))
    for block in range(blocks):
        for q in range(w.shape[0]):
            row = fields[block, q, index]
            for k in range(w.shape[1]):
                line, value = lines[first_w[q] + k, block * width : (block + 1) * width], w[q, k]
                for m in range(width):
                    line[m] += value * row[m]
    out[:] = 0.0
    row = np.empty(n_w)
    for q in range(v.shape[0]):
        for k in range(n_w):
            row[k] = lines[k, q]
        for j in range(v.shape[1]):
            target, value = out[first_v[q] + j], v[q, j]
            for k in range(n_w):
                target[k] += value * row[k]


@compiled
def plane_factors(fields: Array, weights: Array, kappa: Array, factors: Array, measure: Array) -> None:
    """Geometry of a plane from fields (3, 4, q_w, q_v), a map's components as `evaluate_plane` gives them.

    Writes factors (v blocks, q_w, 6 or 7, LANES): w kappa det J J^-1 J^-T, zero where a block exceeds the plane, and
    measure (q_w, q_v) = w det J. kappa: (q_w, q_v).
    """
    n_w, n_v = weights.shape
    near = np.zeros(12 * LANES)  # a row's tangents, weights, coefficients and measure, at fixed distances
    for a in range(3):  # the identity: lanes beyond the plane must not divide by zero
        near[4 * a * LANES : (4 * a + 1) * LANES] = 1.0
    for block in range(factors.shape[0]):
        start = block * LANES
        width = min(LANES, n_v - start)
        for q in range(n_w):
            for a in range(3):
                for b in range(3):
                    to, row = (3 * a + b) * LANES, fields[a, b + 1, q, start : start + width]
                    for m in range(width):
                        near[to + m] = row[m]
            row, row_kappa = weights[q, start : start + width], kappa[q, start : start + width]
            near[9 * LANES : 11 * LANES] = 0.0
            for m in range(width):
                near[9 * LANES + m] = row[m]
                near[10 * LANES + m] = row_kappa[m]
            _block_factors(near, factors[block, q].reshape(-1))
            row = measure[q, start : start + width]
            for m in range(width):
                row[m] = near[11 * LANES + m]


@compiled
def _block_factors(near: Array, factors: Array) -> None:
    for m in range(LANES):
        xu, xv, xw = near[m], near[LANES + m], near[2 * LANES + m]
        yu, yv, yw = near[3 * LANES + m], near[4 * LANES + m], near[5 * LANES + m]
        zu, zv, zw = near[6 * LANES + m], near[7 * LANES + m], near[8 * LANES + m]
        # rows of det J J^-1: the cross products of the tangents
        ax, ay, az = yv * zw - zv * yw, zv * xw - xv * zw, xv * yw - yv * xw
        bx, by, bz = yw * zu - zw * yu, zw * xu - xw * zu, xw * yu - yw * xu
        cx, cy, cz = yu * zv - zu * yv, zu * xv - xu * zv, xu * yv - yu * xv
        det = xu * ax + yu * ay + zu * az
        weight = near[9 * LANES + m]
        scale = weight * near[10 * LANES + m] / det
        near[11 * LANES + m] = weight * det
        factors[m] = scale * (ax * ax + ay * ay + az * az)
        factors[LANES + m] = scale * (ax * bx + ay * by + az * bz)
        factors[2 * LANES + m] = scale * (ax * cx + ay * cy + az * cz)
        factors[3 * LANES + m] = scale * (bx * bx + by * by + bz * bz)
        factors[4 * LANES + m] = scale * (bx * cx + by * cy + bz * cz)
        factors[5 * LANES + m] = scale * (cx * cx + cy * cy + cz * cz)


@compiled
def plane_rows(fields: Array, weights: Array, rows: Array, measure: Array) -> None:
    """Geometry of a plane from fields (3, 4, q_w, q_v): the rows of J^-1, times the root of w |det J|.

    Writes rows (3, 3, q_w, q_v), the parametric direction first, and measure (q_w, q_v) = w det J.
    """
    n_w, n_v = weights.shape
    for q in range(n_w):
        for m in range(n_v):
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                for i in range(3):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    rows[a, i, q, m] = (
                        fields[j, b + 1, q, m] * fields[k, c + 1, q, m]
                        - fields[k, b + 1, q, m] * fields[j, c + 1, q, m]
                    )
            det = 0.0
            for i in range(3):
                det += fields[i, 1, q, m] * rows[0, i, q, m]
            scale = np.sqrt(weights[q, m] / abs(det))
            for a in range(3):
                for i in range(3):
                    rows[a, i, q, m] *= scale if det > 0.0 else -scale
            measure[q, m] = weights[q, m] * det


@compiled
def tensor_factors(rows: Array, kappa: Array, factors: Array) -> None:
    """Write R kappa R^T to factors (v blocks, q_w, 6 or 7, LANES) from rows R (3, 3, q_w, q_v), kappa (6, q_w, q_v)."""
    flux = np.empty(3)
    for q in range(rows.shape[2]):
        for m in range(rows.shape[3]):
            xx, xy, xz = kappa[0, q, m], kappa[1, q, m], kappa[2, q, m]
            yy, yz, zz = kappa[3, q, m], kappa[4, q, m], kappa[5, q, m]
            index = 0
            for a in range(3):
                x, y, z = rows[a, 0, q, m], rows[a, 1, q, m], rows[a, 2, q, m]
                flux[0], flux[1], flux[2] = xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
                for b in range(a, 3):
                    dot = rows[b, 0, q, m] * flux[0] + rows[b, 1, q, m] * flux[1] + rows[b, 2, q, m] * flux[2]
                    factors[m // LANES, q, index, m % LANES] = dot
                    index += 1


@compiled
def turn(rows: Array, source: Array, result: Array, back: bool) -> None:
    """Write R^T or, `back`, R times source (c, 3, q_w, q_v), with R the rows (3, 3, q_w, q_v) of `plane_rows`."""
    for c in range(source.shape[0]):
        for q in range(source.shape[2]):
            for i in range(3):
                for m in range(source.shape[3]):
                    total = 0.0
                    for a in range(3):
                        total += (rows[i, a, q, m] if back else rows[a, i, q, m]) * source[c, a, q, m]
                    result[c, i, q, m] = total


@compiled
def spread_plane(
    field: Array,
    first_u: int,
    u: Array,
    first_v: IntArray,
    v: Array,
    first_w: IntArray,
    w: Array,
    has_value: bool,
    result: Array,
) -> None:
    """Transpose of `evaluate_plane`: adds field (4, q_w, q_v), its first entry only if `has_value`.

    result: (n_u, n_v, n_w).
    """
    _, n_v, n_w = result.shape
    lines = np.zeros((3, n_w, v.shape[1]))
    for q in range(w.shape[1]):
        row_u, row_v, row_w = field[1, q], field[2, q], field[3, q]
        for k in range(w.shape[2]):
            value, slope, at = w[0, q, k], w[1, q, k], first_w[q] + k
            line, line_u, line_v = lines[0, at], lines[1, at], lines[2, at]
            for m in range(row_u.size):
                line[m] += slope * row_w[m]
                line_u[m] += value * row_u[m]
                line_v[m] += value * row_v[m]
    for q in range(w.shape[1] if has_value else 0):
        row = field[0, q]
        for k in range(w.shape[2]):
            line, value = lines[0, first_w[q] + k], w[0, q, k]
            for m in range(row.size):
                line[m] += value * row[m]
    planes = np.zeros((2, n_v, n_w))
    for q in range(v.shape[1]):
        for j in range(v.shape[2]):
            value, slope = v[0, q, j], v[1, q, j]
            plane, plane_u = planes[0, first_v[q] + j], planes[1, first_v[q] + j]
            for k in range(n_w):
                plane[k] += value * lines[0, k, q] + slope * lines[2, k, q]
                plane_u[k] += value * lines[1, k, q]
    for i in range(u.shape[1]):
        value, slope = u[0, i], u[1, i]
        for j in range(n_v):
            target, plane, plane_u = result[first_u + i, j], planes[0, j], planes[1, j]
            for k in range(n_w):
                target[k] += value * plane[k] + slope * plane_u[k]


@compiled
def plane_errors(fields: Array, weights: Array, spline: Array, exact: Array) -> tuple[float, float, float, float]:
    """Sums over a plane of (u - u_h)^2, u^2, |grad u - grad u_h|^2 and |grad u|^2, each times w |det J|.

    fields (3, 4, q_w, q_v): the map. spline (4, q_w, q_v): u_h and its parametric gradient.
    exact (4, q_w, q_v): u and its physical gradient.
    """
    error, norm, seminorm, slope = 0.0, 0.0, 0.0, 0.0
    n_w, n_v = weights.shape
    for q in range(n_w):
        for m in range(n_v):
            xu, xv, xw = fields[0, 1, q, m], fields[0, 2, q, m], fields[0, 3, q, m]
            yu, yv, yw = fields[1, 1, q, m], fields[1, 2, q, m], fields[1, 3, q, m]
            zu, zv, zw = fields[2, 1, q, m], fields[2, 2, q, m], fields[2, 3, q, m]
            ax, ay, az = yv * zw - zv * yw, zv * xw - xv * zw, xv * yw - yv * xw
            bx, by, bz = yw * zu - zw * yu, zw * xu - xw * zu, xw * yu - yw * xu
            cx, cy, cz = yu * zv - zu * yv, zu * xv - xu * zv, xu * yv - yu * xv
            det = xu * ax + yu * ay + zu * az
            su, sv, sw = spline[1, q, m] / det, spline[2, q, m] / det, spline[3, q, m] / det
            dx = exact[1, q, m] - (ax * su + bx * sv + cx * sw)
            dy = exact[2, q, m] - (ay * su + by * sv + cy * sw)
            dz = exact[3, q, m] - (az * su + bz * sv + cz * sw)
            difference = exact[0, q, m] - spline[0, q, m]
            volume = weights[q, m] * abs(det)
            error += volume * difference * difference
            norm += volume * exact[0, q, m] * exact[0, q, m]
            seminorm += volume * (dx * dx + dy * dy + dz * dz)
            slope += volume * (exact[1, q, m] ** 2 + exact[2, q, m] ** 2 + exact[3, q, m] ** 2)
    return error, norm, seminorm, slope
