"""Runs the compiled kernels of one patch over the patches of a stack: arrays have a leading dimension of patches.

Tables have a leading dimension of kinds, of which `kinds` says the number for each patch.
"""

import numpy as np

from parameterize.arrays import Array, IntArray

from .kernels import (
    Tables,
    compiled,
    evaluate_plane,
    multiply_planes,
    plane_rows,
    spread,
    spread_plane,
    tensor_factors,
    transpose,
    turn,
)


@compiled
def of_kind(tables: Tables, kind: int) -> Tables:
    """Return the tables of one kind."""
    (first_u, u, functions_u), (first_v, v, functions_v), (first_w, w, functions_w) = tables
    return (
        (first_u[kind], u[kind], functions_u),
        (first_v[kind], v[kind], functions_v),
        (first_w[kind], w[kind], functions_w),
    )


@compiled
def evaluate_splines(
    coefficients: Array, which: IntArray, kinds: IntArray, point: int, tables: Tables, result: Array
) -> None:
    """Write the splines of m patches on the plane of a point of u to result (m, c, 4, q_w, q_v).

    coefficients: (k, c, n_u, n_v, n_w). which: (m,), the places of the patches among these. kinds: (m,).
    """
    for m in range(len(which)):
        splines, own = coefficients[which[m]], of_kind(tables, kinds[m])
        for c in range(len(splines)):
            evaluate_plane(splines[c], point, own, result[m, c])


@compiled
def spread_splines(
    fields: Array, which: IntArray, kinds: IntArray, point: int, tables: Tables, has_value: bool, result: Array
) -> None:
    """Apply the transpose of `evaluate_splines`: add fields (m, c, 4, q_w, q_v) to result (k, c, n_u, n_v, n_w).

    The first of the four entries is added only if `has_value`.
    """
    for m in range(len(which)):
        total, own = result[which[m]], of_kind(tables, kinds[m])
        for c in range(len(total)):
            spread_plane(fields[m, c], point, own, has_value, total[c])


@compiled
def turn_fields(rows: Array, source: Array, result: Array, back: bool) -> None:
    """Apply `turn` to rows (m, 3, 3, q_w, q_v) and fields (m, c, 3, q_w, q_v) of m patches."""
    for m in range(len(rows)):
        turn(rows[m], source[m], result[m], back)


@compiled
def rows_of_maps(fields: Array, weights: Array, kinds: IntArray, rows: Array, measure: Array) -> None:
    """Apply `plane_rows` to the maps (m, 3 or 4, 4, q_w, q_v) of patches of the given kinds (m,)."""
    for m in range(len(fields)):
        plane_rows(fields[m], weights[kinds[m]], rows[m], measure[m])


@compiled
def tensors_of_rows(rows: Array, kappa: Array, patches: IntArray, point: int, factors: Array) -> None:
    """Apply `tensor_factors` to rows (m, 3, 3, q_w, q_v) and kappa (m, 6, q_w, q_v) of some patches.

    factors: (k, q_u, 6 or 7, q_w, q_v), of all patches.
    """
    for m in range(len(rows)):
        tensor_factors(rows[m], kappa[m], factors[patches[m], point])


@compiled
def add_integrals(
    fields: Array,
    patches: IntArray,
    kinds: IntArray,
    q: int,
    tables: Tables,
    slopes: tuple[int, int, int],
    result: Array,
) -> None:
    """Add the integrals of `stack.PatchStack.add_integrals` to an array of all patches (k, c, n_u, n_v, n_w).

    fields: (m, c, q_w, q_v), of the patches (m,). kinds: (k,), of all patches. slopes: for each direction, the number
    of the table's values that are taken, 0 for the functions themselves.
    """
    d_u, d_v, d_w = slopes
    n_v, n_w = result.shape[3:]
    lines = np.empty((fields.shape[3], n_w))
    for m in range(len(fields)):
        patch = patches[m]
        (first_u, u, functions_u), (first_v, v, functions_v), (first_w, w, functions_w) = of_kind(tables, kinds[patch])
        for c in range(fields.shape[1]):
            turned, plane = np.zeros((n_w, fields.shape[3])), np.zeros((n_v, n_w))
            spread(first_w, w[d_w], functions_w, fields[m, c], turned)
            transpose(turned, lines)
            spread(first_v, v[d_v], functions_v, lines, plane)
            for j in range(len(functions_u)):
                layer, value = result[patch, c, first_u[q] + j], u[d_u, q, j]
                for a in range(n_v):
                    for b in range(n_w):
                        layer[a, b] += value * plane[a, b]


