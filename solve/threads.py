"""Threads over layers of elements, with results that do not depend on their number."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import ThreadpoolController

from parameterize.arrays import IntArray

Piece = TypeVar("Piece")
LAYERS = 4  # of elements in a piece of work, where the degree allows so few


def default_threads() -> int:
    """NUMBA_NUM_THREADS or OMP_NUM_THREADS where set, else the cores this process may use."""
    for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"):
        text = os.environ.get(name, "")
        if text.isdigit() and int(text) > 0:
            return int(text)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def checked_threads(threads: int | None) -> int:
    """The number of threads asked for, or the default. Raises ValueError for fewer than one."""
    if threads is not None and threads < 1:
        raise ValueError(f"threads must be at least 1, got {threads}; leave it out for {default_threads()}")
    return threads or default_threads()


def colours(first: IntArray, degree: int) -> tuple[list[IntArray], list[IntArray]]:
    """Consecutive points in pieces, every other piece in the first list, the rest in the second.

    first: (q,) number of the first function that is not zero at each point. A piece covers at least as many layers of
    elements as the degree, so that no two of one list share a basis function: they may add to the same array at the
    same time, and each sum has one order.
    """
    layers = np.unique(first, return_inverse=True)[1]
    pieces = np.split(np.arange(len(first)), np.flatnonzero(np.diff(layers // max(degree, LAYERS))) + 1)
    return pieces[0::2], pieces[1::2]


def in_parallel(task: Callable[[Piece], Any], pieces: Sequence[Piece], threads: int) -> None:
    """Run the task on every piece; the first exception raised comes through."""
    if threads == 1 or len(pieces) < 2:
        for piece in pieces:
            task(piece)
    else:
        list(_pool(threads).map(task, pieces))


@functools.cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="solve")


@functools.cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def one_blas_thread() -> Any:
    """Context in which each matrix product stays in the thread that calls it: the threads are ours to share out."""
    return _controller().limit(limits=1, user_api="blas")
