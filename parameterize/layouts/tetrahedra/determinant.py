"""Bounds det J of cubic tetrahedra by its Bernstein coefficients, which are cheap to have and bound it from below."""

from functools import cache
from itertools import product
from math import factorial, prod

import numpy as np

from ...arrays import Array, IntArray
from .mesh import ORDER, THIRDS, volumes_of

_CHUNK = 4096  # tetrahedra at a time


@cache
def indices(degree: int) -> IntArray:
    """Return the multi-indices (n, 4) of a degree, the exponents of the barycentric coordinates."""
    return np.array([row for row in product(range(degree + 1), repeat=4) if sum(row) == degree])


@cache
def _multinomials(degree: int) -> Array:
    """Return the factors (n,) of the Bernstein polynomials of a degree."""
    rows = indices(degree).tolist()
    return np.array([float(factorial(degree) // prod(map(factorial, row))) for row in rows])


@cache
def _places(degree: int) -> dict[tuple[int, ...], int]:
    """Return the place of each multi-index of a degree."""
    return {tuple(row): place for place, row in enumerate(indices(degree).tolist())}


@cache
def bernstein_of_nodes() -> Array:
    """Return the matrix (20, 20) that makes Bernstein coefficients of values at the cubic nodes."""
    return np.asarray(np.linalg.inv(bernstein_values(THIRDS / ORDER, ORDER)), dtype=np.float64)


def bernstein_values(weights: Array, degree: int) -> Array:
    """Return the values (m, n) of the Bernstein polynomials at barycentric coordinates (m, 4)."""
    return np.asarray(np.prod(weights[:, None] ** indices(degree), axis=2) * _multinomials(degree))


@cache
def _differences() -> Array:
    """Return the matrix (3, 10, 20) from values at the nodes to the Bernstein coefficients of three derivatives.

    They are those along the edges from vertex 0 to vertices 1, 2 and 3.
    """
    rows = np.zeros((3, len(indices(ORDER - 1)), len(indices(ORDER))))
    places, units = _places(ORDER), np.eye(4, dtype=np.int64)
    for k in range(3):
        for row, index in enumerate(indices(ORDER - 1)):
            rows[k, row, places[tuple((index + units[k + 1]).tolist())]] += ORDER
            rows[k, row, places[tuple((index + units[0]).tolist())]] -= ORDER
    return np.asarray(rows @ bernstein_of_nodes())


@cache
def _sums(first: int, second: int) -> IntArray:
    """Return the places (n, m) of the sums of the multi-indices of two degrees."""
    places = _places(first + second)
    return np.array([[places[tuple((a + b).tolist())] for b in indices(second)] for a in indices(first)])


def determinant_coefficients(nodes: Array) -> Array:
    """Return the Bernstein coefficients (t, 84) of det J of cubic tetrahedra (t, 20, 3): 1 for the straight ones.

    J is taken against the straight tetrahedron of the same vertices.
    """
    parts = [_coefficients(nodes[first : first + _CHUNK]) for first in range(0, len(nodes), _CHUNK)]
    return np.concatenate([np.empty((0, len(indices(6)))), *parts])


def _coefficients(nodes: Array) -> Array:
    """Return the coefficients of some tetrahedra."""
    slopes = np.einsum("kin,tnx->kixt", _differences(), nodes, optimize=True)
    slopes *= _multinomials(ORDER - 1)[:, None, None]
    cross, table = np.zeros((len(indices(4)), 3, len(nodes))), _sums(2, 2)
    for i, j in np.ndindex(table.shape):
        cross[table[i, j]] += np.cross(slopes[1, i], slopes[2, j], axis=0)
    found, table = np.zeros((len(indices(6)), len(nodes))), _sums(2, 4)
    for i, j in np.ndindex(table.shape):
        found[table[i, j]] += np.einsum("xt,xt->t", slopes[0, i], cross[j])
    return np.asarray((found / _multinomials(6)[:, None]).T / (6.0 * volumes_of(nodes[:, :4]))[:, None])
