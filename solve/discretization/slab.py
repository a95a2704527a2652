"""Defines Slab: the part of a trial space on one process of an MPI job, and its messages to the other processes.

The processes share the space in consecutive spans of u (docs/mpi.md). A process integrates over its spans with the
kernels of one process. Each function of u, a row, has an owner among the processes on whose spans it is not zero; the
others have copies, up to `degree` rows after their own rows.
"""

import logging
import math
from collections import Counter
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import breakpoints, find_spans

from .processes import Messenger, agreed
from .space import TrialSpace, Window

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, kw_only=True)
class Slab(TrialSpace):
    """Hold the part of a trial space on this process: some rows of u, and all rows of v and w.

    The knots of u belong to the slab's rows, and are not an open knot vector. parent: the space that all processes
    share.
    """

    parent: TrialSpace
    messenger: Messenger

    @classmethod
    def of(cls, space: TrialSpace, comm: Any) -> Self:
        """Return this process's slab of a space that the processes of a communicator share."""
        given = {"parent": space, "messenger": Messenger(comm)}
        slab = cls(space.degrees, space.knots, space.dirichlet, **given)  # type: ignore[arg-type]
        if comm.size > slab.spans[-1] and comm.rank == 0:
            log.warning("spans of u: %d, processes: %d; the others have no work", slab.spans[-1], comm.size)
        own = space.knots[0][slab.rows.start : slab.rows.stop + space.degrees[0] + 1]
        return replace(slab, knots=(own, *space.knots[1:]))

    @property
    def whole(self) -> TrialSpace:
        """Return the space that all processes share."""
        return self.parent

    @property
    def comm(self) -> Any:
        """Return the communicator."""
        return self.messenger.comm

    @property
    def rank(self) -> int:
        """Return the number of this process, 0 for the first."""
        return self.messenger.rank

    @cached_property
    def spans(self) -> IntArray:
        """Return the first span of u of each process, and the number of spans: (size + 1,); it may have no span."""
        return (len(breakpoints(self.parent.knots[0])) - 1) * np.arange(self.comm.size + 1) // self.comm.size

    @property
    def breaks(self) -> tuple[Array, Array, Array]:
        """Return the ends of the spans over which this process integrates, one array a direction."""
        u, v, w = map(breakpoints, self.parent.knots)
        return u[self.spans[self.rank] : self.spans[self.rank + 1] + 1], v, w

    @cached_property
    def firsts(self) -> IntArray:
        """Return the first function on each span of u of the whole space, and the number of all functions."""
        knots, degree = self.parent.knots[0], self.degrees[0]
        return np.append(find_spans(knots, degree, breakpoints(knots)[:-1]) - degree, self.parent.shape[0])

    @cached_property
    def owned(self) -> list[slice]:
        """Return the rows that each process owns."""
        return [slice(int(a), int(b)) for a, b in pairwise(self.firsts[self.spans])]

    @cached_property
    def kept(self) -> list[slice]:
        """Return the rows that each process has, its own rows first."""
        degree = self.degrees[0]
        ends = [self.firsts[b - 1] + degree + 1 if a < b else self.firsts[a] for a, b in pairwise(self.spans)]
        return [slice(own.start, int(end)) for own, end in zip(self.owned, ends, strict=True)]

    @property
    def rows(self) -> slice:
        """Return the rows of the whole space that this process has."""
        return self.kept[self.rank]

    @property
    def own(self) -> slice:
        """Return the rows of this process's arrays that it owns; each row has one owner."""
        owned = self.owned[self.rank]
        return slice(0, owned.stop - owned.start)

    @property
    def window(self) -> Window:
        """Return the free coefficients that this process owns, as indices of its arrays."""
        u, v, w = self.free
        return _common(self.owned[self.rank], u, self.rows.start), v, w

    @cached_property
    def starts(self) -> IntArray:
        """Return the first own row of each process among all free rows, and the number of free rows: (size + 1,)."""
        return np.cumsum([0] + [len(_rows(_common(own, self.free[0]))) for own in self.owned])

    @cached_property
    def column_starts(self) -> IntArray:
        """Return the first column of each process among the free functions of v, and their number: (size + 1,)."""
        return len(_rows(self.free[1])) * np.arange(self.comm.size + 1) // self.comm.size

    @property
    def place(self) -> slice:
        """Return the own rows of this process among all free rows."""
        return slice(*self.starts[self.rank : self.rank + 2])

    @property
    def columns(self) -> slice:
        """Return the free functions of v that this process has after `to_columns`."""
        return slice(*self.column_starts[self.rank : self.rank + 2])

    def agreed(self) -> AbstractContextManager[None]:
        """Return a context that raises an error of one process on all processes."""
        return agreed(self.comm)

    def shared(self, value: Any) -> list[Any]:
        """Return the value of every process, in the order of their ranks."""
        return self.messenger.shared(value)

    def traffic(self) -> Counter[str]:
        """Return the number of bytes that all processes have sent so far, by purpose."""
        return self.messenger.traffic()

    def fill(self, coefficients: Array) -> None:
        """Overwrite the copies of rows (.., n_u, n_v, n_w) by the values of their owners."""
        own, copies = self._halo
        for part in coefficients.reshape(math.prod(coefficients.shape[:-3]), *self.shape):
            sent, received = [(rank, part[rows]) for rank, rows in own], [(rank, part[rows]) for rank, rows in copies]
            self.messenger.exchange(sent, received)

    def add(self, integrals: Array) -> None:
        """Add to own rows (.., n_u, n_v, n_w) the parts that other processes have integrated."""
        own, copies = self._halo
        for part in integrals.reshape(math.prod(integrals.shape[:-3]), *self.shape):
            found = [(rank, np.empty_like(part[rows])) for rank, rows in own]
            self.messenger.exchange([(rank, part[rows]) for rank, rows in copies], found)
            for (_, rows), (_, more) in zip(own, found, strict=True):
                part[rows] += more

    @cached_property
    def _halo(self) -> tuple[list[tuple[int, slice]], list[tuple[int, slice]]]:
        """Return the processes with copies of own rows, and the owners of the copies here, each with the rows."""
        others = [rank for rank in range(self.comm.size) if rank != self.rank]
        own = [(rank, _common(self.owned[self.rank], self.kept[rank], self.rows.start)) for rank in others]
        copies = [(rank, _common(self.rows, self.owned[rank], self.rows.start)) for rank in others]
        return [pair for pair in own if _rows(pair[1])], [pair for pair in copies if _rows(pair[1])]

    def gather(self, own: Array) -> Array:
        """Return the rows (c, m_u, ..) of all processes, one after another."""
        sizes = self.shared(own[0].size)
        return np.stack([self.messenger.gather(part, sizes).reshape(-1, *own.shape[2:]) for part in own])

    def to_columns(self, x: Any) -> Any:
        """Return all free rows of this process's columns, (m_u, columns, m_w), from own free rows (rows, m_v, m_w)."""
        columns = self.column_starts[1:-1]
        parts = np.split(x, columns, axis=1)
        result = np.empty((self.starts[-1], parts[self.rank].shape[1], x.shape[2]))
        sizes = [part.size for part in parts]
        counts = np.diff(self.starts) * result[0].size
        self.messenger.transpose(np.concatenate(parts, axis=None), sizes, result, counts, sizes[self.rank])
        return result

    def to_rows(self, x: Any) -> Any:
        """Return own free rows (rows, m_v, m_w) from columns: the inverse of `to_columns`."""
        height, widths = int(np.diff(self.starts)[self.rank]), np.diff(self.column_starts)
        result, counts = np.empty(height * int(widths.sum()) * x.shape[2]), height * widths * x.shape[2]
        self.messenger.transpose(x, np.diff(self.starts) * x[0].size, result, counts, height * x[0].size)
        parts = zip(np.split(result, np.cumsum(counts)[:-1]), widths, strict=True)
        return np.concatenate([part.reshape(height, width, x.shape[2]) for part, width in parts], axis=1)

    def receive(self, part: Array, after: bool = False) -> bool:
        """Overwrite `part` by the message of the neighbouring process; return False where there is no such process.

        The neighbour has the free rows before own rows, or after own rows with `after`.
        """
        source = self._neighbour(after)
        if source is not None:
            self.comm.Recv(part, source)
        return source is not None

    def send(self, part: Array, after: bool = False) -> None:
        """Send `part` to the process with the free rows before own rows, or after them, where there is one."""
        target = self._neighbour(after)
        if target is not None:
            self.comm.Send(part, target)
            self.messenger.sent["substitution"] += part.nbytes

    def _neighbour(self, after: bool) -> int | None:
        """Return the process with the free rows before own rows, or after them; None where there is no such process."""
        busy = np.flatnonzero(np.diff(self.starts)).tolist()
        if self.rank not in busy:
            return None
        at = busy.index(self.rank) + (1 if after else -1)
        return busy[at] if 0 <= at < len(busy) else None


def shared_space(space: TrialSpace, comm: Any) -> TrialSpace:
    """Return this process's slab of a space, or the whole space without a communicator or with one process."""
    return space if comm is None or comm.size == 1 else Slab.of(space, comm)


def _common(a: slice, b: slice, origin: int = 0) -> slice:
    """Return the intersection of two ranges, counted from an origin; without one, an empty range in the first."""
    start = min(max(a.start, b.start), a.stop)
    return slice(start - origin, max(start, min(a.stop, b.stop)) - origin)


def _rows(part: slice) -> range:
    return range(part.start, part.stop)
