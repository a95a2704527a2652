"""Lets dask compute the surfaces of a batch: worker processes of this machine, or the workers of a scheduler."""

import logging
import os
import signal
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import resource_tracker
from tempfile import TemporaryDirectory
from uuid import uuid4

import dask.config
from dask.utils import format_bytes, parse_bytes
from distributed import CancelledError, Client, Future, KilledWorker, LocalCluster, Worker, WorkerPlugin, wait

from ..errors import InputError, one_line
from ..options import WorkerOptions
from ..workflow.worker_run import Ended
from .task import LESS_MEMORY, Task, Work, compute, stop

log = logging.getLogger(__name__)

POLL = 0.5  # seconds between two checks for ended surfaces
PATIENCE = 10.0  # seconds until a scheduler must have answered
HOPELESS = 600.0  # seconds without a worker on this machine: they start again within some
GRACE = 3.0  # seconds that interrupted surfaces have to keep a checkpoint
SMALLEST = 1 << 29  # bytes: the libraries alone take nearly as much
MEMORY_TOPIC = "worker-restart-memory"  # dask's topic of workers that were ended for their memory
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
SILENT = "CRITICAL"
CONFIG = {
    "distributed.worker.memory.target": False,  # a worker's memory is no data of dask's that could go to disk,
    "distributed.worker.memory.spill": False,  # and a worker that pauses would wait for ever for it to shrink
    "distributed.worker.memory.pause": False,
    "distributed.worker.profile.enabled": False,
    "distributed.deploy.lost-worker-timeout": "1 day",  # a worker that starts again on a busy machine is not lost
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}

OnProgress = Callable[[int, str, float], None]  # number of a surface, its stage, the share of its work that is done


@contextmanager
def connected(workers: WorkerOptions, most: int) -> Iterator[Client]:
    """Yield a client of the workers; workers of this machine end with the block, and their files are removed.

    most: the number of surfaces, which limits the number of workers. Raises InputError where the scheduler does not
    answer.
    """
    with ExitStack() as stack:
        if workers.scheduler is not None:
            try:
                client = Client(workers.scheduler, timeout=PATIENCE)
            except (OSError, ValueError, TypeError) as error:
                raise InputError(f"{workers.scheduler}: no dask scheduler answers there ({one_line(error)})") from None
        else:
            client = Client(stack.enter_context(_local(workers, most)))
            client.register_plugin(_OwnOutput())
        yield stack.enter_context(client)


class _OwnOutput(WorkerPlugin):  # type: ignore[misc]
    """Send the output of libraries in a worker to stderr, because stdout is for the answer of the command."""

    def setup(self, worker: Worker) -> None:
        """Redirect the output of the worker's process at its start or soon after it."""
        os.dup2(2, 1)


@contextmanager
def _local(workers: WorkerOptions, most: int) -> Iterator[LocalCluster]:
    """Start worker processes on this machine.

    They listen on free ports of 127.0.0.1, without a dashboard, and ignore Ctrl-C: the client stops them.
    """
    threads = dict.fromkeys(THREAD_VARIABLES, str(workers.threads_per_worker))
    with ExitStack() as stack:
        stack.enter_context(_environment(threads))
        scratch = stack.enter_context(TemporaryDirectory(prefix="iga-nn-", ignore_cleanup_errors=True))
        stack.enter_context(dask.config.set(CONFIG | {"temporary-directory": scratch}))
        with _interrupts_held():
            cluster = LocalCluster(
                n_workers=min(workers.workers, most),
                threads_per_worker=1,  # surfaces at a time
                memory_limit=memory_limit(workers),
                local_directory=scratch,
                dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False, "allowed_failures": 0},
                silence_logs=SILENT,
            )
            stack.enter_context(cluster)
        yield cluster


