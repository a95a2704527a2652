"""Writes arrays inside compiled functions."""

import numba

from .arrays import Array, IntArray


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def write(source: Array | IntArray, result: Array | IntArray) -> None:
    """Write an array to one of the same shape; both lie in memory row by row.

    With numba's own assignment the words of its error are compiled, too: a second or two for each kernel.
    """
    values, places = source.reshape(-1), result.reshape(-1)
    for i in range(len(places)):
        places[i] = values[i]
