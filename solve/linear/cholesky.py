"""Factorizes a sparse symmetric positive matrix by fronts: dense parts, from the leaves of a dissection to its root.

The multifrontal method (Duff, Reid, ACM Trans. Math. Softw. 9, 1983; Liu, SIAM Rev. 34, 1992). The front of a region
holds its own unknowns and those that come later and touch it; it is factorized densely, and what it does to the later
ones goes to the front of its parent.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf
from scipy.sparse import csc_array, csr_array, tril

from parameterize.arrays import Array, IntArray

from ..discretization.kernels import compiled
from .dissection import Dissection


@dataclass(frozen=True, eq=False)
class Cholesky:
    """Hold the factor L of a matrix with its unknowns in another order; column after column of each front.

    order: (N,). ends: (k,), the place after the last own unknown of each front. starts: (k + 1,), of the later unknowns
    of each front in `later`. entries: those of each front, own x own and later x own.
    """

    order: IntArray
    ends: IntArray
    starts: IntArray
    later: IntArray
    entries: Array

    def __call__(self, right: Array) -> Array:
        """Return the solution for columns (N, m), or for a vector (N,)."""
        solved = np.ascontiguousarray(right[self.order].T)
        for column in np.atleast_2d(solved):
            _solve(self.ends, self.starts, self.later, self.entries, column)
        found = np.empty_like(right)
        found[self.order] = solved.T
        return found


def touching(matrix: csc_array, n: int) -> csr_array:
    """Return which of n points share an entry of a matrix (c n, c n); unknown i + k n belongs to point i."""
    pairs = matrix.tocoo()
    return csr_array((np.ones(pairs.nnz, dtype=bool), (pairs.row % n, pairs.col % n)), shape=(n, n))


def cholesky(matrix: csc_array, tree: Dissection) -> Cholesky | None:
    """Return the factor of a symmetric matrix (c n, c n), None where it is not positive.

    tree: of the n points, where unknown i + k n, of component k, belongs to point i.
    """
    n = len(tree.order)
    c = matrix.shape[0] // n
    later = [_of_components(nodes, c) for nodes in tree.later]
    order = (tree.order[:, None] + n * np.arange(c)).ravel()
    lower = tril(matrix[order][:, order], format="csc")
    starts = np.cumsum([0, *map(len, later)])
    factor = Cholesky(order, c * tree.ends, starts, np.concatenate(later), _room(c * tree.ends, starts))
    return factor if _factorize(factor, lower, tree.parents) else None


def _of_components(nodes: IntArray, c: int) -> IntArray:
    """Return the places of the unknowns at nodes, in the order of the factor."""
    return (c * nodes[:, None] + np.arange(c)).ravel()


def _room(ends: IntArray, starts: IntArray) -> Array:
    """Return zeros for the columns of all fronts."""
    own = np.diff(ends, prepend=0)
    return np.zeros(int(own @ (own + np.diff(starts))))


def _factorize(factor: Cholesky, lower: csc_array, parents: IntArray) -> bool:
    """Write the entries of a factor, of a matrix whose lower half is given in its order; return whether it exists."""
    local, at = np.empty(len(factor.order), dtype=np.int64), 0
    columns, rows = lower.indptr.astype(np.int64), lower.indices.astype(np.int64)
    waiting: list[list[tuple[IntArray, Array]]] = [[] for _ in parents]
    bounds = zip(pairwise([0, *factor.ends]), pairwise(factor.starts), parents, waiting, strict=True)
    for (begin, end), (first, last), parent, children in bounds:
        own, later = end - begin, factor.later[first:last]
        local[begin:end], local[later] = np.arange(own), np.arange(own, own + len(later))
        head = factor.entries[at : at + own**2].reshape(own, own).T
        at += own * (own + len(later))
        below = factor.entries[at - own * len(later) : at].reshape(own, len(later)).T
        rest = np.zeros((len(later),) * 2, order="F")
        _place(columns[begin : end + 1], rows, lower.data, local, head, below)
        for places, values in children:
            _add(local[places], values, head, below, rest)
        children.clear()
        _, failed = dpotrf(head, lower=True, overwrite_a=True)
        if failed:
            return False
        if len(later):
            dtrsm(1.0, head, below, side=1, lower=1, trans_a=1, overwrite_b=True)
            waiting[parent].append((later, dsyrk(-1.0, below, 1.0, rest, lower=1, overwrite_c=True)))
    return True


@compiled
def _place(starts: IntArray, rows: IntArray, values: Array, local: IntArray, head: Array, below: Array) -> None:
    """Write columns of the lower half of a matrix to a front."""
    own = len(head)
    for j in range(own):
        for i in range(starts[j], starts[j + 1]):
            row = local[rows[i]]
            if row < own:
                head[row, j] = values[i]
            else:
                below[row - own, j] = values[i]


@compiled
def _add(places: IntArray, values: Array, head: Array, below: Array, rest: Array) -> None:
    """Add the lower half of values (m, m), whose places in the front grow, to a front."""
    own = len(head)
    for j in range(len(places)):
        column = places[j]
        for i in range(j, len(places)):
            row = places[i]
            if row < own:
                head[row, column] += values[i, j]
            elif column < own:
                below[row - own, column] += values[i, j]
            else:
                rest[row - own, column - own] += values[i, j]


@compiled
def _solve(ends: IntArray, starts: IntArray, later: IntArray, entries: Array, x: Array) -> None:
    """Overwrite y (N,) by the solution of L L^T x = y."""
    at = begin = 0
    for k in range(len(ends)):
        own, rows = x[begin : ends[k]], later[starts[k] : starts[k + 1]]
        head, below = _columns(entries, at, len(own), len(rows))
        moved = np.zeros(len(rows))
        for j in range(len(own)):
            own[j] /= head[j, j]
            _add_multiple(-own[j], head[j, j + 1 :], own[j + 1 :])
            _add_multiple(own[j], below[j], moved)
        for i in range(len(rows)):
            x[rows[i]] -= moved[i]
        at, begin = at + head.size + below.size, ends[k]
    for k in range(len(ends) - 1, -1, -1):
        own, rows = x[ends[k - 1] if k else 0 : ends[k]], later[starts[k] : starts[k + 1]]
        at -= len(own) * (len(own) + len(rows))
        head, below = _columns(entries, at, len(own), len(rows))
        found = x[rows]
        for j in range(len(own) - 1, -1, -1):
            own[j] -= _dot(below[j], found) + _dot(head[j, j + 1 :], own[j + 1 :])
            own[j] /= head[j, j]


@compiled
def _columns(entries: Array, at: int, own: int, later: int) -> tuple[Array, Array]:
    """Return the columns of a front as rows (own, own) and (own, later)."""
    end = at + own * own
    return entries[at:end].reshape(own, own), entries[end : end + own * later].reshape(own, later)


@compiled
def _add_multiple(factor: float, column: Array, result: Array) -> None:
    for i in range(len(column)):
        result[i] += factor * column[i]


@compiled
def _dot(one: Array, other: Array) -> float:
    total = 0.0
    for i in range(len(one)):
        total += one[i] * other[i]
    return total
