"""Draws figures in a process beside the run, which goes on meanwhile; without such a process the run draws them.

The process starts with the run: until the first figures it loads matplotlib and VTK, and tries whether VTK draws, for
if it crashes, the run does not. It ends with its input, however the run ends.
"""

from __future__ import annotations

import gc
import logging
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from queue import SimpleQueue
from threading import Thread
from typing import IO

from parameterize.files import unfinished
from parameterize.threads import default_threads

from ..report.artifacts import files_of
from . import drawing
from .drawing import Failures, Figures
from .worker_run import Told

log = logging.getLogger(__name__)

Answer = tuple[Failures, list[str]]  # and the warnings


class Painter:
    """Draw figures in a process of its own, in the order in which they are given; a context that ends the process."""

    def __init__(self) -> None:
        self._open: list[Figures] = []
        places = os.pathsep.join(place for place in sys.path if place)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": places},
            process_group=0,  # else Ctrl-C in a terminal would reach it, too
        )

    def __enter__(self) -> Painter:
        return self

    def __exit__(self, *_: object) -> None:
        """End the process, and remove what it leaves of figures that it has not finished."""
        self._process.kill()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(OSError):
                stream.close()
        self._process.wait()
        for figures in self._open:
            for name in files_of(figures.part):
                for rest in unfinished(figures.folder / name):
                    rest.unlink(missing_ok=True)

    def begin(self, figures: Figures) -> bool:
        """Let figures be drawn, and return whether they will be: not those of functions that have no pickle."""
        assert self._process.stdin is not None
        sent = figures
        with suppress(Exception):  # what fails now fails again where it is drawn, and is told
            sent = drawing.sampled(figures)
        try:
            content = pickle.dumps(sent)
        except Exception as error:  # whatever a user's object does
            log.debug("drawn by the run itself: %s", error)
            return False
        self._open.append(figures)
        with suppress(OSError):  # of a process that has ended: `end` finds out
            self._process.stdin.write(content)
            self._process.stdin.flush()
        return True

    def end(self) -> Failures:
        """Wait for the figures and return the failures; the run draws those that an ended process leaves."""
        assert self._process.stdout is not None
        failures: Failures = {}
        while self._open:
            try:
                found, warnings = pickle.load(self._process.stdout)  # noqa: S301 (our own process)
            except (EOFError, OSError, pickle.UnpicklingError):
                log.debug("the process that draws has ended")
                found, warnings = drawing.draw(self._open[0]), []
            self._open.pop(0)
            failures |= found
            for warning in warnings:
                log.warning("%s", warning)
        return failures


@contextmanager
def beside() -> Iterator[Painter | None]:
    """Yield a process that draws figures, with more than one thread; it takes 300 MB."""
    if default_threads() < 2:
        yield None
        return
    with Painter() as painter:
        yield painter


def main() -> None:
    """Draw what comes in, until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where there are no process groups
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    given: SimpleQueue[Figures] = SimpleQueue()
    Thread(target=_read, args=(sys.stdin.buffer, given), daemon=True).start()
    warnings: list[str] = []  # which the run tells
    logging.getLogger("iga_nn").addHandler(Told(lambda record: warnings.append(record.getMessage()), logging.WARNING))
    logging.getLogger("iga_nn").propagate = False
    gc.disable()  # else Python looks for cycles among what libraries make while they are imported
    with suppress(Exception):  # what fails now fails again where it is needed, and is told
        _can_draw()
        import_module("iga_nn.figures.solution")
    gc.freeze()
    gc.enable()
    while True:
        failures = drawing.draw(given.get(), _can_draw)
        pickle.dump((failures, warnings), answers)
        warnings.clear()
        answers.flush()


def _read(source: IO[bytes], given: SimpleQueue[Figures]) -> None:
    """Take figures at once, so that the run need not wait; end the process with its input."""
    try:
        while True:
            given.put(pickle.load(source))  # noqa: S301 (the run started us)
    finally:
        os._exit(0)


@cache
def _can_draw() -> bool:
    """Return whether VTK draws, tried in this process: where it crashes, the run tries and tells."""
    from ..figures.probe import choose_window
    from ..figures.render import CANNOT_DRAW

    choose_window()
    try:
        done = import_module("iga_nn.figures.style").draws()
    except Exception:
        done = False
    if not done:
        log.warning("no figures: %s", CANNOT_DRAW)
    return done


if __name__ == "__main__":
    main()
