"""Ends a run at its time limit: a clock that interrupts whatever it does, and what the report says then."""

import ctypes
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from parameterize.progress import Progress, ProgressCallback
from parameterize.spline.body import BodyLike, as_body
from parameterize.time_limit import (
    OutOfTime,
    TimeLimit,
    check_time,
    limited,
    present_limit,
    reserving,
    seconds_left,
)

from ..options.texts import duration
from ..rounding import clock as clock_of
from ..signals import loses_errors
from .pace import end_seconds, pace

TICK = 0.5  # seconds between two looks at the clock
NEEDED = 0.15  # share of a limit that the map leaves for its certificate, the files and the page
MOST_OF_PAGE = 0.4  # share of a limit that figures and page of a solution may keep for themselves
LATE, LATEST = 0.05, 5.0  # share of a limit, and seconds, after which no figure is begun
WISHED = 0.45  # share of a limit that a certified map leaves, for the solve, where one follows


@contextmanager
def clock(time_limit: float | str | None) -> Iterator[None]:
    """Let the block know its time limit, and interrupt it by OutOfTime where it does not end by itself.

    Raises InputError for what is no time.
    """
    seconds = None if time_limit is None else duration("--time-limit", time_limit)
    with limited(seconds) as limit:
        if limit is None:
            yield
        elif threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer"):
            with _ticking_signals(limit):
                yield
        else:
            with _ticking_thread(limit, threading.get_ident()):
                yield


def checked(progress: ProgressCallback | None) -> ProgressCallback:
    """Return a callback of progress that looks at the clock, too."""

    def step(now: Progress) -> None:
        check_time()
        if progress is not None:
            progress(now)

    return step


@contextmanager
def for_later(is_solved: bool) -> Iterator[None]:
    """Let the block, which makes the map, leave the time that later stages need.

    is_solved: whether a problem is solved on the map.
    """
    limit = present_limit()
    whole = 0.0 if limit is None else limit.seconds
    with reserving(NEEDED * whole, WISHED * whole if is_solved else 0.0):
        yield


@contextmanager
def for_page(body: BodyLike) -> Iterator[None]:
    """Let the block, which solves, leave the time that figures and page of a solution on a body take."""
    limit = present_limit()
    needed = 0.0
    if limit is not None:
        needed = min(MOST_OF_PAGE * limit.seconds, pace() * end_seconds(0, len(as_body(body)), is_solved=True))
    with reserving(needed):
        yield


def demand_time(refine: int, seconds: float) -> None:
    """Raise OutOfTime where less than so many seconds are left, which a level is known to take."""
    if 0.0 < (left := seconds_left()) < seconds:
        taken = f"refine {refine} takes about {clock_of(seconds)}, and {clock_of(left)} are left"
        raise OutOfTime(f"{present_limit()}: {taken}")
    check_time()


def is_late() -> bool:
    """Return whether the time limit is so long over that figures are left out, so that the page comes at last."""
    limit = present_limit()
    return limit is not None and time.monotonic() > limit.end + max(LATE * limit.seconds, LATEST)


def stopped_in_words() -> str:
    """Return what the time limit of this run has cut short, for the report; "" for nothing."""
    limit = present_limit()
    return f"the {limit} has ended {'; '.join(limit.cut)}" if limit is not None and limit.cut else ""


def _is_due(limit: TimeLimit, frame: FrameType | None) -> bool:
    """Return whether the stage that runs is to be interrupted now; then it is told only once."""
    if limit.is_closing or limit.is_told or limit.left > 0.0 or loses_errors(frame):
        return False
    limit.is_told = True
    return True


@contextmanager
def _ticking_signals(limit: TimeLimit) -> Iterator[None]:
    """Look at the clock by signals, which interrupt the main thread wherever it is."""

    def tick(_: int, frame: FrameType | None) -> None:
        if _is_due(limit, frame):
            raise OutOfTime(f"{limit} is reached")

    before = signal.signal(signal.SIGALRM, tick)
    signal.setitimer(signal.ITIMER_REAL, TICK, TICK)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _ticking_thread(limit: TimeLimit, thread: int) -> Iterator[None]:
    """Look at the clock in a thread, which interrupts the other one at its next line of Python."""
    ended = threading.Event()

    def look() -> None:
        while not ended.wait(TICK):
            if _is_due(limit, sys._current_frames().get(thread)):
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(OutOfTime))

    threading.Thread(target=look, daemon=True).start()
    try:
        yield
    finally:
        ended.set()
