"""Shares pieces of work out among threads; the result does not depend on the number of threads."""

import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

Piece = TypeVar("Piece")
Result = TypeVar("Result")
_controller = functools.cache(ThreadpoolController)  # looks for the libraries at its first use, when they are loaded


def default_threads() -> int:
    """Return NUMBA_NUM_THREADS or OMP_NUM_THREADS where set, else the cores this process may use."""
    for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"):
        text = os.environ.get(name, "")
        if text.isdigit() and int(text) > 0:
            return int(text)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def one_blas_thread() -> Any:
    """Context in which each matrix product stays in the thread that calls it: the threads are ours to share out.

    A product that is split among threads also rounds differently with their number.
    """
    return _controller().limit(limits=1, user_api="blas")


def in_parallel(task: Callable[[Piece], Result], pieces: Sequence[Piece], threads: int | None = None) -> list[Result]:
    """Run the task on every piece and return the results in their order; the first exception raised comes through.

    The calling thread works, too: it would else wait, and small pieces are done before another thread wakes up.
    """
    threads = min(threads or default_threads(), len(pieces)) if len(pieces) > 1 else 1
    if threads < 2:
        return [task(piece) for piece in pieces]
    results: list[Any] = [None] * len(pieces)
    numbers = iter(range(len(pieces)))  # shared: every thread takes the next one

    def work() -> None:
        for number in numbers:
            results[number] = task(pieces[number])

    pool = _pool(threads, os.getpid())
    helpers = [pool.submit(work) for _ in range(threads - 1)]
    try:
        work()
    finally:
        late = [helper for helper in helpers if not helper.cancel()]  # one that has not begun is not waited for
        wait(late)
    for helper in late:
        helper.result()
    return results


@functools.cache
def _pool(threads: int, _process: int) -> ThreadPoolExecutor:
    """Return the further threads of this process: a copy made by fork has none."""
    return ThreadPoolExecutor(threads - 1)
