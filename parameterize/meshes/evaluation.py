"""Evaluates single elements at points: places, derivatives, and det J without any rounding."""

from fractions import Fraction
from itertools import product
from math import comb

import numpy as np

from ..arrays import Array
from .bezier import exact_slopes, net_matrix, scales, simplex_bernstein, simplex_indices, slope_matrices, slope_shapes
from .kinds import ElementKind, Triple


def point_at(kind: ElementKind, nodes: Array, place: Array) -> Array:
    """Return the point (3,) of an element (nodes, 3) at parameters (3,)."""
    u, v, w = (Fraction(x) for x in place.tolist())
    if kind.shape == "tetra":
        degree = kind.degrees[0]
        weights = [simplex_bernstein(degree, row, [u, v, w]) for row in simplex_indices(degree)]
    else:
        rows = [
            [comb(p, i) * x**i * (1 - x) ** (p - i) for i in range(p + 1)]
            for x, p in zip((u, v, w), kind.degrees, strict=True)
        ]
        weights = [a * b * c for a, b, c in product(*rows)]
    net = np.array([[float(x) for x in row] for row in net_matrix(kind)])
    return np.asarray(np.array([float(x) for x in weights]) @ (net @ nodes))


def jacobian_at(kind: ElementKind, nodes: Array, place: Array) -> Array:
    """Return J[a, b] = dF_a / du_b (3, 3) of one element (nodes, 3) at parameters (3,)."""
    at = [Fraction(x) for x in place.tolist()]
    columns = [
        np.array([float(w) for w in _bernstein_values(kind, shape, at)]) @ matrix @ nodes
        for matrix, shape in zip(slope_matrices(kind), slope_shapes(kind), strict=True)
    ]
    return np.stack(columns, axis=1)


def exact_determinant(kind: ElementKind, nodes: Array, point: Array) -> Fraction:
    """Return det J of one element (nodes, 3) at parameters (3,), without any rounding."""
    at = [Fraction(x) for x in point.tolist()]
    places = [[Fraction(x) for x in row] for row in nodes.tolist()]
    columns = []
    for matrix, shape in zip(exact_slopes(kind), slope_shapes(kind), strict=True):
        weights = _bernstein_values(kind, shape, at)
        shares = [
            sum((w * row[n] for w, row in zip(weights, matrix, strict=True) if w and row[n]), Fraction(0))
            for n in range(len(places))
        ]
        columns.append(
            [sum((s * row[c] for s, row in zip(shares, places, strict=True)), Fraction(0)) for c in range(3)]
        )
    (a, b, c), (d, e, f), (g, h, i) = columns
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def _bernstein_values(kind: ElementKind, shape: Triple, point: list[Fraction]) -> list[Fraction]:
    """Return the values of the Bernstein polynomials of a derivative at a point, in the rows' order."""
    values = []
    factors = scales(kind, shape)
    for index in product(*map(range, shape)):
        value = Fraction(int(factors[index]))
        if kind.shape == "tetra":
            rest = shape[0] - 1 - sum(index)
            value = value * (1 - sum(point)) ** rest if rest >= 0 else Fraction(0)
        for x, i, n in zip(point, index, shape, strict=True):
            value *= x**i if kind.shape == "tetra" else x**i * (1 - x) ** (n - 1 - i)
        values.append(value)
    return values
