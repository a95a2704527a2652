"""Evaluates and integrates by compiled sum factorization, one plane of quadrature points (with a fixed u) at a time.

Arrays of a plane have shape (q_w, q_v): v runs fastest. A table holds the basis of one direction (`quadrature.Table`);
tables are those of u, v, w. The innermost loops run along rows of memory, and the loops over the functions at a point
along the table's third part, a tuple: the compiler knows its length, and every degree has machine code of its own. The
order of the six entries of a symmetric matrix is uu, uv, uw, vv, vw, ww. (Antolin, Buffa, Calabro, Martinelli,
Sangalli, CMAME 2015.)
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import njit

from parameterize.arrays import Array, IntArray

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
Functions = tuple[int, ...]  # only its length counts
Table = tuple[IntArray, Array, Functions]
Tables = tuple[Table, Table, Table]


def compiled(function: Kernel) -> Kernel:
    """Compile a function on first use, keep the machine code on disk, and let other threads run during a call.

    Arguments must be arrays, numbers and plain tuples of these: a cache with the name of a class of this package would
    be unreadable once the class moves.
    """
    options = {"cache": True, "nogil": True, "error_model": "numpy"}
    kernel: Kernel = njit(fastmath={"contract", "reassoc", "nsz"}, **options)(function)
    return kernel


@compiled
def contract(first: IntArray, basis: Array, functions: Functions, source: Array, result: Array) -> None:
    """Write the values (q, m) of splines with coefficients (n, m) at the points of a direction to `result`.

    basis: (q, degree + 1), the values or derivatives of a table.
    """
    for q in range(result.shape[0]):
        at = first[q]
        for m in range(result.shape[1]):
            total = 0.0
            for j in range(len(functions)):
                total += basis[q, j] * source[at + j, m]
            result[q, m] = total


@compiled
def spread(first: IntArray, basis: Array, functions: Functions, source: Array, result: Array) -> None:
    """Apply the transpose of `contract`: add source (q, m) to result (n, m)."""
    for q in range(source.shape[0]):
        for j in range(len(functions)):
            at, value = first[q] + j, basis[q, j]
            for m in range(source.shape[1]):
                result[at, m] += value * source[q, m]


@compiled
def transpose(source: Array, result: Array) -> None:
    """Write a matrix, transposed, to `result`; numba's own assignment also compiles the words of its error: seconds."""
    for i in range(result.shape[0]):
        for j in range(result.shape[1]):
            result[i, j] = source[j, i]


