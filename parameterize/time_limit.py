"""Holds the time that a run may take: stages ask how much of it is left, and end early with what they have."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field


class OutOfTime(KeyboardInterrupt):  # noqa: N818 - as KeyboardInterrupt: what catches one keeps a checkpoint
    """Say that the time limit of a run is reached: an interruption by the clock."""


@dataclass
class TimeLimit:
    """Hold the end of a run's time.

    seconds: all of it. end: when it is over, on the clock of `time.monotonic`. reserve: seconds that later stages need.
    wish: seconds that later stages would use. is_closing: whether the block that runs now writes what is done, and may
    take longer. is_told: whether the present stage was interrupted. cut: what ended early for it, in words.
    """

    seconds: float
    end: float
    reserve: float = 0.0
    wish: float = 0.0
    is_closing: bool = False
    is_told: bool = False
    cut: list[str] = field(default_factory=list)

    @property
    def left(self) -> float:
        """Return the seconds that the present stage may take."""
        return self.end - self.reserve - time.monotonic()

    def __str__(self) -> str:
        return f"time limit of {self.seconds:g} s"


_LIMIT: ContextVar[TimeLimit | None] = ContextVar("time limit", default=None)


def present_limit() -> TimeLimit | None:
    """Return the time limit of the present run; None where it may take any time."""
    return _LIMIT.get()


def seconds_left() -> float:
    """Return the seconds that the present stage may take; infinity without a limit."""
    limit = _LIMIT.get()
    return math.inf if limit is None else limit.left


def seconds_to_spare() -> float:
    """Return the seconds that a stage may take for what is only better, such as a polish; infinity without a limit."""
    limit = _LIMIT.get()
    return math.inf if limit is None else limit.end - max(limit.reserve, limit.wish) - time.monotonic()


def check_time() -> None:
    """Raise OutOfTime where the time of the present stage is over; call it between steps, as often as you like."""
    limit = _LIMIT.get()
    if limit is not None and not limit.is_closing and seconds_left() <= 0.0:
        limit.is_told = True
        raise OutOfTime(f"{limit} is reached")


def cut_short(what: str) -> None:
    """Note that a stage has ended early for the time limit, for the report."""
    limit = _LIMIT.get()
    if limit is not None and what not in limit.cut:
        limit.cut.append(what)


@contextmanager
def limited(seconds: float | None) -> Iterator[TimeLimit | None]:
    """Let the block know that it may take so many seconds; None for any time."""
    limit = None if seconds is None else TimeLimit(seconds, time.monotonic() + seconds)
    token = _LIMIT.set(limit)
    try:
        yield limit
    finally:
        _LIMIT.reset(token)


@contextmanager
def reserving(needed: float, wished: float = 0.0) -> Iterator[None]:
    """Let the block end so many seconds before the limit, which stages after it need, or would use if they can."""
    if (limit := _LIMIT.get()) is None:
        yield
        return
    before = limit.reserve, limit.wish
    limit.reserve, limit.wish, limit.is_told = needed, wished, False
    try:
        yield
    finally:
        limit.reserve, limit.wish = before
        limit.is_told = False


@contextmanager
def closing() -> Iterator[None]:
    """Let the block, which writes what is done, go on for a while after the limit."""
    if (limit := _LIMIT.get()) is None:
        yield
        return
    before, limit.is_closing = limit.is_closing, True
    try:
        yield
    finally:
        limit.is_closing = before
