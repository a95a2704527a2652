"""Runs what others watch: the log goes where they read it, steps are told, and the end is a state with its reason."""

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

LOGGERS = ("iga_nn", "parameterize", "solve")  # a run's log goes to these and those below them
INTERVAL = 0.4  # seconds, at least, between two steps that are told
SHARE = 0.05  # of a run's time, at most, that telling takes


@dataclass(frozen=True)
class Ended:
    """Say how a run ended. line: why there is no report."""

    state: Literal["done", "refused", "failed", "stopped"]
    line: str = ""
    report: Report | None = None


def ended(run: Callable[[], Outcome | None], less_memory: str) -> Ended:
    """Run in a worker process and return how it ended; nothing is raised.

    The traceback of an internal error is printed here, since only this process knows it. less_memory: the remedy where
    the memory does not suffice.
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


def told(tell: Callable[[Progress], None], is_stopped: Callable[[], bool]) -> ProgressCallback:
    """Return what tells some of the steps of a training, and interrupts it at the next step once it is stopped."""
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


@contextmanager
def logged(handler: logging.Handler, level: int = logging.NOTSET) -> Iterator[None]:
    """Give the log of what the block runs to a handler alone; NOTSET leaves the level as it is."""
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