@compiled
def evaluate_lines(coefficients: Array, point: int, tables: Tables, result: Array) -> None:
    """Contract a spline (n_u, n_v, n_w) in u and v: write its value, d/du and d/dv to result (3, n_w, q_v).

    The rows of the result are the coefficients in direction w, for all points of v in the plane of a point of u.
    """
    (first_u, u, functions_u), (first_v, v, functions_v), _ = tables
    _, n_v, n_w = coefficients.shape
    here, flat, planes = first_u[point : point + 1], coefficients.reshape(-1, n_v * n_w), np.empty((2, n_v, n_w))
    for d in range(2):
        contract(here, u[d, point : point + 1], functions_u, flat, planes[d].reshape(1, -1))
    lines = np.empty((result.shape[2], n_w))
    for place in range(3):  # value, d/du, d/dv
        contract(first_v, v[place // 2], functions_v, planes[place % 2], lines)
        transpose(lines, result[place])


@compiled
def evaluate_plane(coefficients: Array, point: int, tables: Tables, result: Array) -> None:
    """Write a spline and its gradient on the plane of a point of u to result (4, q_w, q_v): value, d/du, d/dv, d/dw."""
    first_w, w, functions_w = tables[2]
    lines = np.empty((3, coefficients.shape[2], result.shape[2]))
    evaluate_lines(coefficients, point, tables, lines)
    for place in range(3):
        contract(first_w, w[0], functions_w, lines[place], result[place])
    contract(first_w, w[1], functions_w, lines[0], result[3])


@compiled
def spread_plane(field: Array, point: int, tables: Tables, has_value: bool, result: Array) -> None:
    """Apply the transpose of `evaluate_plane`: add field (4, q_w, q_v) to result (n_u, n_v, n_w).

    The first entry of the field is added only if `has_value`.
    """
    (first_u, u, functions_u), (first_v, v, functions_v), (first_w, w, functions_w) = tables
    _, n_v, n_w = result.shape
    here, flat, planes = first_u[point : point + 1], result.reshape(-1, n_v * n_w), np.zeros((2, n_v, n_w))
    lines, turned = np.empty((field.shape[2], n_w)), np.empty((n_w, field.shape[2]))
    for place in range(3):
        turned[:] = 0.0
        if place > 0 or has_value:
            spread(first_w, w[0], functions_w, field[place], turned)
        if place == 0:
            spread(first_w, w[1], functions_w, field[3], turned)
        transpose(turned, lines)
        spread(first_v, v[place // 2], functions_v, lines, planes[place % 2])
    for d in range(2):
        spread(here, u[d, point : point + 1], functions_u, planes[d].reshape(1, -1), flat)


@compiled
def multiply_planes(coefficients: Array, points: IntArray, tables: Tables, factors: Array, result: Array) -> None:
    """Add the part of some points of u to the product of a scalar operator and coefficients (n_u, n_v, n_w).

    factors: (q_u, 6 or 7, q_w, q_v), as in `operator.Operator`. result: (n_u, n_v, n_w).
    """
    fields = np.empty((4, *factors.shape[2:]))
    rows = fields.reshape(4, -1)
    for point in points:
        evaluate_plane(coefficients, point, tables, fields)
        here = factors[point].reshape(factors.shape[1], -1)
        for m in range(rows.shape[1]):
            a, b, c = rows[1, m], rows[2, m], rows[3, m]
            rows[1, m] = here[0, m] * a + here[1, m] * b + here[2, m] * c
            rows[2, m] = here[1, m] * a + here[3, m] * b + here[4, m] * c
            rows[3, m] = here[2, m] * a + here[4, m] * b + here[5, m] * c
        has_value = len(here) == 7
        if has_value:
            for m in range(rows.shape[1]):
                rows[0, m] *= here[6, m]
        spread_plane(fields, point, tables, has_value, result)


@compiled
def plane_rows(fields: Array, weights: Array, rows: Array, measure: Array) -> None:
    """Compute the geometry of a plane from fields (3, 4, q_w, q_v), a map's components from `evaluate_plane`.

    The function writes rows (3, 3, q_w, q_v), the rows of J^-1 times the root of w |det J|, the parametric direction
    first, and measure (q_w, q_v) = w det J.
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
            scale = np.sqrt(weights[q, m] / abs(det)) * np.sign(det)
            measure[q, m] = weights[q, m] * det
            rows[0, 0, q, m], rows[0, 1, q, m], rows[0, 2, q, m] = scale * ax, scale * ay, scale * az
            rows[1, 0, q, m], rows[1, 1, q, m], rows[1, 2, q, m] = scale * bx, scale * by, scale * bz
            rows[2, 0, q, m], rows[2, 1, q, m], rows[2, 2, q, m] = scale * cx, scale * cy, scale * cz


@compiled
def tensor_factors(rows: Array, kappa: Array, factors: Array) -> None:
    """Write R kappa R^T to factors (6 or 7, q_w, q_v) from rows R (3, 3, q_w, q_v) and kappa (6, q_w, q_v)."""
    for q in range(rows.shape[2]):
        index = 0
        for a in range(3):
            for b in range(a, 3):
                for m in range(rows.shape[3]):
                    x, y, z = rows[a, 0, q, m], rows[a, 1, q, m], rows[a, 2, q, m]
                    along_x = kappa[0, q, m] * x + kappa[1, q, m] * y + kappa[2, q, m] * z
                    along_y = kappa[1, q, m] * x + kappa[3, q, m] * y + kappa[4, q, m] * z
                    along_z = kappa[2, q, m] * x + kappa[4, q, m] * y + kappa[5, q, m] * z
                    dot = rows[b, 0, q, m] * along_x + rows[b, 1, q, m] * along_y + rows[b, 2, q, m] * along_z
                    factors[index, q, m] = dot
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
