"""Bernstein form on single spans: extraction from B-splines, products, halving.

A polynomial of degree q on a span is sum_i c_i B_i(t), t in [0, 1], with B_i(t) = C(q, i) t^i (1 - t)^(q - i).
Its values lie between the least and the largest c_i, and c_0 and c_q are its values at the two ends.
Farouki, "The Bernstein polynomial basis: a centennial retrospective", CAGD 29 (2012).
"""

from math import comb

import numba
import numpy as np

from ..arrays import Array, IntArray


def extraction(knots: Array, degree: int) -> tuple[IntArray, Array]:
    """Return the weights that turn a spline's coefficients into the Bernstein coefficients of every span.

    Returns `first` (n_spans,), the first B-spline coefficient that a span needs, and `weights`
    (n_spans, degree + 1, degree + 1): row j yields the j-th Bernstein coefficient, the blossom at degree - j times
    the left and j times the right end (Ramshaw, "Blossoms are polar forms", 1989). No weight is negative, and none is
    formed by cancellation: each carries at most 5 * degree rounding errors.
    `degree` may be 0, and the knots then need not be open.
    """
    spans = np.flatnonzero(np.diff(knots) > 0.0)  # (s,)
    spans = spans[(spans >= degree) & (spans < len(knots) - degree - 1)]
    weights = np.zeros((len(spans), degree + 1, degree + 1))
    for j in range(degree + 1):
        partial = np.broadcast_to(np.eye(degree + 1), (len(spans), degree + 1, degree + 1))  # (s, point, coefficient)
        for r in range(1, degree + 1):
            t = knots[spans + 1] if r <= j else knots[spans]
            window = spans[:, None] + np.arange(r - degree, 1)  # (s, degree + 1 - r)
            left, right = knots[window], knots[window + degree + 1 - r]
            width = right - left
            upper = ((t[:, None] - left) / width)[..., None]
            lower = ((right - t[:, None]) / width)[..., None]
            partial = lower * partial[:, :-1] + upper * partial[:, 1:]
        weights[:, j] = partial[:, 0]
    return spans - degree, weights


