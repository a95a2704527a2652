"""Keeps the jobs of the live page: surfaces are checked one by one, run one at a time, and wait in a queue.

A job's states are checking -> refused | ready -> waiting -> running -> done | failed | stopped. A failed or a stopped
job may be started again. One that is neither checked, waiting nor running may be deleted, with its folder.
"""

import logging
import re
import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Lock

from parameterize.arrays import Array, IntArray
from parameterize.progress import Progress
from parameterize.surface.surface import MeshError, Surface

from ..errors import one_line
from ..options import ProblemOptions
from ..workflow.output_folder import default_folder, has_checkpoint
from ..workflow.worker_run import Ended
from .worker import Message, Step

log = logging.getLogger(__name__)

NAME_LENGTH = 80
PART = "boundary.npz"  # beside a volume: the surface of the part it was made of
STARTS, DELETED = ("ready", "stopped", "failed"), ("refused", "ready", "done", "failed", "stopped")


@dataclass(eq=False)
class Job:
    """Hold the file of a surface, or of a volume to solve on, in a folder of its own, and its state.

    problem_options: the problem to solve on a volume; None for a surface. wanted: the problem to solve on the volume of
    a surface; None for that of the page's options. picked: triangles of the face that was clicked, (k,). parent: number
    of the job that made the volume. text: the reason why the job was refused or failed. mapped: the surface's vertices
    under the map of the training, (n, 3) in the cube. losses: the reported losses of the training. log: the lines of
    the run. begun: the start of the run, in seconds of the system's clock.
    """

    number: int
    name: str
    folder: Path
    state: str = "checking"
    problem_options: ProblemOptions | None = None
    wanted: ProblemOptions | None = None
    parent: int = 0
    text: str = ""
    surface: Surface | None = None
    picked: IntArray | None = None
    progress: Progress | None = None
    mapped: Array | None = None
    losses: list[float] = field(default_factory=list)
    log: list[str] = field(default_factory=list)
    begun: float = 0.0
    stop: Event = field(default_factory=Event)
    turn: Future[None] | None = None

    @property
    def path(self) -> Path:
        """Return the path of the surface's file."""
        return self.folder / self.name

    @property
    def results(self) -> Path:
        """Return the output folder of the run."""
        return self.folder / default_folder(self.name)

    @property
    def volume(self) -> Path:
        """Return the path of the volume that was made, or that is solved on."""
        return self.path if self.problem_options else self.results / "volume.npz"

    @property
    def is_mapped(self) -> bool:
        """Return whether this run has made its volume."""
        return self.volume.is_file() and self.volume.stat().st_mtime >= self.begun

    def begin(self) -> None:
        """Forget the run before this one, unless this one continues from its checkpoint."""
        self.state, self.text, self.begun = "running", "", time.time()
        if not has_checkpoint(self.results):
            self.progress, self.mapped = None, None
            self.losses.clear()
            self.log.clear()


Check = Callable[[Path], Surface]
Run = Callable[[Job], Iterator[Message]]


