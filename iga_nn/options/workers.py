"""Holds the options of the workers of a batch."""

from dataclasses import dataclass, fields

from ..errors import InputError
from ..type_check import Checked

MAX_WORKERS = 256  # on one machine
_LOCAL = ("workers", "threads_per_worker", "memory_limit")  # options that another scheduler decides


@dataclass(frozen=True, kw_only=True)
class WorkerOptions(Checked):
    """Hold the options of the workers that compute the surfaces of a batch.

    Attributes:
        workers: worker processes on this machine; each computes one surface at a time.
        threads_per_worker: number of threads for a surface; the result does not depend on it.
        memory_limit: largest memory of a worker, such as 4GiB; a worker that takes more is ended, and 0 sets no limit.
        retries: number of restarts of a surface from its checkpoint after its worker was lost or its run failed.
        scheduler: address of a dask scheduler, such as tcp://host:8786, whose workers compute instead of workers on
            this machine; they must see the same folders under the same paths.

    Examples:
        >>> import iga_nn
        >>> iga_nn.WorkerOptions(workers=4, memory_limit="2GiB").retries
        1
    """

    workers: int = 2
    threads_per_worker: int = 1
    memory_limit: str = "4GiB"
    retries: int = 1
    scheduler: str | None = None

    def check(self) -> None:
        """Raise InputError for values that cannot be run; the memory limit is read where the workers start."""
        for name in ("workers", "threads_per_worker"):
            if not 1 <= getattr(self, name) <= MAX_WORKERS:
                flag = name.replace("_", " ")
                raise InputError(f"{flag} {getattr(self, name)}: must lie between 1 and {MAX_WORKERS}")
        if self.retries < 0:
            raise InputError(f"retries {self.retries}: must not be negative")
        if self.scheduler == "":
            raise InputError("scheduler is empty: give its address, such as tcp://host:8786")
        given = [field.name for field in fields(self) if getattr(self, field.name) != field.default]
        if self.scheduler is not None and (local := [name for name in _LOCAL if name in given]):
            flag = "--" + local[0].replace("_", "-")
            raise InputError(f"{flag}: applies to workers on this machine; leave it out with --scheduler")
