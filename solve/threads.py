"""Threads over layers of elements, with results that do not depend on their number."""

import functools
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from parameterize.arrays import IntArray

SHARES = 4  # of the pieces of one colour a thread: some wait less where others take longer
LAYERS = 4  # of elements in a piece of work, where the degree allows so few


def colours(first: IntArray, degree: int, threads: int) -> tuple[list[IntArray], list[IntArray]]:
    """Return consecutive points in pieces, every other piece in the first list, the rest in the second.

    first: (q,) number of the first function that is not zero at each point. A piece covers at least as many layers of
    elements as the degree, so that no two of one list share a basis function: they may add to the same array at the
    same time, and each sum has one order. Pieces of one list are joined to some shares a thread, to one for a single.
    """
    layers = np.unique(first, return_inverse=True)[1]
    pieces = np.split(np.arange(len(first)), np.flatnonzero(np.diff(layers // max(degree, LAYERS))) + 1)
    return _joined(pieces[0::2], threads), _joined(pieces[1::2], threads)


def _joined(pieces: list[IntArray], threads: int) -> list[IntArray]:
    shares = min(len(pieces), SHARES * threads if threads > 1 else 1)
    return [np.concatenate(pieces[i::shares]) for i in range(shares)]


_controller = functools.cache(ThreadpoolController)  # looks for the libraries at its first use, when they are loaded


def one_blas_thread() -> Any:
    """Context in which each matrix product stays in the thread that calls it: the threads are ours to share out."""
    return _controller().limit(limits=1, user_api="blas")
