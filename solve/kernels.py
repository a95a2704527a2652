"""Compiled sum-factorization kernels, one plane of quadrature points (a fixed point of direction u) at a time.

Arrays of a plane have shape (q_w, q_v); v runs fastest, so that contractions in w are sums of contiguous rows.
A table is `first` (q,) and `values` (2, q, degree + 1), as in `quadrature.Table`. Every kernel works for any degree.
The order of the six factors of a symmetric matrix is uu, uv, uw, vv, vw, ww.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from parameterize.bspline import Array

Index = NDArray[np.int64]
Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(function: Kernel) -> Kernel:
    """Compile on first use, keep the machine code on disk, and let other threads run meanwhile."""
    options = {"cache": True, "nogil": True, "error_model": "numpy"}
    kernel: Kernel = njit(fastmath={"contract", "reassoc", "nsz"}, **options)(function)
    return kernel


@compiled
def contract_uv(
    coefficients: Array, first_u: int, u: Array, first_v: Index, v: Array, planes: Array, out: Array
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
def spread_uv(fields: Array, first_u: int, u: Array, first_v: Index, v: Array, planes: Array, result: Array) -> None:
    """Transpose of `contract_uv`: adds fields (3, n_w, q_v) to result (n_u, n_v, n_w)."""
    _, n_v, n_w = planes.shape
    planes[:] = 0.0
    rows = np.empty((3, n_w))
    row, row_u, row_v = rows[0], rows[1], rows[2]
    for q in range(v.shape[1]):
        for k in range(n_w):
            row[k], row_u[k], row_v[k] = fields[0, k, q], fields[1, k, q], fields[2, k, q]
        for j in range(v.shape[2]):
            value, slope = v[0, q, j], v[1, q, j]
            plane, plane_u = planes[0, first_v[q] + j], planes[1, first_v[q] + j]
            for k in range(n_w):
                plane[k] += value * row[k] + slope * row_v[k]
                plane_u[k] += value * row_u[k]
    for i in range(u.shape[1]):
        value, slope = u[0, i], u[1, i]
        for j in range(n_v):
            target, plane, plane_u = result[first_u + i, j], planes[0, j], planes[1, j]
            for k in range(n_w):
                target[k] += value * plane[k] + slope * plane_u[k]


@compiled
def evaluate_plane(
    coefficients: Array, first_u: int, u: Array, first_v: Index, v: Array, first_w: Index, w: Array, out: Array
) -> None:
    """A spline and its parametric gradient on a plane: out (4, q_w, q_v) = value, d/du, d/dv, d/dw."""
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
def integrate_plane(field: Array, first_v: Index, v: Array, first_w: Index, w: Array, out: Array) -> None:
    """Integrate field (q_w, q_v), weights included, against products of functions: out (n_v, n_w).

    v: (q_v, degree_v + 1) and w: (q_w, degree_w + 1) hold the functions' values.
    """
    n_v, n_w = out.shape
    lines = np.zeros((n_w, v.shape[0]))
    for q in range(w.shape[0]):
        for k in range(w.shape[1]):
            line, row, value = lines[first_w[q] + k], field[q], w[q, k]
            for m in range(line.size):
                line[m] += value * row[m]
    out[:] = 0.0
    for q in range(v.shape[0]):
        for j in range(v.shape[1]):
            target, value = out[first_v[q] + j], v[q, j]
            for k in range(n_w):
                target[k] += value * lines[k, q]


@compiled
def plane_factors(fields: Array, weights: Array, factors: Array, measure: Array) -> None:
    """Geometry of a plane from fields (3, 4, q_w, q_v), a map's components as `evaluate_plane` gives them.

    Writes factors (q_w, 6, q_v) = w det J J^-1 J^-T and measure (q_w, q_v) = w det J.
    """
    n_w, n_v = weights.shape
    for q in range(n_w):
        for m in range(n_v):
            xu, xv, xw = fields[0, 1, q, m], fields[0, 2, q, m], fields[0, 3, q, m]
            yu, yv, yw = fields[1, 1, q, m], fields[1, 2, q, m], fields[1, 3, q, m]
            zu, zv, zw = fields[2, 1, q, m], fields[2, 2, q, m], fields[2, 3, q, m]
            # rows of det J J^-1: the cross products of the tangents
            ax, ay, az = yv * zw - zv * yw, zv * xw - xv * zw, xv * yw - yv * xw
            bx, by, bz = yw * zu - zw * yu, zw * xu - xw * zu, xw * yu - yw * xu
            cx, cy, cz = yu * zv - zu * yv, zu * xv - xu * zv, xu * yv - yu * xv
            det = xu * ax + yu * ay + zu * az
            scale = weights[q, m] / det
            factors[q, 0, m] = scale * (ax * ax + ay * ay + az * az)
            factors[q, 1, m] = scale * (ax * bx + ay * by + az * bz)
            factors[q, 2, m] = scale * (ax * cx + ay * cy + az * cz)
            factors[q, 3, m] = scale * (bx * bx + by * by + bz * bz)
            factors[q, 4, m] = scale * (bx * cx + by * cy + bz * cz)
            factors[q, 5, m] = scale * (cx * cx + cy * cy + cz * cz)
            measure[q, m] = weights[q, m] * det


@compiled
def plane_tensor_factors(fields: Array, weights: Array, kappa: Array, factors: Array, measure: Array) -> None:
    """As `plane_factors` with a symmetric tensor kappa (6, q_w, q_v): w det J J^-1 kappa J^-T."""
    n_w, n_v = weights.shape
    rows = np.empty((3, 3))  # of det J J^-1
    fluxes = np.empty((3, 3))  # each row times kappa
    for q in range(n_w):
        for m in range(n_v):
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                for i in range(3):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    rows[a, i] = (
                        fields[j, b + 1, q, m] * fields[k, c + 1, q, m]
                        - fields[k, b + 1, q, m] * fields[j, c + 1, q, m]
                    )
            xx, xy, xz = kappa[0, q, m], kappa[1, q, m], kappa[2, q, m]
            yy, yz, zz = kappa[3, q, m], kappa[4, q, m], kappa[5, q, m]
            for a in range(3):
                x, y, z = rows[a, 0], rows[a, 1], rows[a, 2]
                fluxes[a, 0] = xx * x + xy * y + xz * z
                fluxes[a, 1] = xy * x + yy * y + yz * z
                fluxes[a, 2] = xz * x + yz * y + zz * z
            det = 0.0
            for i in range(3):
                det += fields[i, 1, q, m] * rows[0, i]
            index = 0
            for a in range(3):
                for b in range(a, 3):
                    dot = rows[b, 0] * fluxes[a, 0] + rows[b, 1] * fluxes[a, 1] + rows[b, 2] * fluxes[a, 2]
                    factors[q, index, m] = weights[q, m] / det * dot
                    index += 1
            measure[q, m] = weights[q, m] * det


@compiled
def add_mass(
    x: Array,
    first_u: Index,
    u: Array,
    first_v: Index,
    v: Array,
    first_w: Index,
    w: Array,
    mass: Array,
    result: Array,
) -> None:
    """Mass matrix times x, added to result; both (n_u, n_v, n_w), from mass (q_u, q_w, q_v)."""
    _, n_v, n_w = x.shape
    fields = np.empty((4, w.shape[1], v.shape[1]))
    plane = np.empty((n_v, n_w))
    for p in range(u.shape[1]):
        evaluate_plane(x, first_u[p], np.ascontiguousarray(u[:, p]), first_v, v, first_w, w, fields)
        integrate_plane(mass[p] * fields[0], first_v, v[0], first_w, w[0], plane)
        for i in range(u.shape[2]):
            result[first_u[p] + i] += u[0, p, i] * plane


@compiled
def apply_stiffness(
    x: Array,
    first_u: Index,
    u: Array,
    first_v: Index,
    v: Array,
    first_w: Index,
    w: Array,
    factors: Array,
    result: Array,
) -> None:
    """Stiffness times x: result = A x, both (n_u, n_v, n_w), from factors (q_u, q_w, 6, q_v).

    The gradient lives one row of q_v points at a time, between the contraction in w and its transpose.
    """
    _, n_v, n_w = x.shape
    planes = np.empty((2, n_v, n_w))
    lines = np.empty((3, n_w, v.shape[1]))
    sums = np.empty((3, n_w, v.shape[1]))
    rows = np.empty((3, v.shape[1]))
    result[:] = 0.0
    for p in range(u.shape[1]):
        u_here = np.ascontiguousarray(u[:, p])
        contract_uv(x, first_u[p], u_here, first_v, v, planes, lines)
        sums[:] = 0.0
        for q in range(w.shape[1]):
            _gradient_row(lines, first_w[q], w[0, q], w[1, q], rows)
            _flux_row(factors[p, q], rows)
            _spread_row(rows, first_w[q], w[0, q], w[1, q], sums)
        spread_uv(sums, first_u[p], u_here, first_v, v, planes, result)


@compiled
def _gradient_row(lines: Array, first: int, values: Array, slopes: Array, rows: Array) -> None:
    """Contract w: rows (3, q_v) = d/du, d/dv, d/dw at one point of w."""
    rows[:] = 0.0
    row_u, row_v, row_w = rows[0], rows[1], rows[2]
    for k in range(values.size):
        value, slope = values[k], slopes[k]
        line, line_u, line_v = lines[0, first + k], lines[1, first + k], lines[2, first + k]
        for m in range(row_u.size):
            row_u[m] += value * line_u[m]
            row_v[m] += value * line_v[m]
            row_w[m] += slope * line[m]


@compiled
def _flux_row(factors: Array, rows: Array) -> None:
    """Multiply the gradients of a row by their symmetric factors (6, q_v), in place."""
    row_u, row_v, row_w = rows[0], rows[1], rows[2]
    uu, uv, uw, vv, vw, ww = factors[0], factors[1], factors[2], factors[3], factors[4], factors[5]
    for m in range(row_u.size):
        a, b, c = row_u[m], row_v[m], row_w[m]
        row_u[m] = uu[m] * a + uv[m] * b + uw[m] * c
        row_v[m] = uv[m] * a + vv[m] * b + vw[m] * c
        row_w[m] = uw[m] * a + vw[m] * b + ww[m] * c


@compiled
def _spread_row(rows: Array, first: int, values: Array, slopes: Array, sums: Array) -> None:
    """Transpose of `_gradient_row`: adds to sums (3, n_w, q_v)."""
    row_u, row_v, row_w = rows[0], rows[1], rows[2]
    for k in range(values.size):
        value, slope = values[k], slopes[k]
        line, line_u, line_v = sums[0, first + k], sums[1, first + k], sums[2, first + k]
        for m in range(row_u.size):
            line[m] += slope * row_w[m]
            line_u[m] += value * row_u[m]
            line_v[m] += value * row_v[m]


@compiled
def plane_errors(fields: Array, weights: Array, spline: Array, exact: Array) -> tuple[float, float, float]:
    """Sums over a plane of (u - u_h)^2, u^2 and |grad u - grad u_h|^2, each times w |det J|.

    fields (3, 4, q_w, q_v): the map. spline (4, q_w, q_v): u_h and its parametric gradient.
    exact (4, q_w, q_v): u and its physical gradient.
    """
    error, norm, seminorm = 0.0, 0.0, 0.0
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
    return error, norm, seminorm
