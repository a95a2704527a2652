"""Multiplies small patches, LANES of them at a time: innermost loops run over the patches, whose tables are the same.

A plane of a patch of one span has some sixteen points, too few for the loops of `kernels`, which run along rows of
points. Arrays of this module end with a dimension of LANES; a processor takes all lanes in one instruction or two.
"""

import numpy as np

from parameterize.arrays import Array, IntArray

from .group_kernels import of_kind
from .kernels import Functions, Tables, compiled, multiply_planes

LANES = 8
MOST = 64  # points of a plane up to which lanes are faster than rows of points
FEWEST = 3  # patches with the same tables from which on lanes are worth it


@compiled
def multiply_small(
    coefficients: Array,
    places: IntArray,
    patches: IntArray,
    points: IntArray,
    kinds: IntArray,
    tables: Tables,
    factors: Array,
    result: Array,
) -> None:
    """Add the products of scalar operators of some patches to a result; arguments as in `multiply_patches`."""
    begin = 0
    while begin < len(patches):
        end, kind = begin + 1, kinds[patches[begin]]
        while end < len(patches) and end < begin + LANES and kinds[patches[end]] == kind:
            end += 1
        own, block = of_kind(tables, kind), patches[begin:end]
        if end - begin < FEWEST:
            for i in block:
                for c in range(coefficients.shape[1]):
                    multiply_planes(coefficients[places[i], c], points, own, factors[i], result[places[i], c])
        else:
            multiply_block(coefficients, places, block, points, own, factors, result)
        begin = end


@compiled
def multiply_block(
    coefficients: Array,
    places: IntArray,
    block: IntArray,
    points: IntArray,
    tables: Tables,
    factors: Array,
    result: Array,
) -> None:
    """Add the products of up to LANES patches with the same tables to a result."""
    (first_u, u, functions_u), (first_v, v, functions_v), (first_w, w, functions_w) = tables
    _, count, n_u, n_v, n_w = coefficients.shape
    q_w, q_v = factors.shape[3:]
    rows, width = n_v * n_w, q_v * LANES
    source, total = np.zeros((n_u, rows * LANES)), np.empty((n_u, rows * LANES))
    planes, lines = np.empty((2, n_v, n_w * LANES)), np.empty((3, q_v, n_w * LANES))
    turned, fields, slopes = np.empty((n_w, 3 * width)), np.empty((q_w, 3 * width)), np.empty((q_w, width))
    local = np.zeros((factors.shape[2], q_w, width))
    for c in range(count):
        for lane in range(len(block)):
            own = coefficients[places[block[lane]], c].reshape(n_u, rows)
            for i in range(n_u):
                for m in range(rows):
                    source[i, m * LANES + lane] = own[i, m]
        total[:] = 0.0
        for point in points:
            here = first_u[point : point + 1]
            for d in range(2):
                combine(here, u[d, point : point + 1], functions_u, source, planes[d].reshape(1, -1))
            for place in range(3):  # value, d/du, d/dv
                combine(first_v, v[place // 2], functions_v, planes[place % 2], lines[place])
            turn_lines(lines, turned, False)
            combine(first_w, w[0], functions_w, turned, fields)
            combine(first_w, w[1], functions_w, turned, slopes)
            gather_factors(factors, block, point, local)
            apply_factors(local, fields, slopes)
            turned[:] = 0.0
            distribute(first_w, w[0], functions_w, fields, turned)
            distribute(first_w, w[1], functions_w, slopes, turned)
            turn_lines(lines, turned, True)
            planes[:] = 0.0
            for place in range(3):
                distribute(first_v, v[place // 2], functions_v, lines[place], planes[place % 2])
            for d in range(2):
                distribute(here, u[d, point : point + 1], functions_u, planes[d].reshape(1, -1), total)
        for lane in range(len(block)):
            own = result[places[block[lane]], c].reshape(n_u, rows)
            for i in range(n_u):
                for m in range(rows):
                    own[i, m] += total[i, m * LANES + lane]


@compiled
def turn_lines(lines: Array, turned: Array, back: bool) -> None:
    """Write lines (3, q_v, n_w lanes) to turned (n_w, 3 q_v lanes) or, `back`, turned to lines."""
    for n in range(len(turned)):
        row = turned[n].reshape(lines.shape[0], lines.shape[1], LANES)
        for place in range(lines.shape[0]):
            for q in range(lines.shape[1]):
                line = lines[place, q]
                for lane in range(LANES):
                    if back:
                        line[n * LANES + lane] = row[place, q, lane]
                    else:
                        row[place, q, lane] = line[n * LANES + lane]


@compiled
def combine(first: IntArray, basis: Array, functions: Functions, source: Array, result: Array) -> None:
    """Write the values (q, m) of splines with coefficients (n, m), as `contract` does, for rows of some lanes."""
    for q in range(result.shape[0]):
        at, row = first[q], result[q]
        for m in range(len(row)):
            total = 0.0
            for j in range(len(functions)):
                total += basis[q, j] * source[at + j, m]
            row[m] = total


@compiled
def distribute(first: IntArray, basis: Array, functions: Functions, source: Array, result: Array) -> None:
    """Apply the transpose of `combine`: add source (q, m) to result (n, m)."""
    for q in range(source.shape[0]):
        row = source[q]
        for j in range(len(functions)):
            target, value = result[first[q] + j], basis[q, j]
            for m in range(len(row)):
                target[m] += value * row[m]


@compiled
def gather_factors(factors: Array, block: IntArray, point: int, local: Array) -> None:
    """Write the factors (6 or 7, q_w, q_v) of a plane of each patch to its lane of local (6 or 7, q_w, q_v lanes)."""
    for lane in range(len(block)):
        own = factors[block[lane], point]
        for entry in range(own.shape[0]):
            for j in range(own.shape[1]):
                for i in range(own.shape[2]):
                    local[entry, j, i * LANES + lane] = own[entry, j, i]


@compiled
def apply_factors(factors: Array, fields: Array, slopes: Array) -> None:
    """Multiply gradients and values by factors (6 or 7, q_w, m); values become zero where there are six factors.

    fields: (q_w, 3 m), the values, d/du and d/dv. slopes: (q_w, m), d/dw.
    """
    for j in range(len(slopes)):
        rows, along = fields[j].reshape(3, -1), slopes[j]
        for m in range(len(along)):
            a, b, c = rows[1, m], rows[2, m], along[m]
            rows[1, m] = factors[0, j, m] * a + factors[1, j, m] * b + factors[2, j, m] * c
            rows[2, m] = factors[1, j, m] * a + factors[3, j, m] * b + factors[4, j, m] * c
            along[m] = factors[2, j, m] * a + factors[4, j, m] * b + factors[5, j, m] * c
        if len(factors) == 7:
            for m in range(len(along)):
                rows[0, m] *= factors[6, j, m]
        else:
            rows[0, :] = 0.0
