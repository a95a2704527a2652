"""Runs one job in a process of its own, follows it through a pipe and can stop it at any time.

It is a process so that a stop works during every step, and so that its memory is freed when it ends.
"""

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

from parameterize.arrays import Array
from parameterize.progress import Progress

from ..options import MapOptions, ProblemOptions
from ..workflow import pipeline
from ..workflow.output_folder import Outcome
from ..workflow.worker_run import Ended, ended, logged, throttled

GRACE = 3.0  # seconds a job has to stop by itself, leaving a checkpoint


@dataclass(frozen=True, eq=False)
class Step:
    """Hold the training after one step. mapped: images (n, 3) of the surface's vertices, with the vertices of cuts."""

    progress: Progress
    mapped: Array | None


Message = Step | str | Ended  # a string is a line of the log


def run(
    folder: Path, name: str, mapping: MapOptions | None, problem_options: ProblemOptions, stop: Event
) -> Iterator[Message]:
    """Run the surface `name` in `folder`, which also takes the results; yield messages as they come, an Ended last.

    mapping: None where the file is a volume, on which the problem is only solved.
    """
    spawn = multiprocessing.get_context("spawn")  # a copy of a process with threads may hang
    receiver, sender = spawn.Pipe(duplex=False)
    halt = spawn.Event()
    process = spawn.Process(target=_work, args=(sender, halt, folder, name, mapping, problem_options), daemon=True)
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
    """Yield messages up to the Ended; where the process exits without one, add it."""
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
            yield Ended("stopped") if stop.is_set() else Ended("failed", f"the job's process exited with code {code}")
            return
        yield message
        if isinstance(message, Ended):
            return


def _work(
    sender: Connection,
    halt: SharedEvent,
    folder: Path,
    name: str,
    mapping: MapOptions | None,
    problem_options: ProblemOptions,
) -> None:
    """Run the job in the child process, in the job's folder: messages then name the file as the user does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C in the terminal
    os.chdir(folder)

    def tell(now: Progress) -> None:
        sender.send(Step(replace(now, mapped=None), now.mapped() if now.mapped is not None else None))

    def work() -> Outcome | None:
        if mapping is None:
            return pipeline.solve_to(
                name, problem_options=problem_options, force=True
            )  # replaces the files of a stopped solve
        return pipeline.parameterize_to(
            name, mapping=mapping, problem_options=problem_options, progress=throttled(tell, halt.is_set)
        )

    with logged(lambda record: sender.send(record.getMessage()), logging.INFO):
        sender.send(ended(work, "lower --control-points or --refine"))
