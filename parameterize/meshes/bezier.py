"""Makes Bernstein coefficients of the nodes of elements, and of the derivatives of their maps, by exact matrices.

The entries are fractions, rounded once where they become floating-point numbers.
"""

from fractions import Fraction
from functools import cache
from itertools import product
from math import comb, factorial, prod

import numpy as np

from ..arrays import Array, IntArray
from .kinds import ElementKind, Triple

Matrix = list[list[Fraction]]


@cache
def bernstein_of_values(degree: int) -> tuple[tuple[Fraction, ...], ...]:
    """Return the matrix (p + 1, p + 1) from values at i / p to Bernstein coefficients, exact."""
    points = [Fraction(i, degree) for i in range(degree + 1)]
    values = [[comb(degree, j) * t**j * (1 - t) ** (degree - j) for j in range(degree + 1)] for t in points]
    return tuple(map(tuple, inverse(values)))


def inverse(matrix: Matrix) -> Matrix:
    """Return the inverse of a matrix of fractions, by Gauss and Jordan."""
    size = len(matrix)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(size))] for i, row in enumerate(matrix)]
    for k in range(size):
        pivot = next(i for i in range(k, size) if rows[i][k] != 0)
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [value / rows[k][k] if value else value for value in rows[k]]
        for i in range(size):
            if i != k and (factor := rows[i][k]):
                rows[i] = [a - factor * b if b else a for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[size:] for row in rows]


def simplex_indices(degree: int) -> list[Triple]:
    """Return the exponents of the last three barycentric coordinates of the Bernstein polynomials of a degree."""
    rows = range(degree + 1)
    return [(i, j, k) for i, j, k in product(rows, rows, rows) if i + j + k <= degree]


def multinomial(degree: int, index: Triple) -> int:
    """Return the factor of a Bernstein polynomial on the tetrahedron."""
    return factorial(degree) // prod(map(factorial, (*index, degree - sum(index))))


@cache
def net_matrix(kind: ElementKind) -> tuple[tuple[Fraction, ...], ...]:
    """Return the exact matrix from nodes in VTK's order to control points.

    Those of hexahedra (n_u, n_v, n_w) are counted w fastest, those of tetrahedra as in `simplex_indices`.
    """
    if kind.shape == "tetra":
        return _tetra_matrix(kind)
    p, q, r = kind.degrees
    lattice = [tuple(row) for row in kind.lattice.tolist()]
    columns = list(product(range(p + 1), range(q + 1), range(r + 1)))
    if kind.is_bezier:
        places = {row: i for i, row in enumerate(lattice)}
        return tuple(tuple(Fraction(int(places[row] == i)) for i in range(len(lattice))) for row in columns)
    u, v, w = (bernstein_of_values(degree) for degree in kind.degrees)
    full = [
        [u[i][a] * v[j][b] * w[k][c] for a, b, c in (columns if kind.is_serendipity else lattice)]
        for i, j, k in columns
    ]
    if kind.is_serendipity:
        shape = [[_serendipity(node, (a - 1, b - 1, c - 1)) for node in lattice] for a, b, c in columns]
        full = [[sum((row[m] * shape[m][n] for m in range(27)), Fraction(0)) for n in range(20)] for row in full]
    return tuple(map(tuple, full))


def _serendipity(node: tuple[int, ...], point: Triple) -> Fraction:
    """Return the value of a node's shape function at a point of {-1, 0, 1}^3 (Zienkiewicz and Taylor, chapter 4)."""
    signs = [place - 1 for place in node]
    factors = [Fraction(1 + s * x) if s else Fraction(1 - x * x) for s, x in zip(signs, point, strict=True)]
    if 0 in signs:
        return prod(factors, start=Fraction(1, 4))
    return prod(factors, start=Fraction(1, 8)) * (sum(s * x for s, x in zip(signs, point, strict=True)) - 2)


def _tetra_matrix(kind: ElementKind) -> tuple[tuple[Fraction, ...], ...]:
    degree = kind.degrees[0]
    indices = simplex_indices(degree)
    lattice = [(row[0], row[1], row[2]) for row in kind.lattice.tolist()]
    if kind.is_bezier:
        return tuple(tuple(Fraction(int(row == node)) for node in lattice) for row in indices)
    values = [
        [simplex_bernstein(degree, row, [Fraction(x, degree) for x in node]) for row in indices] for node in lattice
    ]
    return tuple(map(tuple, inverse(values)))


def simplex_bernstein(degree: int, index: Triple, point: list[Fraction]) -> Fraction:
    """Return the value of a Bernstein polynomial of the tetrahedron at a point (3,) of it."""
    first = 1 - sum(point)
    powers = (x**k for x, k in zip((*point, first), (*index, degree - sum(index)), strict=True))
    return prod(powers, start=Fraction(multinomial(degree, index)))


def slope_shapes(kind: ElementKind) -> list[Triple]:
    """Return the numbers of coefficients (n_u, n_v, n_w) of the three derivatives.

    Those of a tetrahedron stand in a cube, at their index; the other places of it are zero.
    """
    if kind.shape == "tetra":
        return [kind.degrees] * 3
    p = np.array(kind.degrees)
    return [tuple((p + 1 - np.eye(3, dtype=int)[b]).tolist()) for b in range(3)]


@cache
def exact_slopes(kind: ElementKind) -> tuple[list[list[Fraction]], list[list[Fraction]], list[list[Fraction]]]:
    """Return the exact matrices from nodes to the Bernstein coefficients of the three derivatives, rows as shaped."""
    net = net_matrix(kind)
    found = []
    for b, shape in enumerate(slope_shapes(kind)):
        rows = []
        for index in product(*map(range, shape)):
            degree = kind.degrees[b]
            if kind.shape == "tetra":
                places = _simplex_places(degree)
                raised = tuple(x + int(a == b) for a, x in enumerate(index))
                ends = (places[raised], places[index]) if sum(index) < degree else None
            else:
                step = tuple(x + int(a == b) for a, x in enumerate(index))
                ends = (_flat(step, kind.degrees), _flat(index, kind.degrees))
            zero = [Fraction(0)] * len(net[0])
            rows.append([degree * (x - y) for x, y in zip(net[ends[0]], net[ends[1]], strict=True)] if ends else zero)
        found.append(rows)
    return found[0], found[1], found[2]


@cache
def _simplex_places(degree: int) -> dict[tuple[int, ...], int]:
    return {row: place for place, row in enumerate(simplex_indices(degree))}


def _flat(index: tuple[int, ...], degrees: Triple) -> int:
    return (index[0] * (degrees[1] + 1) + index[1]) * (degrees[2] + 1) + index[2]


def scales(kind: ElementKind, shape: Triple) -> IntArray:
    """Return the factors (n_u, n_v, n_w) of the Bernstein polynomials with so many coefficients; 0 beside a simplex."""
    found = np.zeros(shape, dtype=np.int64)
    for index in product(*map(range, shape)):
        if kind.shape == "tetra":
            degree = shape[0] - 1
            place = (index[0], index[1], index[2])
            found[index] = multinomial(degree, place) if sum(index) <= degree else 0
        else:
            found[index] = prod(comb(n - 1, i) for n, i in zip(shape, index, strict=True))
    return found


@cache
def slope_matrices(kind: ElementKind) -> tuple[Array, Array, Array]:
    """Return the matrices (n_u n_v n_w, nodes) to the three derivatives, each entry rounded once."""
    u, v, w = (np.array([[float(x) for x in row] for row in rows]) for rows in exact_slopes(kind))
    return u, v, w
