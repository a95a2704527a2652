"""Slabs: a trial space shared by the processes of an MPI job, consecutive spans of u each (docs/mpi.md).

A process integrates over its spans with the kernels of one process. What belongs to a function of u, a row, is owned by
one of the processes on whose spans it is not zero; the others have copies, up to `degree` rows after their own.
"""

import logging
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import breakpoints, find_spans

from .space import TrialSpace, Window

log = logging.getLogger(__name__)

Message = tuple[int, Array]  # another process, and what goes to it or comes from it


@contextmanager
def agreed(comm: Any) -> Iterator[None]:
    """Raise what the block raises on one process on all of them; they do not meet within it."""
    fault = None
    try:
        yield
    except Exception as error:  # whatever a user's data or memory do
        fault = error
    for found in comm.allgather(fault):
        if found is not None:
            raise found


@dataclass(frozen=True, eq=False)
class Slab(TrialSpace):
    """What one process keeps of a space. The knots of u are those of its rows: not open.

    shared_space: the whole. comm: a communicator of mpi4py. free: the free coefficients of the whole space.
    spans: (size + 1,), where the spans of each process begin; one that is too many has none.
    sent: bytes that this process has sent so far, by what for.
    """

    shared_space: TrialSpace
    comm: Any
    free: Window
    spans: IntArray
    sent: Counter[str] = field(default_factory=Counter)

    @classmethod
    def of(cls, space: TrialSpace, comm: Any, free: Window) -> "Slab":
        """Return this process's slab of a space with these free coefficients."""
        count = len(breakpoints(space.knots[0])) - 1
        if comm.size > count and comm.rank == 0:
            log.warning("%d processes for %d spans of u: the others have no work", comm.size, count)
        spans = count * np.arange(comm.size + 1) // comm.size
        blank = cls(space.degrees, space.knots, space, comm, free, spans)
        rows, degree = blank.kept[comm.rank], space.degrees[0]
        knots = (space.knots[0][rows.start : rows.stop + degree + 1], *space.knots[1:])
        return cls(space.degrees, knots, space, comm, free, spans)

    @property
    def whole(self) -> TrialSpace:
        """The space that all processes share."""
        return self.shared_space

    @property
    def rank(self) -> int:
        """The number of this process."""
        return int(self.comm.rank)

    @property
    def rows(self) -> slice:
        """The rows of the whole space that this process has."""
        return self.kept[self.rank]

    @property
    def breaks(self) -> tuple[Array, Array, Array]:
        """The ends of its own spans in u, of all spans in v and w."""
        u, v, w = self.whole.breaks
        return u[self.spans[self.rank] : self.spans[self.rank + 1] + 1], v, w

    @cached_property
    def firsts(self) -> IntArray:
        """The first function on each span of u of the whole space, and the number of all functions."""
        knots, degree = self.whole.knots[0], self.degrees[0]
        return np.append(find_spans(knots, degree, breakpoints(knots)[:-1]) - degree, self.whole.shape[0])

    @cached_property
    def owned(self) -> list[slice]:
        """The rows that each process owns."""
        return [slice(int(a), int(b)) for a, b in pairwise(self.firsts[self.spans])]

    @cached_property
    def kept(self) -> list[slice]:
        """The rows that each process has, its own first."""
        degree = self.degrees[0]
        ends = [self.firsts[b - 1] + degree + 1 if a < b else self.firsts[a] for a, b in pairwise(self.spans)]
        return [slice(own.start, int(end)) for own, end in zip(self.owned, ends, strict=True)]

    @cached_property
    def starts(self) -> IntArray:
        """Where the own rows of each process begin among all free rows, and the number of these: (size + 1,)."""
        return np.cumsum([0] + [len(_rows(_common(own, self.free[0]))) for own in self.owned])

    @cached_property
    def column_starts(self) -> IntArray:
        """Where the columns of each process begin among the free functions of v, and the number of these."""
        return len(_rows(self.free[1])) * np.arange(self.comm.size + 1) // self.comm.size

    @property
    def place(self) -> slice:
        """The own rows of this process among all free rows."""
        return slice(*self.starts[self.rank : self.rank + 2])

    @property
    def columns(self) -> slice:
        """The columns of this process among the free functions of v."""
        return slice(*self.column_starts[self.rank : self.rank + 2])

    def own(self, free: Window) -> Window:
        """Return those of the free coefficients that are this process's own, in its arrays."""
        return _common(self.owned[self.rank], free[0], self.rows.start), *free[1:]

    def shared(self, value: Any) -> list[Any]:
        """Return the value of every process, in the order of their ranks."""
        found: list[Any] = self.comm.allgather(value)
        return found

    @contextmanager
    def agreed(self) -> Iterator[None]:
        """Raise what the block raises on one process on all of them."""
        with agreed(self.comm):
            yield

    def fill(self, coefficients: Array) -> None:
        """Overwrite copies (.., n_u, n_v, n_w) by what their owners have."""
        own, copies = self._halo
        for part in coefficients.reshape(math.prod(coefficients.shape[:-3]), *self.shape):
            self._trade([(rank, part[rows]) for rank, rows in own], [(rank, part[rows]) for rank, rows in copies])

    def add(self, integrals: Array) -> None:
        """Add what others have of own rows to these (.., n_u, n_v, n_w)."""
        own, copies = self._halo
        for part in integrals.reshape(math.prod(integrals.shape[:-3]), *self.shape):
            found = [(rank, np.empty_like(part[rows])) for rank, rows in own]
            self._trade([(rank, part[rows]) for rank, rows in copies], found)
            for (_, rows), (_, more) in zip(own, found, strict=True):
                part[rows] += more

    @cached_property
    def _halo(self) -> tuple[list[tuple[int, slice]], list[tuple[int, slice]]]:
        """Return who has copies of own rows, and of which ones; whose rows have copies here, and which ones."""
        others = [rank for rank in range(self.comm.size) if rank != self.rank]
        own = [(rank, _common(self.owned[self.rank], self.kept[rank], self.rows.start)) for rank in others]
        copies = [(rank, _common(self.rows, self.owned[rank], self.rows.start)) for rank in others]
        return [pair for pair in own if _rows(pair[1])], [pair for pair in copies if _rows(pair[1])]

    def _trade(self, sent: Sequence[Message], received: Sequence[Message]) -> None:
        requests = [self.comm.Irecv(part, rank) for rank, part in received]
        requests += [self.comm.Isend(part, rank) for rank, part in sent]
        self.sent["halo"] += sum(part.nbytes for _, part in sent)
        for request in requests:
            request.Wait()

    def gather(self, own: Array) -> Array:
        """Return the rows (c, m_u, ..) of all processes, one after another."""
        counts = self.shared(own.shape[1])
        whole = np.empty((len(own), sum(counts), *own.shape[2:]))
        self.sent["gather"] += own.nbytes * (self.comm.size - 1)
        for part, result in zip(own, whole, strict=True):
            self.comm.Allgatherv(np.ascontiguousarray(part), (result, [n * result[0].size for n in counts]))
        return whole

    def to_columns(self, x: Array) -> Array:
        """Return (m_u, columns, m_w), of all free rows, from own free rows (rows, m_v, m_w)."""
        columns = self.column_starts[1:-1]
        parts = np.split(x, columns, axis=1)
        result = np.empty((self.starts[-1], parts[self.rank].shape[1], x.shape[2]))
        sizes = [part.size for part in parts]
        self.comm.Alltoallv((np.concatenate(parts, axis=None), sizes), (result, np.diff(self.starts) * result[0].size))
        self.sent["transposition"] += 8 * (x.size - sizes[self.rank])
        return result

    def to_rows(self, x: Array) -> Array:
        """Invert `to_columns`."""
        height, widths = int(np.diff(self.starts)[self.rank]), np.diff(self.column_starts)
        result, sizes = np.empty(height * int(widths.sum()) * x.shape[2]), height * widths * x.shape[2]
        self.comm.Alltoallv((x, np.diff(self.starts) * x[0].size), (result, sizes))
        self.sent["transposition"] += 8 * (x.size - height * x[0].size)
        parts = zip(np.split(result, np.cumsum(sizes)[:-1]), widths, strict=True)
        return np.concatenate([part.reshape(height, width, x.shape[2]) for part, width in parts], axis=1)

    def traffic(self) -> Counter[str]:
        """Return how many bytes all processes have sent so far, by what for."""
        return sum(self.shared(self.sent), Counter())

    def receive(self, part: Array, after: bool = False) -> bool:
        """Overwrite `part` by what the process with the free rows before, or after, sends; False where none is."""
        source = self._neighbour(after)
        if source is not None:
            self.comm.Recv(part, source)
        return source is not None

    def send(self, part: Array, after: bool = False) -> None:
        """Send `part` to the process with the free rows before, or after, where there is one."""
        target = self._neighbour(after)
        if target is not None:
            self.comm.Send(part, target)
            self.sent["substitution"] += part.nbytes

    def _neighbour(self, after: bool) -> int | None:
        """Return the process with the free rows before, or after, own ones; None where there are none of either."""
        busy = np.flatnonzero(np.diff(self.starts)).tolist()
        if self.rank not in busy:
            return None
        at = busy.index(self.rank) + (1 if after else -1)
        return busy[at] if 0 <= at < len(busy) else None


def _common(a: slice, b: slice, origin: int = 0) -> slice:
    """Return what two ranges share, counted from an origin; an empty one within the first where that is nothing."""
    start = min(max(a.start, b.start), a.stop)
    return slice(start - origin, max(start, min(a.stop, b.stop)) - origin)


def _rows(part: slice) -> range:
    return range(part.start, part.stop)
