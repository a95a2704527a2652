"""Pieces of work shared out among threads; what comes out does not depend on their number."""

import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Piece = TypeVar("Piece")
Result = TypeVar("Result")


def default_threads() -> int:
    """Return NUMBA_NUM_THREADS or OMP_NUM_THREADS where set, else the cores this process may use."""
    for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"):
        text = os.environ.get(name, "")
        if text.isdigit() and int(text) > 0:
            return int(text)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_parallel(task: Callable[[Piece], Result], pieces: Sequence[Piece], threads: int | None = None) -> list[Result]:
    """Run the task on every piece and return the results in their order; the first exception raised comes through."""
    threads = threads or default_threads()
    if threads == 1 or len(pieces) < 2:
        return [task(piece) for piece in pieces]
    return list(_pool(threads, os.getpid()).map(task, pieces))


@functools.cache
def _pool(threads: int, _process: int) -> ThreadPoolExecutor:
    """Return the threads of this process: a copy that fork makes of it has none of them."""
    return ThreadPoolExecutor(threads)