def binomials(degree: int) -> Array:
    """Return C(degree, i), shape (degree + 1,)."""
    return np.array([float(comb(degree, i)) for i in range(degree + 1)])


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def windows(net: Array, patches: IntArray, first: IntArray, sizes: tuple[int, int, int]) -> Array:
    """Return the control points of patches (k,) in (patches, c, N_0, N_1, N_2) from first (3, k) on: (c, *sizes, k)."""
    found = np.empty((net.shape[1], sizes[0], sizes[1], sizes[2], first.shape[1]))
    for c in range(net.shape[1]):
        for i in range(sizes[0]):
            for j in range(sizes[1]):
                for m in range(sizes[2]):
                    row = found[c, i, j, m]
                    for k in range(row.size):
                        row[k] = net[patches[k], c, first[0, k] + i, first[1, k] + j, first[2, k] + m]
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def along_second_axis(matrices: Array, field: Array) -> Array:
    """Apply matrices (n, n, k), one for each place of the last axis, along the second axis of a field (a, n, b, k)."""
    applied = np.zeros_like(field)
    for a in range(field.shape[0]):
        for x in range(field.shape[1]):
            for b in range(field.shape[2]):
                total = applied[a, x, b]
                for i in range(field.shape[1]):
                    factor, value = matrices[x, i], field[a, i, b]
                    for k in range(total.size):
                        total[k] += factor[k] * value[k]
    return applied


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_products(a: Array, b: Array, sign: float, out: Array) -> None:
    """Add sign * a * b to out: trivariate polynomials in scaled Bernstein form, one for each place of the last axis.

    Scaled: the coefficients carry their binomials C(q, i). Then a product is a convolution (Farouki 2012, section 4.4):
    a (n_0, n_1, n_2, k), b (m_0, m_1, m_2, k), out (n_0 + m_0 - 1, n_1 + m_1 - 1, n_2 + m_2 - 1, k).
    """
    for i0 in range(a.shape[0]):
        for j0 in range(b.shape[0]):
            for i1 in range(a.shape[1]):
                for j1 in range(b.shape[1]):
                    for i2 in range(a.shape[2]):
                        for j2 in range(b.shape[2]):
                            left, right = a[i0, i1, i2], b[j0, j1, j2]
                            total = out[i0 + j0, i1 + j1, i2 + j2]
                            for k in range(total.size):
                                total[k] += sign * left[k] * right[k]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def dot_products(a: Array, b: Array) -> Array:
    """Return the inner products of vectors (3, n_0, n_1, n_2, k) and (3, m_0, m_1, m_2, k) in scaled Bernstein form."""
    sizes = a.shape[1] + b.shape[1] - 1, a.shape[2] + b.shape[2] - 1, a.shape[3] + b.shape[3] - 1
    products = np.zeros((*sizes, a.shape[4]))
    for i0 in range(a.shape[1]):
        for j0 in range(b.shape[1]):
            for i1 in range(a.shape[2]):
                for j1 in range(b.shape[2]):
                    for i2 in range(a.shape[3]):
                        a0, a1, a2 = a[0, i0, i1, i2], a[1, i0, i1, i2], a[2, i0, i1, i2]
                        for j2 in range(b.shape[3]):
                            b0, b1, b2 = b[0, j0, j1, j2], b[1, j0, j1, j2], b[2, j0, j1, j2]
                            total = products[i0 + j0, i1 + j1, i2 + j2]
                            for k in range(total.size):
                                total[k] += a0[k] * b0[k] + a1[k] * b1[k] + a2[k] * b2[k]
    return products


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cross_products(a: Array, b: Array) -> Array:
    """Return the cross products of vectors (3, n_0, n_1, n_2, k) and (3, m_0, m_1, m_2, k) in scaled Bernstein form."""
    sizes = a.shape[1] + b.shape[1] - 1, a.shape[2] + b.shape[2] - 1, a.shape[3] + b.shape[3] - 1
    products = np.zeros((3, *sizes, a.shape[4]))
    for c in range(3):
        p, q = (c + 1) % 3, (c + 2) % 3
        for i0 in range(a.shape[1]):
            for j0 in range(b.shape[1]):
                for i1 in range(a.shape[2]):
                    for j1 in range(b.shape[2]):
                        for i2 in range(a.shape[3]):
                            a_p, a_q = a[p, i0, i1, i2], a[q, i0, i1, i2]
                            for j2 in range(b.shape[3]):
                                b_p, b_q = b[p, j0, j1, j2], b[q, j0, j1, j2]
                                total = products[c, i0 + j0, i1 + j1, i2 + j2]
                                for k in range(total.size):
                                    total[k] += a_p[k] * b_q[k] - a_q[k] * b_p[k]
    return products


def halving(degree: int) -> Array:
    """Return de Casteljau's halving as two matrices (2, degree + 1, degree + 1), for the left and the right half.

    The entries are exact for degree <= 53, each row sums to 1.
    """
    left = np.array([[comb(i, j) / 2.0**i for j in range(degree + 1)] for i in range(degree + 1)])
    return np.stack([left, left[::-1, ::-1]])


def elevation(degree: int, raised: int) -> Array:
    """Return the matrix (raised + 1, degree + 1) that raises the degree; rows sum to 1 (Farouki 2012, section 3.3)."""
    rows, columns = range(raised + 1), range(degree + 1)
    return np.array(
        [
            [comb(degree, j) * comb(raised - degree, i - j) / comb(raised, i) if i >= j else 0.0 for j in columns]
            for i in rows
        ]
    )


def split(coefficients: Array) -> Array:
    """Return trivariate polynomials on the eighths of their span: (k, d_0, d_1, d_2) -> (k, 2, 2, 2, d_0, d_1, d_2)."""
    pieces = coefficients
    for axis in range(3):  # the half's number goes in front of the axis that it halves
        position = 1 + 2 * axis
        moved = np.tensordot(pieces, halving(coefficients.shape[1 + axis] - 1), axes=(position, 2))
        pieces = np.moveaxis(moved, (-2, -1), (position, position + 1))
    return np.ascontiguousarray(pieces.transpose(0, 1, 3, 5, 2, 4, 6))
