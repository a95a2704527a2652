"""Adds the matrices of trilinear functions, cell by cell, from what a law stores at the points."""

import numpy as np

from parameterize.arrays import Array, IntArray

from .kernels import Tables, compiled

CORNERS = 8  # of a cell, with a function each


@compiled
def add_entries(
    factors: Array, kinds: IntArray, points: IntArray, tables: Tables, where: IntArray, entries: Array
) -> None:
    """Add the entries of m patches, by layers of cells with some points of u, to entries (n, c, c).

    factors: (m, q, c, 4, c, 4, q_w, q_v), with weights, from a function and its parametric derivatives to both. kinds:
    (m,). points: (q,), those of whole layers of cells. where: (m, 3, 3, 3, n_u, n_v, n_w), the place of the entry of a
    node and of the node beside it whose numbers have these remainders by 3; -1 for none.
    """
    first_u, first_v, first_w = tables[0][0], tables[1][0], tables[2][0]
    count = factors.shape[2]
    local = np.empty((CORNERS, CORNERS, count, count))
    for m in range(len(kinds)):
        kind, own = kinds[m], factors[m]
        begin_u = 0
        while begin_u < len(points):
            i = first_u[kind, points[begin_u]]
            end_u = begin_u + 1
            while end_u < len(points) and first_u[kind, points[end_u]] == i:
                end_u += 1
            begin_v = 0
            while begin_v < first_v.shape[1]:
                end_v = end_of(first_v[kind], begin_v)
                begin_w = 0
                while begin_w < first_w.shape[1]:
                    end_w = end_of(first_w[kind], begin_w)
                    local[:] = 0.0
                    ranges = (begin_u, end_u), (begin_v, end_v), (begin_w, end_w)
                    integrate_cell(own, points, kind, tables, ranges, local)
                    node = i, first_v[kind, begin_v], first_w[kind, begin_w]
                    spread_cell(local, node, where[m], entries)
                    begin_w = end_w
                begin_v = end_v
            begin_u = end_u


@compiled
def end_of(first: IntArray, begin: int) -> int:
    """Return the end of the points from `begin` on with the same first function."""
    end = begin + 1
    while end < len(first) and first[end] == first[begin]:
        end += 1
    return end


@compiled
def integrate_cell(
    factors: Array,
    points: IntArray,
    kind: int,
    tables: Tables,
    ranges: tuple[tuple[int, int], tuple[int, int], tuple[int, int]],
    local: Array,
) -> None:
    """Add the products of the eight functions of a cell at its points to local (8, 8, c, c); see `add_entries`."""
    u, v, w = tables[0][1][kind], tables[1][1][kind], tables[2][1][kind]
    count = local.shape[2]
    basis, flux = np.empty((CORNERS, 4)), np.empty(4)
    for q_u in range(ranges[0][0], ranges[0][1]):
        for q_v in range(ranges[1][0], ranges[1][1]):
            for q_w in range(ranges[2][0], ranges[2][1]):
                for f in range(CORNERS):
                    x, y, z = u[:, points[q_u], f // 4], v[:, q_v, f // 2 % 2], w[:, q_w, f % 2]
                    basis[f, 0], basis[f, 1] = x[0] * y[0] * z[0], x[1] * y[0] * z[0]
                    basis[f, 2], basis[f, 3] = x[0] * y[1] * z[0], x[0] * y[0] * z[1]
                for c in range(count):
                    for d in range(count):
                        for f in range(CORNERS):
                            for a in range(4):
                                flux[a] = 0.0
                                for b in range(4):
                                    flux[a] += factors[q_u, c, a, d, b, q_w, q_v] * basis[f, b]
                            for g in range(CORNERS):
                                here = basis[g]
                                local[g, f, c, d] += (
                                    here[0] * flux[0] + here[1] * flux[1] + here[2] * flux[2] + here[3] * flux[3]
                                )


@compiled
def spread_cell(local: Array, node: tuple[int, int, int], where: IntArray, entries: Array) -> None:
    """Add the products local (8, 8, c, c) of a cell, whose first corner is a node, to entries (n, c, c)."""
    i, j, k = node
    for g in range(CORNERS):
        for f in range(CORNERS):
            a, b, c = i + f // 4, j + f // 2 % 2, k + f % 2
            place = where[a % 3, b % 3, c % 3, i + g // 4, j + g // 2 % 2, k + g % 2]
            if place >= 0:
                entries[place] += local[g, f]
