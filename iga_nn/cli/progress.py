"""Shows a running command on stderr: the progress of the training, and the log above it."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.table import Column
from rich.text import Text

from ..rounding import clock, rounded
from ..workflow.worker_run import logged

if TYPE_CHECKING:
    from parameterize.progress import Progress, ProgressCallback

    from ..batch.run_batch import Progress as BatchProgress
    from ..batch.run_batch import Running
    from ..batch.table import Batch

PLAIN_INTERVAL = 10.0  # seconds between two lines where the output is not a terminal


Show = Callable[..., None]  # Display.show


class Display:
    """Show the progress of a command: a bar on a terminal, otherwise a line at each new stage and every ten seconds."""

    def __init__(self, console: Console, *columns: ProgressColumn) -> None:
        state = TextColumn("{task.fields[state]}", table_column=Column(ratio=1, no_wrap=True))  # is cut off first
        self.bar = Bar(
            *columns,
            TimeElapsedColumn(),
            state,
            console=console,
            transient=True,
            expand=True,
            refresh_per_second=4,
            disable=not console.is_terminal,
        )
        self._task = self.bar.add_task("", total=None, state="", ended="", visible=False)
        self._stage, self._begun = "", time.monotonic()
        self._printed = self._begun

    def show(self, line: str, stage: str = "", **now: Any) -> None:
        """Show a new state of the command, as a line and as the present task of the bar."""
        self.bar.update(self._task, visible=True, **now)
        if self.bar.disable and (stage != self._stage or time.monotonic() - self._printed >= PLAIN_INTERVAL):
            self._stage, self._printed = stage, time.monotonic()
            self.bar.console.print(Text(f"{line}; {clock(self._printed - self._begun)} passed"), soft_wrap=True)


def tell_run(show: Show, now: Progress) -> None:
    """Show the state of a run: the stage, its steps, folded samples, the time left of a training, and the loss."""
    state, total = describe(now), now.steps if now.seconds_left is not None else None
    steps = f"{now.step}/{total}" if total else str(now.step)  # other stages end once they gain nothing more
    show(
        f"{now.stage:8s} step {steps}, {state}",
        now.stage,
        description=now.stage,
        completed=now.step,
        total=total,
        state=state,
    )


def tell_batch(show: Show, batch: Batch, running: Sequence[Running]) -> None:
    """Show the state of a batch: the number of finished surfaces, and the stage and share of the running surfaces."""
    total = len(batch.rows)
    ended = total - batch.counts.get("waiting", 0)
    state = (
        ", ".join(f"{each.name} {each.stage} {rounded(100.0 * each.share, 0)}%" for each in running) or "workers start"
    )
    done = ended + sum(each.share for each in running)
    bar = {"completed": done, "total": total, "ended": f"{ended}/{total}"}
    show(f"{ended} of {total} surfaces; {state}", state=state if ended < total else "", **bar)


def describe(progress: Progress) -> str:
    """Return folded samples, the time left of the training while it runs, and the loss as text."""
    folds = f"{progress.folded} fold{'s' * (progress.folded != 1)}"
    left = "" if progress.seconds_left is None else f", {clock(progress.seconds_left)} of the training left"
    return f"{folds}{left}, loss {progress.loss:.3e}"


def _print(console: Console, warned: set[str], record: logging.LogRecord) -> None:
    """Print a log record as a single line above the bar; a repeated warning is printed once."""
    text = record.getMessage()
    if record.levelno >= logging.WARNING:
        if text in warned:
            return
        warned.add(text)
        text = f"{record.levelname.lower()}: {text}"
    console.print(Text(text), soft_wrap=True)


@contextmanager
def shown_progress(quiet: bool) -> Iterator[ProgressCallback | None]:
    """Show the progress and the log of a run on stderr while the block runs; only warnings where `quiet`."""
    with _shown(quiet, TextColumn("{task.description:8s}"), BarColumn(10), MofNCompleteColumn()) as show:
        yield show and partial(tell_run, show)


@contextmanager
def shown_batch(quiet: bool) -> Iterator[BatchProgress | None]:
    """Show the progress and the log of a batch on stderr while the block runs; only warnings where `quiet`."""
    with _shown(quiet, BarColumn(20), TextColumn("{task.fields[ended]}")) as show:
        yield show and partial(tell_batch, show)


@contextmanager
def _shown(quiet: bool, *columns: ProgressColumn) -> Iterator[Show | None]:
    """Show the log of the packages on stderr, and yield the callback of its progress bar; None where `quiet`."""
    console = Console(file=sys.stderr, highlight=False)
    with logged(partial(_print, console, set()), logging.WARNING if quiet else logging.INFO):
        if quiet:
            yield None
            return
        display = Display(console, *columns)
        with display.bar:
            yield display.show
