"""What a user sees while a command runs: one progress line and the log, both on stderr."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.text import Text

from ..workflow import LOGGERS

if TYPE_CHECKING:
    from parameterize.progress import Progress

PLAIN_INTERVAL = 10.0  # seconds between lines where the output is not a terminal


class ProgressLine:
    """Shows the latest state of a training run: in place on a terminal, else a line now and then and at each stage."""

    def __init__(self, console: Console, live: Live | None) -> None:
        self._console, self._live = console, live
        self._stage, self._printed = "", -PLAIN_INTERVAL

    def __call__(self, progress: Progress) -> None:
        """Take the state after one step."""
        if self._live is not None:
            self._live.update(Text(describe(progress)))
            return
        now = time.monotonic()
        if progress.stage != self._stage or now - self._printed >= PLAIN_INTERVAL:
            self._console.print(Text(describe(progress)), soft_wrap=True)
            self._stage, self._printed = progress.stage, now


def describe(progress: Progress) -> str:
    """Stage, step, loss, folded samples and time left, as one line; how long the spline takes shows when it is on."""
    minutes, seconds = divmod(round(max(0.0, progress.seconds_left)), 60)
    left = f"{minutes}:{seconds:02d}"
    return (
        f"{progress.stage:8s} step {progress.step}/{progress.steps}  loss {progress.loss:.3e}  "
        f"folded {progress.folded}  " + (f"at most {left}" if progress.stage == "spline" else f"left {left} + spline")
    )


class _ConsoleHandler(logging.Handler):
    """Log records as single lines above the progress line; the same warning once."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self._console = console
        self._warned: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        text = record.getMessage()
        if record.levelno >= logging.WARNING:
            if text in self._warned:
                return
            self._warned.add(text)
            text = f"{record.levelname.lower()}: {text}"
        self._console.print(Text(text), soft_wrap=True)


@contextmanager
def progress_line(quiet: bool) -> Iterator[ProgressLine | None]:
    """Show progress and the packages' log on stderr while the block runs; warnings alone where `quiet`."""
    console = Console(file=sys.stderr, highlight=False)
    handler = _ConsoleHandler(console)
    loggers = [logging.getLogger(name) for name in LOGGERS]
    before = [(logger.level, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(logging.WARNING if quiet else logging.INFO)
        logger.propagate = False
    try:
        if quiet:
            yield None
        elif console.is_terminal:
            with Live(console=console, transient=True, refresh_per_second=4) as live:
                yield ProgressLine(console, live)
        else:
            yield ProgressLine(console, None)
    finally:
        for logger, (level, propagate) in zip(loggers, before, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(level)
            logger.propagate = propagate
