"""Which axis-parallel boxes overlap: sort along one axis and sweep."""

from __future__ import annotations

import numba
import numpy as np

from ..arrays import Array, IntArray


def overlapping_boxes(low: Array, high: Array) -> IntArray:
    """All pairs (k, 2) of closed boxes low, high (n, 3) that share a point; i != j, each pair once."""
    if len(low) == 0:
        return np.empty((0, 2), dtype=np.int64)
    spread = (high.max(axis=0) - low.min(axis=0)) / np.maximum((high - low).mean(axis=0), np.finfo(np.float64).tiny)
    first = int(spread.argmax())  # the axis along which the boxes are shortest, compared with all of them
    axes = [first, (first + 1) % 3, (first + 2) % 3]
    order = np.argsort(low[:, first], kind="stable")
    sorted_low, sorted_high = (np.ascontiguousarray(side[order][:, axes]) for side in (low, high))
    found = np.empty((_sweep(sorted_low, sorted_high, np.empty((0, 2), dtype=np.int64)), 2), dtype=np.int64)
    _sweep(sorted_low, sorted_high, found)
    return order[found]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _sweep(low: Array, high: Array, out: IntArray) -> int:
    """Write overlapping pairs into `out` as far as it reaches; return how many there are.

    `low` is sorted by its first column.
    """
    count = 0
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, 0] > high[i, 0]:
                break
            apart = low[j, 1] > high[i, 1] or low[i, 1] > high[j, 1] or low[j, 2] > high[i, 2] or low[i, 2] > high[j, 2]
            if not apart:
                if count < len(out):
                    out[count, 0], out[count, 1] = i, j
                count += 1
    return count
