"""Runs one job in a process of its own, follows it through a pipe and can stop it at any time.

It is a process so that a stop works during every step, and so that its memory is freed when it ends.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event as SharedEvent
from pathlib import Path
from threading import Event
from typing import Literal

from parameterize.arrays import Array
from parameterize.progress import Progress

from ..errors import expected_errors, one_line
from ..options import MapOptions, PoissonOptions
from ..workflow import logged, pipeline

INTERVAL = 0.4  # seconds, at least, between two steps that are reported
SHARE = 0.05  # of the job's time, at most, that reporting takes
GRACE = 3.0  # seconds a job has to stop by itself, leaving a checkpoint


@dataclass(frozen=True, eq=False)
class Step:
    """Hold the training after one step. mapped: where the surface's vertices and those added to them are, (n, 3)."""

    progress: Progress
    mapped: Array | None


@dataclass(frozen=True)
class End:
    """Say how the job ended. text: why it failed."""

    state: Literal["done", "failed", "stopped"]
    text: str = ""


Message = Step | str | End  # a string is a line of the log


def run(folder: Path, name: str, mapping: MapOptions | None, poisson: PoissonOptions, stop: Event) -> Iterator[Message]:
    """Run the surface `name` in `folder`, which also takes the results; yield messages as they come, an End last.

    mapping: None where the file is a volume, on which the problem is only solved.
    """
    spawn = multiprocessing.get_context("spawn")  # a copy of a process with threads may hang
    receiver, sender = spawn.Pipe(duplex=False)
    halt = spawn.Event()
    process = spawn.Process(target=_work, args=(sender, halt, folder, name, mapping, poisson), daemon=True)
    process.start()
    sender.close()
    try:
        yield from _follow(receiver, halt, stop, process)
    finally:
        process.terminate()
        process.join()
        receiver.close()


def _follow(
    receiver: Connection, halt: SharedEvent, stop: Event, process: multiprocessing.process.BaseProcess
) -> Iterator[Message]:
    """Yield messages up to the End; where the process exits without one, add it."""
    patience = float("inf")
    while True:
        if stop.is_set() and not halt.is_set():
            halt.set()
            patience = time.monotonic() + GRACE
        if time.monotonic() > patience:
            process.terminate()
        try:
            if not receiver.poll(0.1):
                continue
            message: Message = receiver.recv()
        except (EOFError, OSError):
            process.join()
            code = process.exitcode
            yield End("stopped") if stop.is_set() else End("failed", f"the job's process exited with code {code}")
            return
        yield message
        if isinstance(message, End):
            return


def _work(
    sender: Connection, halt: SharedEvent, folder: Path, name: str, mapping: MapOptions | None, poisson: PoissonOptions
) -> None:
    """Run the job in the child process, in the job's folder: messages then name the file as the user does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C in the terminal
    os.chdir(folder)
    teller = _Teller(sender, halt)
    try:
        with logged(teller, logging.INFO):
            if mapping is None:
                pipeline.solve_to(name, problem=poisson, force=True)  # over what a stopped solve left
            else:
                pipeline.run("poisson", name, mapping=mapping, poisson=poisson, progress=teller.step)
    except KeyboardInterrupt:
        sender.send(End("stopped"))
    except expected_errors() as error:
        sender.send(End("failed", one_line(error)))
    except Exception as error:
        sender.send(
            End("failed", f"internal error, please report it: {one_line(error)}; the terminal shows the traceback")
        )
        raise
    else:
        sender.send(End("done"))


class _Teller(logging.Handler):
    """Sends the lines of the log and some of the steps; interrupts the training when a stop is asked for."""

    def __init__(self, sender: Connection, halt: SharedEvent) -> None:
        super().__init__()
        self._sender, self._halt, self._next = sender, halt, 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Send a line of the log."""
        self._sender.send(record.getMessage())

    def step(self, progress: Progress) -> None:
        """Report the state after a step of the training."""
        if self._halt.is_set():
            raise KeyboardInterrupt
        start = time.monotonic()
        if start < self._next:
            return
        mapped = progress.mapped() if progress.mapped is not None else None
        self._sender.send(Step(replace(progress, mapped=None), mapped))
        end = time.monotonic()
        self._next = end + max(INTERVAL, (end - start) / SHARE)
