"""Defines linear operators on control points: sums of pieces of work, and sparse rows.

Control points have the shape (3, n), component first. The pieces of work run on all threads; their results
are added in the order of the pieces, so that every number of threads gives the same bits.

A preconditioner needs the 3 x 3 blocks on the diagonal of a symmetric operator, one for each control point. They have
the shape (6, n): the entries of their lower triangles, row by row.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numba
import numpy as np

from ..arrays import Floats, IntArray
from ..threads import in_parallel

_ROWS = 4096  # in a piece of work


@dataclass(frozen=True, eq=False)
class PiecewiseOperator:
    """Map x to the sum of the results of all pieces of work; `add` receives these results in order, and x.

    diagonal: returns the blocks on the diagonal, (6, ...), for control points (3, ...) like the given ones.
    """

    pieces: list[Callable[[Floats], Any]]
    add: Callable[[list[Any], Floats], Floats]
    diagonal: Callable[[Floats], Floats]

    def __call__(self, x: Floats) -> Floats:
        """Return the operator applied to control points (3, n), in the same shape."""
        return self.add(in_parallel(lambda piece: piece(x), self.pieces), x)


def pieces(count: int) -> list[slice]:
    """Return the rows of each piece of work, out of `count` rows; there is at least one piece."""
    return [slice(begin, begin + _ROWS) for begin in range(0, max(count, 1), _ROWS)]


def weighted_sum(terms: list[tuple[float, PiecewiseOperator]]) -> PiecewiseOperator:
    """Return the sum of operators times their weights, as an operator that runs the pieces of all in one call.

    Each operator gives a new array, which may be overwritten.
    """

    def add(found: list[Any], x: Floats) -> Floats:
        total, rest = np.zeros_like(x), iter(found)
        for weight, operator in terms:
            part = operator.add(list(islice(rest, len(operator.pieces))), x)
            part *= weight
            total += part
        return total

    def diagonal(like: Floats) -> Floats:
        return sum((weight * operator.diagonal(like) for weight, operator in terms), start=no_blocks(like))

    return PiecewiseOperator([piece for _, operator in terms for piece in operator.pieces], add, diagonal)


def no_blocks(like: Floats) -> Floats:
    """Return blocks on a diagonal (6, ...) that are zero, for control points (3, ...)."""
    return np.zeros((6, *like.shape[1:]), like.dtype)


@dataclass(frozen=True, eq=False)
class ControlRows:
    """Hold N rows of k entries that act on control points, as columns and values (N, k), with their transpose."""

    columns: IntArray
    values: Floats

    def in_single(self) -> "ControlRows":
        """Return the same rows in single precision."""
        return ControlRows(self.columns, self.values.astype(np.float32))

    def __call__(self, control: Floats) -> Floats:
        """Return the products (N, 3) of the rows and control points (3, n)."""
        field = control.reshape(3, -1)
        found = in_parallel(lambda rows: _times(self.columns[rows], self.values[rows], field), pieces(len(self.values)))
        return np.concatenate(found)

    def adjoint(self, dual: Floats, like: Floats) -> Floats:
        """Return the product of the transposed rows and `dual` (N, 3), in the shape of the control points `like`."""
        flat, count = np.ascontiguousarray(dual), like.size // 3

        def part(rows: slice) -> Floats:
            return np.asarray(_spread(self.columns[rows], self.values[rows], flat[rows], count))

        return _summed(in_parallel(part, pieces(len(self.values))), like)

    def squared(self, metric: Floats) -> PiecewiseOperator:
        """Return the operator R^T M R of the rows R and matrices M (N, 3, 3)."""

        def product(rows: slice, field: Floats) -> Floats:
            return np.asarray(_squared(self.columns[rows], self.values[rows], metric[rows], field.reshape(3, -1)))

        return PiecewiseOperator(
            [partial(product, rows) for rows in pieces(len(self.values))],
            _summed,
            lambda like: self.diagonal(metric, like),
        )

    def diagonal(self, metric: Floats, like: Floats, other: "ControlRows | None" = None) -> Floats:
        """Return the blocks on the diagonal of R^T M S, (6, ...), with other rows S of the same columns, or R itself.

        metric: the matrices M (N, 3, 3), of which the symmetric parts count.
        """
        others = (other or self).values

        def part(rows: slice) -> Floats:
            out = no_blocks(like)
            _add_blocks(self.columns[rows], self.values[rows], others[rows], metric[rows], out.reshape(6, -1))
            return out

        return _summed(in_parallel(part, pieces(len(others))), no_blocks(like))


def _summed(parts: list[Floats], like: Floats) -> Floats:
    """Return the sum of parts, added in their order to the first one, in the shape of `like`."""
    total = parts[0]
    for part in parts[1:]:
        total += part
    return total.reshape(like.shape)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _times(columns: IntArray, values: Floats, field: Floats) -> Floats:
    """Return the product (m, 3) of rows (m, k) and a field (3, n)."""
    out = np.zeros((len(columns), 3), field.dtype)
    for row in range(len(columns)):
        for entry in range(columns.shape[1]):
            column, value = columns[row, entry], values[row, entry]
            for c in range(3):
                out[row, c] += value * field[c, column]
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _spread(columns: IntArray, values: Floats, dual: Floats, count: int) -> Floats:
    """Return the product (3, count) of transposed rows (m, k) and `dual` (m, 3)."""
    out = np.zeros((3, count), dual.dtype)
    for row in range(len(columns)):
        for entry in range(columns.shape[1]):
            column, value = columns[row, entry], values[row, entry]
            for c in range(3):
                out[c, column] += value * dual[row, c]
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _add_blocks(columns: IntArray, values: Floats, others: Floats, metric: Floats, out: Floats) -> None:
    """Add metrics (m, 3, 3) times the products of two values (m, k) to the blocks (6, n) of the columns (m, k)."""
    half = out.dtype.type(0.5)
    for row in range(len(columns)):
        m = metric[row]
        entries = (
            m[0, 0],
            half * (m[1, 0] + m[0, 1]),
            m[1, 1],
            half * (m[2, 0] + m[0, 2]),
            half * (m[2, 1] + m[1, 2]),
            m[2, 2],
        )
        for place in range(columns.shape[1]):
            factor, column = values[row, place] * others[row, place], columns[row, place]
            for e in range(6):
                out[e, column] += factor * entries[e]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _squared(columns: IntArray, values: Floats, metric: Floats, field: Floats) -> Floats:
    """Return the product (3, n) of the transposed rows (m, k), metrics (m, 3, 3), the rows, and a field (3, n)."""
    out, zero = np.zeros_like(field), field.dtype.type(0.0)
    for row in range(len(columns)):
        x, y, z = zero, zero, zero
        for entry in range(columns.shape[1]):
            column, value = columns[row, entry], values[row, entry]
            x += value * field[0, column]
            y += value * field[1, column]
            z += value * field[2, column]
        m = metric[row]
        x, y, z = (
            m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
            m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
            m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
        )
        for entry in range(columns.shape[1]):
            column, value = columns[row, entry], values[row, entry]
            out[0, column] += value * x
            out[1, column] += value * y
            out[2, column] += value * z
    return out
