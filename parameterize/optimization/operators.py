"""Linear operators on control points: sums made of pieces of work, and sparse rows.

Control points are held as (3, n_u, n_v, n_w), component first. Pieces of work run on all threads; their results are
added in their order, so that the number of threads changes no bit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numba
import numpy as np

from ..arrays import Floats, IntArray
from ..threads import in_parallel

_ROWS = 4096  # in a piece of work


@dataclass(frozen=True, eq=False)
class PiecewiseOperator:
    """x -> add(what every piece makes of x, x); `add` takes these in the order of the pieces."""

    pieces: list[Callable[[Floats], Any]]
    add: Callable[[list[Any], Floats], Floats]

    def __call__(self, x: Floats) -> Floats:
        """Apply the operator to control points: (3, n_u, n_v, n_w) -> the same shape."""
        return self.add(in_parallel(lambda piece: piece(x), self.pieces), x)


def pieces(count: int) -> list[slice]:
    """Return which of `count` rows belong to each piece of work; there is at least one."""
    return [slice(begin, begin + _ROWS) for begin in range(0, max(count, 1), _ROWS)]


def weighted_sum(terms: list[tuple[float, PiecewiseOperator]]) -> PiecewiseOperator:
    """Return the sum of operators times their weights: one call runs all their pieces."""

    def add(found: list[Any], x: Floats) -> Floats:
        total, begin = np.zeros_like(x), 0
        for weight, operator in terms:
            end = begin + len(operator.pieces)
            total += weight * operator.add(found[begin:end], x)
            begin = end
        return total

    return PiecewiseOperator([piece for _, operator in terms for piece in operator.pieces], add)


@dataclass(frozen=True, eq=False)
class ControlRows:
    """Rows that apply to control points, and their transpose: N of k entries each, their columns and values (N, k)."""

    columns: IntArray
    values: Floats

    def in_single(self) -> "ControlRows":
        """Return the same rows in single precision."""
        return ControlRows(self.columns, self.values.astype(np.float32))

    def __call__(self, control: Floats) -> Floats:
        """Return the values (N, 3) at control points (3, n_u, n_v, n_w)."""
        field = control.reshape(3, -1)
        found = in_parallel(lambda rows: _times(self.columns[rows], self.values[rows], field), pieces(len(self.values)))
        return np.concatenate(found)

    def adjoint(self, dual: Floats, like: Floats) -> Floats:
        """Apply the transpose to (N, 3); the result has the shape of the control points `like`."""
        flat, count = np.ascontiguousarray(dual), like.size // 3

        def part(rows: slice) -> Floats:
            return np.asarray(_spread(self.columns[rows], self.values[rows], flat[rows], count))

        return _summed(in_parallel(part, pieces(len(self.values))), like)

    def squared(self, metric: Floats) -> PiecewiseOperator:
        """Return the rows, then matrices (N, 3, 3) on what they yield, then the transpose of the rows."""

        def product(rows: slice, field: Floats) -> Floats:
            return np.asarray(_squared(self.columns[rows], self.values[rows], metric[rows], field.reshape(3, -1)))

        return PiecewiseOperator([partial(product, rows) for rows in pieces(len(self.values))], _summed)


def _summed(parts: list[Floats], like: Floats) -> Floats:
    """Add parts (3, n), in their order, to control points of the shape of `like`."""
    return sum(parts[1:], start=parts[0]).reshape(like.shape)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _times(columns: IntArray, values: Floats, field: Floats) -> Floats:
    """Multiply rows (m, k) by a field (3, n): (m, 3)."""
    out = np.zeros((len(columns), 3), field.dtype)
    for row in range(len(columns)):
        for entry in range(columns.shape[1]):
            column, value = columns[row, entry], values[row, entry]
            for c in range(3):
                out[row, c] += value * field[c, column]
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _spread(columns: IntArray, values: Floats, dual: Floats, count: int) -> Floats:
    """Multiply the transpose of rows (m, k) by (m, 3): (3, count)."""
    out = np.zeros((3, count), dual.dtype)
    for row in range(len(columns)):
        for entry in range(columns.shape[1]):
            column, value = columns[row, entry], values[row, entry]
            for c in range(3):
                out[c, column] += value * dual[row, c]
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _squared(columns: IntArray, values: Floats, metric: Floats, field: Floats) -> Floats:
    """Multiply the transpose of rows (m, k) by metrics (m, 3, 3) times the rows times a field (3, n): (3, n)."""
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
