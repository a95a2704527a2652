"""Compiled product of the operator with a coefficient array, by sum factorization.

Points of direction v are cut into blocks of LANES, coefficients of direction w into blocks of ROWS: the innermost
loops have a fixed length and fixed strides, which is what the compiler needs to use vector instructions. Loops over
the points and the functions of a group run over the tuples `points` and `functions` of a `quadrature.GroupTable`, and
those over the factors over a tuple `terms`: the compiler knows their lengths, and every degree gets machine code of its
own. Where a group holds fewer points its table is zero: what then stands in the workspace does not matter.

    coefficients    (n_u, n_v, n_w) packed as (n_u, w blocks, n_v, ROWS)
    planes          (2, w blocks, n_v, ROWS): value and u derivative at one point of u
    lines           (v blocks, n_w, 3, LANES): value, u and v derivative (B B, B' B, B B') at points of u and v
    factors         (q_u, v blocks, q_w x 6 or 7 x LANES): uu, uv, uw, vv, vw, ww, mass
    u               Table: functions and their first number, point by point
    v, w            GroupTable of a direction; `values` of one group is a table (points, 2, degree + 1)
"""

from __future__ import annotations

import numpy as np

from parameterize.arrays import Array, IntArray

from ..compiled import compiled
from .kernels import LANES
from .quadrature import GroupTable, Table

ROWS = 16
Sizes = tuple[int, ...]  # only its length counts