@compiled
def multiply_patches(
    coefficients: Array,
    places: IntArray,
    patches: IntArray,
    points: IntArray,
    kinds: IntArray,
    tables: Tables,
    factors: Array,
    result: Array,
) -> None:
    """Add the part of some patches and points of u to products of scalar operators and coefficients of a group.

    coefficients, result: (g, c, n_u, n_v, n_w), of a group. places: (k,), the place in the group of each patch of a
    stack. patches: the numbers of some of the k patches. factors: (k, q_u, 6 or 7, q_w, q_v).
    """
    for i in patches:
        source, total, own = coefficients[places[i]], result[places[i]], of_kind(tables, kinds[i])
        for c in range(len(source)):
            multiply_planes(source[c], points, own, factors[i], total[c])


@compiled
def multiply_laws(
    coefficients: Array,
    places: IntArray,
    patches: IntArray,
    points: IntArray,
    kinds: IntArray,
    tables: Tables,
    rows: Array,
    laws: Array,
    result: Array,
) -> None:
    """Add the part of some patches and points of u to products of constant laws and coefficients of a group.

    Arguments as in `multiply_patches`. rows: (k, q_u, 3, 3, q_w, q_v), those of `plane_rows`. laws: (k, c, 3, c, 3),
    the matrix from a gradient to its flux.
    """
    count, plane = coefficients.shape[1], rows.shape[4:]
    fields = np.empty((count, 4, *plane))
    gradient, flux = np.empty((count, 3, *plane)), np.empty((count, 3, *plane))
    for i in patches:
        source, total, own = coefficients[places[i]], result[places[i]], of_kind(tables, kinds[i])
        for point in points:
            for c in range(count):
                evaluate_plane(source[c], point, own, fields[c])
            turn(rows[i, point], fields[:, 1:], gradient, False)
            apply_law(laws[i], gradient, flux)
            turn(rows[i, point], flux, fields[:, 1:], True)
            for c in range(count):
                spread_plane(fields[c], point, own, False, total[c])


@compiled
def multiply_tangents(
    coefficients: Array,
    places: IntArray,
    patches: IntArray,
    points: IntArray,
    kinds: IntArray,
    tables: Tables,
    factors: Array,
    has_value: bool,
    result: Array,
) -> None:
    """Add the part of some patches and points of u to products of tangents and coefficients of a group.

    Arguments as in `multiply_patches`. factors: (k, q_u, c, 4, c, 4, q_w, q_v), from a value and its gradient to both.
    has_value: whether the products have a value.
    """
    count, plane = coefficients.shape[1], factors.shape[6:]
    fields, found = np.empty((count, 4, *plane)), np.empty((count, 4, *plane))
    for i in patches:
        source, total, own = coefficients[places[i]], result[places[i]], of_kind(tables, kinds[i])
        for point in points:
            for c in range(count):
                evaluate_plane(source[c], point, own, fields[c])
            apply_at_points(factors[i, point], fields, found)
            for c in range(count):
                spread_plane(found[c], point, own, has_value, total[c])


@compiled
def apply_at_points(factors: Array, fields: Array, result: Array) -> None:
    """Write the products of matrices (c, 4, c, 4, q_w, q_v) and fields (c, 4, q_w, q_v) to a result of that shape."""
    count = fields.shape[0] * fields.shape[1]
    source, total, matrix = fields.reshape(count, -1), result.reshape(count, -1), factors.reshape(count, count, -1)
    for i in range(count):
        total[i] = 0.0
        for j in range(count):
            for m in range(total.shape[1]):
                total[i, m] += matrix[i, j, m] * source[j, m]


@compiled
def apply_law(law: Array, gradient: Array, flux: Array) -> None:
    """Write a law's flux (c, 3, q_w, q_v) of a gradient of that shape, with its matrix (c, 3, c, 3)."""
    count = law.shape[0] * law.shape[1]
    matrix = law.reshape(count, count)
    source, result = gradient.reshape(count, -1), flux.reshape(count, -1)
    for i in range(count):
        result[i] = 0.0
        for j in range(count):
            entry = matrix[i, j]
            if entry != 0.0:
                for m in range(result.shape[1]):
                    result[i, m] += entry * source[j, m]