class Jobs:
    """Keep all jobs, in the order they came.

    check: reads a surface or raises MeshError. run: yields the messages of a job. changed: is called after every
    change, from the thread that made it.
    """

    def __init__(self, root: Path, check: Check, run: Run, changed: Callable[[Job], None]) -> None:
        self._root, self._check, self._run, self._changed = root, check, run, changed
        self._jobs: list[Job] = []
        self._queue: list[Job] = []  # waiting and running
        self.latest = 0  # number of the latest job; numbers of deleted jobs are not used again
        self._lock = Lock()
        self._checker, self._runner = ThreadPoolExecutor(1), ThreadPoolExecutor(1)

    def __iter__(self) -> Iterator[Job]:
        return iter(tuple(self._jobs))

    def find(self, number: int) -> Job | None:
        """Return the job of that number, None where there is none."""
        return next((job for job in self if job.number == number), None)

    def before(self, job: Job) -> int:
        """Return the number of jobs ahead of a job in the queue, the running one included."""
        with self._lock:
            return self._queue.index(job) if job in self._queue else 0

    def add(self, name: str) -> Job:
        """Return a new job with an empty folder; write its file, then call `check`."""
        with self._lock:
            self.latest += 1
            job = Job(self.latest, safe_name(name), self._root / str(self.latest))
            job.folder.mkdir()
            self._jobs.append(job)
        self._changed(job)
        return job

    def refuse(self, job: Job, text: str) -> None:
        """Refuse a job for good, and delete its file. text: the reason, in one line."""
        job.path.unlink(missing_ok=True)
        job.state, job.text = "refused", text
        self._changed(job)

    def check(self, job: Job) -> None:
        """Put the job's surface into the queue of surfaces to check."""
        self._checker.submit(self._check_now, job)

    def solve(self, done: Job, problem_options: ProblemOptions) -> Job:
        """Put a new job into the queue, which solves a problem on the volume of another; return it.

        The part's surface goes with the volume, where it is known: regions are found on it.
        Raises OSError where the volume cannot be copied, for example because the other job was just deleted.
        """
        name = f"{default_folder(done.name)}.npz"
        job = self.add(name if name != PART else f"volume of {PART}")
        try:
            shutil.copyfile(done.volume, job.path)
            if (part := done.volume.with_name(PART)).is_file():
                shutil.copyfile(part, job.path.with_name(PART))
        except OSError:
            job.state = "refused"
            self.delete(job)
            raise
        job.problem_options, job.parent, job.state = problem_options, done.parent or done.number, "ready"
        self.start(job)
        return job

    def delete(self, job: Job) -> None:
        """Delete a job and its folder; a job that is being checked, waits or runs stays."""
        with self._lock:
            if job.state not in DELETED or job not in self._jobs:
                return
            self._jobs.remove(job)
        shutil.rmtree(job.folder, ignore_errors=True)
        self._changed(job)

    def start(self, job: Job) -> None:
        """Put an accepted, a stopped or a failed job into the queue; other jobs are left alone."""
        with self._lock:
            if job.state not in STARTS or job not in self._jobs:
                return
            job.state = "waiting"
            job.stop.clear()
            self._queue.append(job)
            job.turn = self._runner.submit(self._work, job)
        self._changed(job)

    def stop(self, job: Job) -> None:
        """Stop a running job, or remove a waiting one from the queue."""
        with self._lock:
            if job.turn is None or job not in self._queue:
                return
            job.stop.set()
            if job.turn.cancel():
                self._queue.remove(job)
                job.state = "stopped" if job.begun else "ready"
        self._changed(job)

    def close(self) -> None:
        """Stop all jobs and wait for their ends, because libraries complain of jobs that run at exit."""
        for job in self:
            self.stop(job)
        self._checker.shutdown(cancel_futures=True)
        self._runner.shutdown(cancel_futures=True)
        self._jobs.clear()

    def _check_now(self, job: Job) -> None:
        try:
            job.surface = self._check(job.path)
        except (MeshError, OSError) as error:
            self.refuse(job, one_line(error).replace(f"{job.folder}/", ""))  # as the user knows the file
        except Exception:
            log.exception("%s", job.path)
            self.refuse(job, f"{job.name}: internal error, please report it; the terminal shows the traceback")
        else:
            job.state = "ready"
            self._changed(job)

    def _work(self, job: Job) -> None:
        job.begin()
        self._changed(job)
        state, text = "failed", "the job exited without a result"
        try:
            for message in self._run(job):
                if isinstance(message, Step):
                    self._take(job, message)
                elif isinstance(message, Ended):
                    state = "failed" if message.state == "refused" else message.state
                    text = message.line
                else:
                    job.log.append(message)
                self._changed(job)
        finally:
            with self._lock:
                self._queue.remove(job)
                job.state, job.text = state, text
            self._changed(job)

    def _take(self, job: Job, step: Step) -> None:
        job.progress = step.progress
        if step.mapped is not None and job.surface is not None:
            job.mapped = step.mapped[: len(job.surface.vertices)]
            job.losses.append(step.progress.loss)


def safe_name(given: str) -> str:
    """Return a file's name without folders and unusual characters; its ending stays."""
    last = re.split(r"[/\\]", given)[-1]
    return re.sub(r"[^\w.+ -]", "_", last)[-NAME_LENGTH:].lstrip(". -") or "surface"
