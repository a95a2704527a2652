"""Computes one surface of a batch in a worker process, and tells the client how far it is."""

from __future__ import annotations

import logging
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ..errors import expected_errors, one_line
from ..options import MapOptions, ProblemOptions
from ..workflow import logged, pipeline

if TYPE_CHECKING:
    from parameterize.progress import Progress

    from ..report.document import Report

INTERVAL = 0.5  # seconds, at least, between two steps that are told
LESS_MEMORY = "give workers more --memory-limit, or lower --control-points or --refine"

_stopped: set[str] = set()  # batches that were interrupted


@dataclass(frozen=True)
class Task:
    """Hold all that the result of one surface depends on, and the folder it goes to.

    options: those of the problem to solve, None to parameterize the surface alone. vector: write curves as PDF, too.
    """

    mesh: str
    folder: Path
    mapping: MapOptions
    options: ProblemOptions | None
    vector: bool = False


@dataclass(frozen=True)
class Ended:
    """Say how a task ended. line: why there is no report."""

    state: Literal["done", "refused", "failed", "stopped"]
    line: str = ""
    report: Report | None = None


Work = Callable[[Task, int, str], Ended]


def compute(task: Task, number: int, batch: str) -> Ended:
    """Compute a surface from its checkpoint, where there is one, into its folder.

    number: of the surface in the batch, for the steps that are told. Nothing is raised; the traceback of an internal
    error is printed here, since only this process knows it.
    """
    teller = _Teller(task, number, batch)
    with logged(logging.NullHandler()):  # warnings are in the report: a surface has one line on the terminal
        try:
            given: dict[str, Any] = {"mapping": task.mapping, "problem": task.options, "vector": task.vector}
            done = pipeline.parameterize_to(task.mesh, task.folder, progress=teller.step, **given)
            return Ended("done", report=done.report)
        except KeyboardInterrupt:
            return Ended("stopped")
        except expected_errors() as error:
            return Ended("refused", one_line(error))
        except Exception as error:
            if isinstance(error, MemoryError) or "can't allocate memory" in str(error):  # the latter is torch's
                return Ended("failed", f"out of memory: {LESS_MEMORY}")
            traceback.print_exc()
            return Ended("failed", f"internal error, please report it: {type(error).__name__}: {one_line(error)}")


def stop(batch: str) -> None:
    """Let the surfaces of a batch in this worker end at their next step, with a checkpoint."""
    _stopped.add(batch)


class _Teller:
    """Tells the client the share of the work that is done, and the stage."""

    def __init__(self, task: Task, number: int, batch: str) -> None:
        from distributed import get_worker

        self._worker, self._number, self._batch = get_worker(), number, batch
        self._stages = [stage.name for stage in task.mapping.config().stages] + ["spline"]
        self._next = 0.0

    def step(self, progress: Progress) -> None:
        """Tell the state after a step of the training, or end it where the batch was interrupted."""
        if self._batch in _stopped:
            raise KeyboardInterrupt
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + INTERVAL
        share = (self._stages.index(progress.stage) + progress.step / max(progress.steps, 1)) / len(self._stages)
        self._worker.log_event(self._batch, {"number": self._number, "stage": progress.stage, "share": share})
