"""Shows a running command on stderr: the progress of the training, and the log above it."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.table import Column
from rich.text import Text

from ..workflow import logged

if TYPE_CHECKING:
    from parameterize.progress import Progress, ProgressCallback

    from ..batch.run import Progress as BatchProgress
    from ..batch.run import Running
    from ..batch.table import Batch

PLAIN_INTERVAL = 10.0  # seconds between two lines where the output is not a terminal


class PlainLines:
    """Prints a line at each new stage and every ten seconds."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._stage, self._printed = "", -PLAIN_INTERVAL

    def __call__(self, progress: Progress) -> None:
        """Take the state after one step."""
        now = time.monotonic()
        if progress.stage != self._stage or now - self._printed >= PLAIN_INTERVAL:
            line = f"{progress.stage:8s} step {progress.step}/{progress.steps}, {describe(progress)}"
            self._console.print(Text(line), soft_wrap=True)
            self._stage, self._printed = progress.stage, now


def terminal_bar(bar: Bar) -> ProgressCallback:
    """Return what updates one bar: the steps of the stage, the time elapsed in all stages and the time left."""
    task = bar.add_task("", total=None, state="", visible=False)

    def show(now: Progress) -> None:
        state = describe(now)
        bar.update(task, description=now.stage, completed=now.step, total=now.steps, state=state, visible=True)

    return show


def describe(progress: Progress) -> str:
    """Return folds, time left and loss as text; how long the spline fit takes is known only when it runs."""
    minutes, seconds = divmod(round(max(0.0, progress.seconds_left)), 60)
    left = f"{minutes}:{seconds:02d} left"
    folds = f"{progress.folded} fold{'s' * (progress.folded != 1)}"
    when = f"about {left}" if progress.stage == "spline" else f"{left}, then the spline fit"
    return f"{folds}, {when}, loss {progress.loss:.3e}"


class _ConsoleHandler(logging.Handler):
    """Prints log records as single lines above the bar; the same warning once."""

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


def batch_bar(bar: Bar) -> BatchProgress:
    """Return what updates the bar of a batch: surfaces that ended and how far the others are."""
    task = bar.add_task("", total=None, state="", ended="", visible=False)

    def show(batch: Batch, running: Sequence[Running]) -> None:
        ended, total = ended_of(batch), len(batch.rows)
        done = ended + sum(each.share for each in running)
        state = describe_running(running) if ended < total else ""
        bar.update(task, completed=done, total=total, ended=f"{ended}/{total}", state=state, visible=True)

    return show


class PlainBatchLines:
    """Prints a line every ten seconds that says how far a batch is."""

    def __init__(self, console: Console) -> None:
        self._console, self._printed = console, time.monotonic()

    def __call__(self, batch: Batch, running: Sequence[Running]) -> None:
        """Take the state after a change."""
        now = time.monotonic()
        if now - self._printed >= PLAIN_INTERVAL:
            line = f"{ended_of(batch)} of {len(batch.rows)} surfaces; {describe_running(running)}"
            self._console.print(Text(line), soft_wrap=True)
            self._printed = now


def ended_of(batch: Batch) -> int:
    """Return how many surfaces of a batch are not waiting."""
    return len(batch.rows) - batch.counts.get("waiting", 0)


def describe_running(running: Sequence[Running]) -> str:
    """Return the stage and the share done of each surface that is computed, as text."""
    return ", ".join(f"{each.name} {each.stage} {each.share:.0%}" for each in running) or "workers start"


@contextmanager
def shown_progress(quiet: bool) -> Iterator[ProgressCallback | None]:
    """Show the progress and the log of a run on stderr while the block runs; only warnings where `quiet`."""
    with _shown_log(quiet) as console:
        if quiet:
            yield None
        elif console.is_terminal:
            with _bar(console, TextColumn("{task.description:8s}"), BarColumn(10), MofNCompleteColumn()) as bar:
                yield terminal_bar(bar)
        else:
            yield PlainLines(console)


@contextmanager
def shown_batch(quiet: bool) -> Iterator[BatchProgress | None]:
    """Do the same for a batch."""
    with _shown_log(quiet) as console:
        if quiet:
            yield None
        elif console.is_terminal:
            with _bar(console, BarColumn(20), TextColumn("{task.fields[ended]}")) as bar:
                yield batch_bar(bar)
        else:
            yield PlainBatchLines(console)


def _bar(console: Console, *columns: ProgressColumn) -> Bar:
    """Return a bar with these columns, the time elapsed and its state."""
    state = TextColumn("{task.fields[state]}", table_column=Column(ratio=1, no_wrap=True))  # is cut off, not the others
    return Bar(*columns, TimeElapsedColumn(), state, console=console, transient=True, expand=True, refresh_per_second=4)


@contextmanager
def _shown_log(quiet: bool) -> Iterator[Console]:
    """Show the log of the packages on stderr while the block runs; only warnings where `quiet`."""
    console = Console(file=sys.stderr, highlight=False)
    with logged(_ConsoleHandler(console), logging.WARNING if quiet else logging.INFO):
        yield console
