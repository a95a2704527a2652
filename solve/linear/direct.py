"""Factorizes the matrix of a system: entries from products with few vectors, and a sparse factor."""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array

from parameterize.arrays import Array, IntArray

from ..discretization.grouped import BodyMatrix
from ..discretization.operator import MatrixFree
from ..discretization.unknowns import Unknowns
from .cholesky import cholesky, touching
from .dissection import Dissection

# Shares of its diagonal that are added to a matrix, tried in turn: rounding may make a positive matrix indefinite. The
# first one is least: of a foil, 1 : 20 000, it is 1000 times the lowest eigenvalue.
SHARES = tuple(10.0**k for k in range(-15, -7))
PER_UNKNOWN = 20  # unknowns whose part of a factor takes the time of one iteration: on cubes it is 15 to 80


def sparse(unknowns: Unknowns, matrix: BodyMatrix, components: int) -> csc_array:
    """Return the matrix (N, N) of a body, for N = components times the unknowns of each."""
    return _of_parts(unknowns, matrix.parts, components) + _of_faces(unknowns, matrix, components)


def _of_faces(unknowns: Unknowns, matrix: BodyMatrix, components: int) -> csc_array:
    """Return the part (N, N) of the terms on faces that are in no patch's matrix."""
    size = components * int(np.prod(unknowns.shape))
    numbers = unknowns.spread(np.arange(1.0, size + 1.0).reshape(components, *unknowns.shape))  # zero where fixed
    places = matrix.layout.joined(numbers).flat.astype(np.int64) - 1
    found = matrix.matrix_of(matrix.shared_faces)
    faces = sum((coupling.matrix for coupling in matrix.couplings), found).tocoo()
    row, column = places[faces.row], places[faces.col]
    free = (row >= 0) & (column >= 0)
    return coo_array((faces.data[free], (row[free], column[free])), shape=(size, size)).tocsc()


def _of_parts(unknowns: Unknowns, matrices: Sequence[MatrixFree], components: int) -> csc_array:
    """Return the matrix (N, N) of a body from those of its patches.

    Functions of which no third function sees two are multiplied in one product, so that a patch of degree p takes
    (2 p + 1)^3 products a component, however fine it is.
    """
    count = int(np.prod(unknowns.shape))
    numbers = np.arange(1.0, count + 1.0).reshape(1, *unknowns.shape)  # spread as coefficients: zero where fixed
    rows, columns, values = [], [], []
    for matrix, spread in zip(matrices, unknowns.spread(numbers), strict=True):
        places = spread[0].astype(np.int64).ravel() - 1
        for colour in product(*(range(2 * degree + 1) for degree in matrix.space.degrees)):
            sees, seen = _pairs(matrix, colour)
            here = tuple(slice(a, None, 2 * p + 1) for a, p in zip(colour, matrix.space.degrees, strict=True))
            free = (places[sees] >= 0) & (places[seen] >= 0)
            sees, seen = sees[free], places[seen[free]]
            for component in range(components):
                unit = np.zeros((components, *matrix.space.shape))
                unit[component][here] = 1.0
                found = matrix.apply(unit).reshape(components, -1)[:, sees]
                rows.append((np.arange(components)[:, None] * count + places[sees]).ravel())
                columns.append(np.tile(component * count + seen, components))
                values.append(found.ravel())
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return coo_array(entries, shape=(components * count,) * 2).tocsc()


def _pairs(matrix: MatrixFree, colour: Sequence[int]) -> tuple[IntArray, IntArray]:
    """Return the numbers of the functions that see one of a colour, and of the one that each sees."""
    sees, seen = [], []
    for first, degree, n in zip(colour, matrix.space.degrees, matrix.space.shape, strict=True):
        lowest = np.arange(n) - degree
        own = lowest + (first - lowest) % (2 * degree + 1)
        sees.append(np.flatnonzero((own >= 0) & (own < n)))
        seen.append(own[sees[-1]])
    one, other = (np.ravel_multi_index(np.ix_(*each), matrix.space.shape).ravel() for each in (sees, seen))
    return one, other


def price_of(unknowns: Unknowns, matrices: Sequence[MatrixFree], components: int) -> float:
    """Return how many iterations of conjugate gradients take the time of a factor; one takes that of two products."""
    made = components * max(int(np.prod([2 * p + 1 for p in matrix.space.degrees])) for matrix in matrices)
    return made / 2 + components * int(np.prod(unknowns.shape)) / PER_UNKNOWN


def factorized(matrix: csc_array, points: Array, least: float = 0.0) -> Callable[[Array], Array] | None:
    """Return the function that solves with a symmetric positive matrix (N, N) for columns (N, m).

    points: (n, 3), where N = c n: unknown i + k n, of component k, belongs to point i; near points are neighbours.
    least: the least share of the diagonal that is added. None is returned for a matrix that is not positive even with
    the largest of SHARES.
    """
    tree = Dissection.of(touching(matrix, len(points)), points)
    shifted = ((matrix + diags_array(share * matrix.diagonal())).tocsc() for share in SHARES if share >= least)
    return next(filter(None, (cholesky(one, tree) for one in shifted)), None)
