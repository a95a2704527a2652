"""Runs the compiled kernels of one patch over the patches of a group: arrays have a leading dimension of patches."""

import numpy as np

from parameterize.arrays import Array, IntArray

from .kernels import Tables, compiled, evaluate_plane, multiply_planes, spread_plane, turn


@compiled
def of_patch(tables: Tables, i: int) -> Tables:
    """Return the tables of one patch from tables with a leading dimension of patches."""
    (first_u, u, functions_u), (first_v, v, functions_v), (first_w, w, functions_w) = tables
    return (first_u[i], u[i], functions_u), (first_v[i], v[i], functions_v), (first_w[i], w[i], functions_w)


@compiled
def multiply_patches(
    coefficients: Array, patches: IntArray, piece: IntArray, tables: Tables, factors: Array, result: Array
) -> None:
    """Add the products of some scalar operators and coefficients (patches, c, n_u, n_v, n_w) of a group to a result.

    patches: (k,), the place of each operator's coefficients. piece: the numbers of some of the k operators. tables:
    those of all operators, with a leading dimension k. factors: (k, q_u, 6 or 7, q_w, q_v).
    """
    points = np.arange(factors.shape[1])
    for i in piece:
        source, total, own = coefficients[patches[i]], result[patches[i]], of_patch(tables, i)
        for c in range(len(source)):
            multiply_planes(source[c], points, own, factors[i], total[c])


@compiled
def multiply_laws(
    coefficients: Array, patches: IntArray, piece: IntArray, tables: Tables, rows: Array, laws: Array, result: Array
) -> None:
    """Add the products of some constant laws and coefficients (patches, c, n_u, n_v, n_w) of a group to a result.

    Arguments as in `multiply_patches`. rows: (k, q_u, 3, 3, q_w, q_v), those of `plane_rows`. laws: (k, c, 3, c, 3),
    the matrix from a gradient to its flux.
    """
    count, plane = coefficients.shape[1], rows.shape[4:]
    fields = np.empty((count, 4, *plane))
    gradient, flux = np.empty((count, 3, *plane)), np.empty((count, 3, *plane))
    for i in piece:
        source, total, own = coefficients[patches[i]], result[patches[i]], of_patch(tables, i)
        for point in range(rows.shape[1]):
            for c in range(count):
                evaluate_plane(source[c], point, own, fields[c])
            turn(rows[i, point], fields[:, 1:], gradient, False)
            apply_law(laws[i], gradient, flux)
            turn(rows[i, point], flux, fields[:, 1:], True)
            for c in range(count):
                spread_plane(fields[c], point, own, False, total[c])


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