@compiled
def pack(values: Array, start_u: int, start_v: int, start_w: int, packed: Array) -> None:
    """Place values (m_u, m_v, m_w) at the given start in packed (n_u, w blocks, n_v, ROWS), which is zero elsewhere."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            row = values[i, j]
            for k in range(row.size):
                at = start_w + k
                packed[start_u + i, at // ROWS, start_v + j, at % ROWS] = row[k]


@compiled
def unpack(packed: Array, start_u: int, start_v: int, start_w: int, values: Array) -> None:
    """Transpose of `pack`: reads values (m_u, m_v, m_w)."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            row = values[i, j]
            for k in range(row.size):
                at = start_w + k
                row[k] = packed[start_u + i, at // ROWS, start_v + j, at % ROWS]


@compiled
def multiply_planes(
    packed: Array,
    points: IntArray,
    u: Table,
    v: GroupTable,
    w: GroupTable,
    factors: Array,
    terms: Sizes,
    n_w: int,
    result: Array,
) -> None:
    """Add the part of some points of u to the product with the matrix, `result`, packed as the coefficients are.

    points: (m,). At each the coefficients are contracted in u, v and w, multiplied with the factors, and spread in w,
    v and u.
    """
    w_blocks, n_v = packed.shape[1], packed.shape[2]
    planes = np.empty((2, w_blocks * n_v * ROWS))
    lines = np.zeros((factors.shape[1], n_w, 3 * LANES))
    sums = np.empty(lines.shape)
    rows = np.zeros(len(v.points) * 3 * ROWS)
    near = np.zeros(len(w.points) * len(terms) * LANES)
    fluxes = np.empty(len(w.points) * 4 * LANES)
    for point in points:
        first, values, slopes = u.first[point], u.values[0, point], u.values[1, point]
        planes[:] = 0.0
        for i in range(values.size):
            _contract_u(packed[first + i].reshape(-1), values[i], slopes[i], planes)
        _contract_v(planes, w_blocks, v, rows, lines)
        for block in range(lines.shape[0]):
            sums[block] = 0.0
            here = factors[point, block]
            _multiply_w(lines[block].reshape(-1), here, w, terms, near, fluxes, sums[block].reshape(-1))
        planes[:] = 0.0
        _spread_v(sums, w_blocks, v, rows, planes)
        for i in range(values.size):
            _spread_u(planes, values[i], slopes[i], result[first + i].reshape(-1))


@compiled
def _contract_u(source: Array, value: float, slope: float, planes: Array) -> None:
    plane, plane_u = planes[0], planes[1]
    for m in range(source.size):
        plane[m] += value * source[m]
        plane_u[m] += slope * source[m]


@compiled
def _spread_u(planes: Array, value: float, slope: float, target: Array) -> None:
    plane, plane_u = planes[0], planes[1]
    for m in range(target.size):
        target[m] += value * plane[m] + slope * plane_u[m]


@compiled
def _contract_v(planes: Array, w_blocks: int, v: GroupTable, rows: Array, lines: Array) -> None:
    counts, order = v.points, v.functions
    n_w, size = lines.shape[1], planes.shape[1] // w_blocks
    for block in range(w_blocks):
        plane, plane_u = planes[0, block * size : (block + 1) * size], planes[1, block * size : (block + 1) * size]
        width = min(ROWS, n_w - block * ROWS)
        for group in range(v.first.size):
            window = slice(v.first[group] * ROWS, (v.first[group] + len(order)) * ROWS)
            _contract_group(plane[window], plane_u[window], v.values[group].reshape(-1), counts, order, rows)
            for q in range(v.length[group]):
                point = v.start[group] + q
                target = lines[point // LANES, block * ROWS : block * ROWS + width]
                lane = point % LANES
                for k in range(width):
                    target[k, lane] = rows[3 * q * ROWS + k]
                    target[k, LANES + lane] = rows[(3 * q + 1) * ROWS + k]
                    target[k, 2 * LANES + lane] = rows[(3 * q + 2) * ROWS + k]


@compiled
def _contract_group(plane: Array, plane_u: Array, table: Array, counts: Sizes, order: Sizes, rows: Array) -> None:
    """At a group of points of v: rows (points, 3, ROWS) from planes (degree + 1, ROWS)."""
    size = len(order)
    for m in range(ROWS):
        for q in range(len(counts)):
            a, b, c = 0.0, 0.0, 0.0
            for j in range(size):
                value, slope = table[2 * q * size + j], table[(2 * q + 1) * size + j]
                a += value * plane[j * ROWS + m]
                b += value * plane_u[j * ROWS + m]
                c += slope * plane[j * ROWS + m]
            rows[3 * q * ROWS + m] = a
            rows[(3 * q + 1) * ROWS + m] = b
            rows[(3 * q + 2) * ROWS + m] = c


@compiled
def _spread_v(sums: Array, w_blocks: int, v: GroupTable, rows: Array, planes: Array) -> None:
    counts, order = v.points, v.functions
    n_w, size = sums.shape[1], planes.shape[1] // w_blocks
    for block in range(w_blocks):
        plane, plane_u = planes[0, block * size : (block + 1) * size], planes[1, block * size : (block + 1) * size]
        width = min(ROWS, n_w - block * ROWS)
        for group in range(v.first.size):
            for q in range(v.length[group]):
                point = v.start[group] + q
                source = sums[point // LANES, block * ROWS : block * ROWS + width]
                lane = point % LANES
                for k in range(width):
                    rows[3 * q * ROWS + k] = source[k, lane]
                    rows[(3 * q + 1) * ROWS + k] = source[k, LANES + lane]
                    rows[(3 * q + 2) * ROWS + k] = source[k, 2 * LANES + lane]
            window = slice(v.first[group] * ROWS, (v.first[group] + len(order)) * ROWS)
            _spread_group(rows, v.values[group].reshape(-1), counts, order, plane[window], plane_u[window])


@compiled
def _spread_group(rows: Array, table: Array, counts: Sizes, order: Sizes, plane: Array, plane_u: Array) -> None:
    """Transpose of `_contract_group`: adds to the planes."""
    size = len(order)
    for m in range(ROWS):
        for j in range(size):
            a, b = 0.0, 0.0
            for q in range(len(counts)):
                value, slope = table[2 * q * size + j], table[(2 * q + 1) * size + j]
                a += value * rows[3 * q * ROWS + m] + slope * rows[(3 * q + 2) * ROWS + m]
                b += value * rows[(3 * q + 1) * ROWS + m]
            plane[j * ROWS + m] += a
            plane_u[j * ROWS + m] += b


@compiled
def _multiply_w(
    lines: Array, factors: Array, w: GroupTable, terms: Sizes, near: Array, fluxes: Array, sums: Array
) -> None:
    """Contract w, multiply with the factors, spread back: for one block of points of v, all groups of points of w."""
    counts, order = w.points, w.functions
    step = len(terms) * LANES
    for group in range(w.first.size):
        window = slice(w.first[group] * 3 * LANES, (w.first[group] + len(order)) * 3 * LANES)
        table, source = w.values[group].reshape(-1), factors[w.start[group] * step :]
        for m in range(w.length[group] * step):  # in the order of memory, which the next loop is not: a third faster
            near[m] = source[m]
        _flux_group(lines[window], near, table, counts, order, terms, fluxes)
        _spread_flux(fluxes, table, counts, order, terms, sums[window])


@compiled
def _flux_group(
    lines: Array, factors: Array, table: Array, counts: Sizes, order: Sizes, terms: Sizes, fluxes: Array
) -> None:
    """Fluxes (points, 4, LANES) of a group of points of w: mass term, along u, v, w."""
    size = len(order)
    for m in range(LANES):
        for q in range(len(counts)):
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for k in range(size):
                value, slope = table[2 * q * size + k], table[(2 * q + 1) * size + k]
                a += value * lines[(3 * k + 1) * LANES + m]
                b += value * lines[(3 * k + 2) * LANES + m]
                c += slope * lines[3 * k * LANES + m]
                if len(terms) == 7:
                    d += value * lines[3 * k * LANES + m]
            at, to = q * len(terms) * LANES + m, 4 * q * LANES + m
            uu, uv, uw = factors[at], factors[at + LANES], factors[at + 2 * LANES]
            vv, vw, ww = factors[at + 3 * LANES], factors[at + 4 * LANES], factors[at + 5 * LANES]
            if len(terms) == 7:
                fluxes[to] = factors[at + 6 * LANES] * d
            fluxes[to + LANES] = uu * a + uv * b + uw * c
            fluxes[to + 2 * LANES] = uv * a + vv * b + vw * c
            fluxes[to + 3 * LANES] = uw * a + vw * b + ww * c


@compiled
def _spread_flux(fluxes: Array, table: Array, counts: Sizes, order: Sizes, terms: Sizes, sums: Array) -> None:
    """Transpose of the contraction of w: adds to sums (degree + 1, 3, LANES)."""
    size = len(order)
    for m in range(LANES):
        for k in range(size):
            a, b, c = sums[(3 * k + 1) * LANES + m], sums[(3 * k + 2) * LANES + m], sums[3 * k * LANES + m]
            for q in range(len(counts)):
                value, slope = table[2 * q * size + k], table[(2 * q + 1) * size + k]
                at = 4 * q * LANES + m
                a += value * fluxes[at + LANES]
                b += value * fluxes[at + 2 * LANES]
                c += slope * fluxes[at + 3 * LANES]
                if len(terms) == 7:
                    c += value * fluxes[at]
            sums[(3 * k + 1) * LANES + m] = a
            sums[(3 * k + 2) * LANES + m] = b
            sums[3 * k * LANES + m] = c
