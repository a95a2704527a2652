"""Computes one surface of a batch in a worker process, and reports its progress to the client."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from parameterize.progress import Progress

from ..options import MapOptions, ProblemOptions
from ..workflow import pipeline
from ..workflow.output_folder import Outcome
from ..workflow.worker_run import Ended, ended, logged, throttled
from .surfaces import Entry

LESS_MEMORY = "give workers more --memory-limit, or lower --control-points or --refine"

_stopped: set[str] = set()  # batches that were interrupted


@dataclass(frozen=True)
class Task(Entry):
    """Hold a surface of a batch and all options of its result.

    problem_options: the problem to solve, None for the map alone. vector: whether curves are also written as PDF.
    time_limit: of this surface, as the command line takes it.
    """

    mapping: MapOptions
    problem_options: ProblemOptions | None
    vector: bool = False
    time_limit: float | str | None = None


Work = Callable[[Task, int, str], Ended]


def compute(task: Task, number: int, batch: str) -> Ended:
    """Compute a surface into its folder, from its checkpoint where there is one, and return its end.

    number: the number of the surface in the batch, for the messages of progress.
    """
    from distributed import get_worker

    worker, stages = get_worker(), [stage.name for stage in task.mapping.config().stages] + ["layout", "spline"]

    def tell(now: Progress) -> None:
        share = (stages.index(now.stage) + now.step / max(now.steps, 1)) / len(stages)
        worker.log_event(batch, {"number": number, "stage": now.stage, "share": share})

    def run() -> Outcome:
        progress = throttled(tell, lambda: batch in _stopped)
        given: dict[str, Any] = {
            "mapping": task.mapping,
            "problem_options": task.problem_options,
            "vector": task.vector,
            "time_limit": task.time_limit,
        }
        return pipeline.parameterize_to(task.mesh, task.folder, progress=progress, **given)

    with logged(lambda _: None):  # warnings are in the report: a surface has one line on the terminal
        return ended(run, LESS_MEMORY)


def stop(batch: str) -> None:
    """Let the surfaces of a batch in this worker end at their next step, with a checkpoint."""
    _stopped.add(batch)
