"""Runs a job in a worker process: its log, its progress, and its end as a state with a reason."""

from __future__ import annotations

import logging
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ..errors import expected_errors, one_line

if TYPE_CHECKING:
    from parameterize.progress import Progress, ProgressCallback

    from ..report.document import Report
    from .output_folder import Outcome

LOGGERS = ("iga_nn", "parameterize", "solve")  # the roots of a run's loggers
INTERVAL = 0.4  # least seconds between two messages of progress
SHARE = 0.05  # largest share of a run's time for these messages


@dataclass(frozen=True)
class Ended:
    """Hold the end of a run.

    line: the reason where there is no report.
    """

    state: Literal["done", "refused", "failed", "stopped"]
    line: str = ""
    report: Report | None = None


def ended(run: Callable[[], Outcome | None], less_memory: str) -> Ended:
    """Run in a worker process and return the end of the run; no exception is raised.

    The traceback of an internal error is printed in this process, because no other process has it. less_memory: the
    remedy for too little memory.
    """
    try:
        outcome = run()
    except KeyboardInterrupt:
        return Ended("stopped")
    except expected_errors() as error:
        return Ended("refused", one_line(error))
    except Exception as error:
        if isinstance(error, MemoryError) or "can't allocate memory" in str(error):  # the latter is torch's
            return Ended("failed", f"out of memory: {less_memory}")
        traceback.print_exc()
        what = f"{type(error).__name__}: {one_line(error)}"
        return Ended("failed", f"internal error, please report it: {what}; the terminal shows the traceback")
    return Ended("done", report=outcome.report if outcome else None)


def throttled(tell: Callable[[Progress], None], is_stopped: Callable[[], bool]) -> ProgressCallback:
    """Return a throttled callback of progress that interrupts the training at the next step on request."""
    due = 0.0

    def step(progress: Progress) -> None:
        nonlocal due
        if is_stopped():
            raise KeyboardInterrupt
        start = time.monotonic()
        if start >= due:
            tell(progress)
            end = time.monotonic()
            due = end + max(INTERVAL, (end - start) / SHARE)

    return step


class Told(logging.Handler):
    """Give the records of a log to a function."""

    def __init__(self, tell: Callable[[logging.LogRecord], object], level: int = logging.NOTSET) -> None:
        super().__init__(level)
        self._tell = tell

    def emit(self, record: logging.LogRecord) -> None:
        """Give a record to the function."""
        self._tell(record)


@contextmanager
def logged(tell: Callable[[logging.LogRecord], object], level: int = logging.NOTSET) -> Iterator[None]:
    """Give the log of the block to one function only; the level NOTSET leaves the present level unchanged."""
    handler = Told(tell)
    loggers = [logging.getLogger(name) for name in LOGGERS]
    before = [(logger.level, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(level or logger.level)
        logger.propagate = False
    try:
        yield
    finally:
        for logger, (old, propagate) in zip(loggers, before, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(old)
            logger.propagate = propagate
