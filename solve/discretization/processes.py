"""Defines the processes that share a body: a Messenger passes arrays and numbers between those of an MPI job."""

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from parameterize.arrays import Array

Message = tuple[int, Array]  # another process, and the array that is sent to it or received from it


class Processes(Protocol):
    """Describe the processes that share a body, or the only one; all of them call each method together."""

    @property
    def rank(self) -> int:
        """Return the number of this process, 0 for the first."""

    def shared(self, value: Any) -> list[Any]:
        """Return the value of every process, in the order of their ranks."""

    def total(self, value: Any) -> Any:
        """Return the sum of the values of all processes, the same on each."""

    def traffic(self) -> Counter[str]:
        """Return the number of bytes that all processes have sent so far, by purpose."""


@contextmanager
def agreed(comm: Any) -> Iterator[None]:
    """Raise an error of the block on one process on all processes; the block must not wait for other processes."""
    fault = None
    try:
        yield
    except Exception as error:  # whatever a user's data or memory do
        fault = error
    for found in comm.allgather(fault):
        if found is not None:
            raise found


def most_memory(processes: Processes) -> tuple[float, ...]:
    """Return the most resident memory that each of several processes has had, in MB; nothing of a single process."""
    size = 1.0 if sys.platform == "darwin" else 1024.0  # of the unit, in bytes
    found = processes.shared(_peak() * size / 1e6)
    return tuple(found) if len(found) > 1 else ()


def _peak() -> int:
    """Return the most resident memory so far, 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


class Messenger:
    """Pass arrays and numbers between the processes of a communicator of mpi4py.

    sent: the number of bytes that this process has sent so far, by purpose.
    """

    def __init__(self, comm: Any) -> None:
        self.comm = comm
        self.sent: Counter[str] = Counter()

    @property
    def rank(self) -> int:
        """Return the number of this process, 0 for the first."""
        return int(self.comm.rank)

    def shared(self, value: Any) -> list[Any]:
        """Return the value of every process, in the order of their ranks."""
        found: list[Any] = self.comm.allgather(value)
        return found

    def total(self, value: Any) -> Any:
        """Return the sum of the values of all processes, the same on each."""
        return sum(self.shared(value))

    def traffic(self) -> Counter[str]:
        """Return the number of bytes that all processes have sent so far, by purpose."""
        return sum(self.shared(self.sent), Counter())

    def exchange(self, sent: Sequence[Message], received: Sequence[Message]) -> None:
        """Send arrays to other processes, and fill arrays with the messages of other processes."""
        requests = [self.comm.Irecv(part, rank) for rank, part in received]
        requests += [self.comm.Isend(part, rank) for rank, part in sent]
        self.sent["halo"] += sum(part.nbytes for _, part in sent)
        for request in requests:
            request.Wait()

    def transpose(self, sent: Array, sizes: Any, received: Array, counts: Any, kept: int) -> None:
        """Send a part of an array to each process; kept: the number of entries that stay on this process."""
        self.comm.Alltoallv((sent, sizes), (received, counts))
        self.sent["transposition"] += 8 * (sent.size - kept)

    def gather(self, own: Array, counts: Sequence[int]) -> Array:
        """Return the arrays (counts[rank],) of all processes, one after another."""
        whole = np.empty(sum(counts))
        self.sent["gather"] += own.nbytes * (self.comm.size - 1)
        self.comm.Allgatherv(np.ascontiguousarray(own), (whole, counts))
        return whole
