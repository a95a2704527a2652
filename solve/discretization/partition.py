"""Divides the patches of a body among processes by recursive bisection along the longest side."""

import numpy as np

from parameterize.arrays import Array, IntArray


def partition(centres: Array, weights: Array, count: int) -> IntArray:
    """Return the process (patches,) of each patch, from 0 to `count` - 1; each has at least one of them.

    centres: (patches, 3), of which there are `count` or more. weights: (patches,), by which the processes have about
    equal shares. The patches are cut in two along the longest side of their centres, and each half again (Berger and
    Bokhari, IEEE Transactions on Computers 36, 1987).
    """
    found = np.zeros(len(centres), dtype=np.int64)
    if count == 1:
        return found
    order = np.argsort(centres[:, np.ptp(centres, axis=0).argmax()], kind="stable")
    half, sums = count // 2, np.cumsum(weights[order])
    nearest = 1 + int(np.abs(sums - sums[-1] * half / count).argmin())
    cut = min(max(nearest, half), len(order) - (count - half))
    for part, first, processes in ((order[:cut], 0, half), (order[cut:], half, count - half)):
        found[part] = first + partition(centres[part], weights[part], processes)
    return found