def memory_limit(workers: WorkerOptions) -> int:
    """Return the number of bytes that a worker may use, 0 for no limit. Raises InputError."""
    text = workers.memory_limit
    try:
        limit = int(parse_bytes(text))
    except (ValueError, OverflowError):
        raise InputError(f"memory limit {text!r}: write a number with its unit, such as 4GiB") from None
    if limit < 0 or 0 < limit < SMALLEST:
        raise InputError(f"memory limit {text}: must be at least {format_bytes(SMALLEST)}, or 0 for none")
    return limit


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables that workers inherit, and restore the environment at the end, because dask adds variables to it."""
    before = dict(os.environ)
    os.environ.update(values)
    try:
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back: threads and processes that start in the block, and their own processes, never receive it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it would let Ctrl-C through again where it started in the block
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def computed(
    client: Client, tasks: Sequence[Task], workers: WorkerOptions, tell: OnProgress, work: Work = compute
) -> Generator[tuple[int, Ended], None, None]:
    """Yield the number of each task and its end, in the order of the ends; a failed task is first tried again.

    A surface is sent to a worker once that worker is free: a surface that waits in a worker would be lost with it.
    Where the caller ends early, surfaces keep a checkpoint.
    """
    batch = f"iga-nn-{uuid4().hex}"
    client.subscribe_topic(batch, lambda event: tell(event[1]["number"], event[1]["stage"], event[1]["share"]))
    waiting, tries = list(range(len(tasks))), [0] * len(tasks)
    running: dict[Future, int] = {}
    seen = time.monotonic()  # when there was a worker
    try:
        while waiting or running:
            present = sum(client.nthreads().values())
            seen = time.monotonic() if present or workers.scheduler else seen
            if time.monotonic() - seen > HOPELESS:
                raise InputError(
                    "the workers of this machine do not start again; run the same command again to continue"
                )
            free = max(0, present - len(running))
            for number in waiting[:free]:
                running[client.submit(work, tasks[number], number, batch, pure=False)] = number
            del waiting[:free]
            for future in _first_ended(list(running)):
                number, how = running.pop(future), _ended(client, future)
                if how.state == "failed" and tries[number] < workers.retries:
                    tries[number] += 1
                    waiting.append(number)
                    log.info("%s: %s; trying again", tasks[number].mesh, how.line)
                else:
                    yield number, how
    except (OSError, CancelledError) as error:
        where = workers.scheduler or "the workers of this machine"
        raise InputError(
            f"{where}: the connection is lost ({one_line(error)}); run the same command again to continue"
        ) from None
    finally:
        if running:
            _stop(client, batch, list(running))


def _first_ended(futures: list[Future]) -> list[Future]:
    """Wait a moment for futures to end, and return the futures that have ended."""
    if not futures:  # no worker has come yet
        time.sleep(POLL)
        return []
    with suppress(TimeoutError):
        wait(futures, timeout=POLL, return_when="FIRST_COMPLETED")
    return [future for future in futures if future.done()]


def _ended(client: Client, future: Future) -> Ended:
    """Return the end of a task, also where it raised an error or lost its workers."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, KilledWorker):
        if _ran_out_of_memory(client, error.last_worker.address):
            return Ended("failed", f"out of memory: its worker took more than its limit; {LESS_MEMORY}")
        return Ended(
            "failed", "its worker process was lost; run the same command again to continue from the checkpoint"
        )
    return Ended("failed", f"internal error, please report it: {type(error).__name__}: {one_line(error)}")


def _ran_out_of_memory(client: Client, worker: str) -> bool:
    """Return whether that worker was ended for its memory; the scheduler may receive this after the worker's end."""
    until = time.monotonic() + 2.0
    while time.monotonic() < until:
        if any(event["worker"] == worker for _, event in client.get_events(MEMORY_TOPIC)):
            return True
        time.sleep(0.1)
    return False


def _stop(client: Client, batch: str, futures: list[Future]) -> None:
    """Ask the workers to end their surfaces of a batch, and wait a moment for their ends."""
    with suppress(Exception):  # workers or the scheduler may be gone: their surfaces have earlier checkpoints
        client.run(stop, batch, on_error="ignore")
        wait(futures, timeout=GRACE)
    with suppress(Exception):
        client.cancel(futures)
