"""The trial space: tensor-product splines on a volume's own knots, refined and raised in degree.

The processes of an MPI job share it in slabs, consecutive spans of u each (docs/mpi.md). A process integrates over its
spans with the kernels of one process. What belongs to a function of u, a row, is owned by one of the processes on whose
spans it is not zero; the others have copies, up to `degree` rows after their own.
"""

import logging
import math
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray, Knots
from parameterize.spline.bspline import apply_along, breakpoints, find_spans, halved, insertion_into
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

log = logging.getLogger(__name__)

Window = tuple[slice, slice, slice]
Message = tuple[int, Array]  # another process, and what goes to it or comes from it

LAYERS = 8  # of elements that are measured at a time: what they take stays in the cache
MOST_ELEMENTS = 1e12  # of a trial space: no computer solves on so many, and halving on and on would not end
MOST_DEGREE = 8


class Alone:
    """The communicator of a single process."""

    rank, size = 0, 1

    def allgather(self, value: Any) -> list[Any]:
        """Return the values of all processes, of the one that there is."""
        return [value]


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
class TrialSpace:
    """Scalar trivariate splines on the unit cube, of three degrees on three open knot vectors on [0, 1].

    dirichlet: names of the cube's faces on which boundary data fix the coefficients. comm: a communicator of mpi4py.
    Of a slab the knots of u are those of its rows, which are not open, and `parent` is the space that all share.
    sent: bytes that this process has sent so far, by what for.
    """

    degrees: tuple[int, int, int]
    knots: Knots
    dirichlet: Collection[str] = FACE_NAMES
    comm: Any = Alone()
    parent: "TrialSpace | None" = None
    sent: Counter[str] = field(default_factory=Counter, init=False)

    def slab(self, comm: Any) -> "TrialSpace":
        """Return what this process keeps of the space where the processes of a communicator share it."""
        slab = replace(self, comm=comm, parent=self)
        if comm.size > slab.spans[-1] and comm.rank == 0:
            log.warning("spans of u: %d, processes: %d; the others have no work", slab.spans[-1], comm.size)
        own = self.knots[0][slab.rows.start : slab.rows.stop + self.degrees[0] + 1]
        return replace(slab, knots=(own, *self.knots[1:]))

    @property
    def whole(self) -> "TrialSpace":
        """The space that all processes share."""
        return self.parent or self

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of basis functions per direction, of u those of `rows`."""
        return tuple(len(k) - p - 1 for k, p in zip(self.knots, self.degrees, strict=True))

    @property
    def dofs(self) -> int:
        """Number of basis functions, those fixed by the boundary data included."""
        return int(np.prod(self.whole.shape))

    @property
    def elements(self) -> int:
        """Number of non-empty knot spans."""
        return int(np.prod([len(breakpoints(k)) - 1 for k in self.whole.knots]))

    @property
    def gauss_points(self) -> tuple[int, ...]:
        """Gauss points per span and direction that the operator needs with Gauss' rule on every span.

        `degree` points keep the full order of convergence (they are exact for degree 2 p - 1) and cost 2.2 times less
        than degree + 1 in three dimensions. Where the space is only continuous somewhere, as for degree 1, they would
        let hourglass modes through, and on a single span they are fewer than the functions, whose mass matrix would be
        singular: one point more.
        """
        return tuple(
            degree + int(_is_only_continuous(knots, degree) or len(breakpoints(knots)) == 2)
            for knots, degree in zip(self.whole.knots, self.degrees, strict=True)
        )

    @property
    def is_only_continuous(self) -> bool:
        """Whether the functions' derivatives jump somewhere inside."""
        return any(map(_is_only_continuous, self.whole.knots, self.degrees))

    @cached_property
    def spans(self) -> IntArray:
        """Where the spans of u of each process begin: (size + 1,); a process that is too many has none."""
        return (len(breakpoints(self.whole.knots[0])) - 1) * np.arange(self.comm.size + 1) // self.comm.size

    @property
    def breaks(self) -> tuple[Array, Array, Array]:
        """The ends of the spans that this process integrates over, a direction each."""
        u, v, w = map(breakpoints, self.whole.knots)
        return u[self.spans[self.comm.rank] : self.spans[self.comm.rank + 1] + 1], v, w

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

    @property
    def rows(self) -> slice:
        """The rows of the whole space that this process has."""
        return self.kept[self.comm.rank]

    @property
    def free(self) -> Window:
        """The coefficients of the whole space that boundary data leave free, a box."""
        low, high = ([name in self.dirichlet for name in FACE_NAMES[side::2]] for side in (0, 1))
        u, v, w = (slice(int(a), n - int(b)) for a, b, n in zip(low, high, self.whole.shape, strict=True))
        return u, v, w

    @property
    def window(self) -> Window:
        """The free coefficients that are this process's own, in its arrays."""
        u, v, w = self.free
        return _common(self.owned[self.comm.rank], u, self.rows.start), v, w

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
        return slice(*self.starts[self.comm.rank : self.comm.rank + 2])

    @property
    def columns(self) -> slice:
        """Of the free functions of v, those of the columns that this process gets from `to_columns`."""
        return slice(*self.column_starts[self.comm.rank : self.comm.rank + 2])

    def shared(self, value: Any) -> list[Any]:
        """Return the value of every process, in the order of their ranks."""
        found: list[Any] = self.comm.allgather(value)
        return found

    def total(self, value: Any) -> Any:
        """Return the sum of the values of all processes, the same on each."""
        return sum(self.shared(value))

    def traffic(self) -> Counter[str]:
        """Return how many bytes all processes have sent so far, by what for."""
        return sum(self.shared(self.sent), Counter())

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
        others = [rank for rank in range(self.comm.size) if rank != self.comm.rank]
        own = [(rank, _common(self.owned[self.comm.rank], self.kept[rank], self.rows.start)) for rank in others]
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
        if self.comm.size == 1:
            return own
        counts = self.shared(own.shape[1])
        whole = np.empty((len(own), sum(counts), *own.shape[2:]))
        self.sent["gather"] += own.nbytes * (self.comm.size - 1)
        for part, result in zip(own, whole, strict=True):
            self.comm.Allgatherv(np.ascontiguousarray(part), (result, [n * result[0].size for n in counts]))
        return whole

    def to_columns(self, x: Any) -> Any:
        """Return (m_u, columns, m_w), of all free rows, from own free rows (rows, m_v, m_w)."""
        if self.comm.size == 1:
            return x
        columns = self.column_starts[1:-1]
        parts = np.split(x, columns, axis=1)
        result = np.empty((self.starts[-1], parts[self.comm.rank].shape[1], x.shape[2]))
        sizes = [part.size for part in parts]
        self.comm.Alltoallv((np.concatenate(parts, axis=None), sizes), (result, np.diff(self.starts) * result[0].size))
        self.sent["transposition"] += 8 * (x.size - sizes[self.comm.rank])
        return result

    def to_rows(self, x: Any) -> Any:
        """Invert `to_columns`."""
        if self.comm.size == 1:
            return x
        height, widths = int(np.diff(self.starts)[self.comm.rank]), np.diff(self.column_starts)
        result, sizes = np.empty(height * int(widths.sum()) * x.shape[2]), height * widths * x.shape[2]
        self.comm.Alltoallv((x, np.diff(self.starts) * x[0].size), (result, sizes))
        self.sent["transposition"] += 8 * (x.size - height * x[0].size)
        parts = zip(np.split(result, np.cumsum(sizes)[:-1]), widths, strict=True)
        return np.concatenate([part.reshape(height, width, x.shape[2]) for part, width in parts], axis=1)

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
        if self.comm.rank not in busy:
            return None
        at = busy.index(self.comm.rank) + (1 if after else -1)
        return busy[at] if 0 <= at < len(busy) else None


def _common(a: slice, b: slice, origin: int = 0) -> slice:
    """Return what two ranges share, counted from an origin; an empty one within the first where that is nothing."""
    start = min(max(a.start, b.start), a.stop)
    return slice(start - origin, max(start, min(a.stop, b.stop)) - origin)


def _rows(part: slice) -> range:
    return range(part.start, part.stop)


def _is_only_continuous(knots: Array, degree: int) -> bool:
    inner = np.unique(knots, return_counts=True)[1][1:-1]
    return degree == 1 or bool(np.any(inner == degree))


def trial_space(
    volume: BSplineVolume, refine: int = 0, degree: int | None = None, dirichlet: Collection[str] = FACE_NAMES
) -> TrialSpace:
    """Return the trial space of a volume: every span halved `refine` times, in a degree, by default the map's own.

    It is as smooth as the map at the map's own knots, and as its degree allows at the knots that halving adds.
    Raises ValueError for numbers that are not whole, a negative `refine`, one that gives more than MOST_ELEMENTS, or a
    degree below 1 or above MOST_DEGREE.
    """
    if not isinstance(refine, int | np.integer):
        raise ValueError(f"refine must be a whole number, 0 or more, got {refine!r:.80}")
    if degree is not None and not isinstance(degree, int | np.integer):
        raise ValueError(f"degree must be a whole number, 1 or more, got {degree!r:.80}")
    if refine < 0:
        raise ValueError(f"refine must be 0 or more (each level halves every span), got {refine}")
    elements = math.prod((len(breakpoints(knots)) - 1) << int(refine) for knots in volume.knots)
    if elements > MOST_ELEMENTS:
        raise ValueError(f"refine {refine} gives {elements:.1e} elements, more than {MOST_ELEMENTS:.0e}: lower it")
    if degree is not None and not 1 <= degree <= MOST_DEGREE:
        raise ValueError(
            f"degree must be at least 1 and at most {MOST_DEGREE}, got {degree}; leave it out for the map's own degree"
        )
    degrees = volume.degrees if degree is None else (degree,) * 3
    rows = list(map(same_smoothness, volume.knots, volume.degrees, degrees))
    for _ in range(refine):
        rows = list(map(halved, rows))
    return TrialSpace(degrees, (rows[0], rows[1], rows[2]), dirichlet)


def embedded(coefficients: Array, degrees: tuple[int, int, int], knots: Knots, space: TrialSpace) -> Array:
    """Return the coefficients in `space` of a spline given in a smaller space of the same degrees; exact.

    Of a slab they are those of its rows.
    Raises ValueError where the smaller space is not contained in the larger.
    """
    try:
        if degrees != space.degrees:
            raise ValueError("other degrees")
        for axis, (own, wanted) in enumerate(zip(knots, space.whole.knots, strict=True)):
            rows = space.rows if axis == 0 else slice(None)
            coefficients = apply_along(insertion_into(own, degrees[axis], wanted)[rows], coefficients, axis)
    except ValueError as error:
        raise ValueError(
            f"start: its space is not contained in the trial space ({error}); refine it by halving, same degree"
        ) from None
    return coefficients


def same_smoothness(knots: Array, old: int, new: int) -> Array:
    """Return a knot vector of degree `new` on the same breakpoints, as smooth at each as degree `old` was."""
    values, repeats = np.unique(knots, return_counts=True)
    repeats = np.maximum(1, repeats + new - old)  # smoothness = degree - multiplicity
    repeats[[0, -1]] = new + 1
    return np.repeat(values, repeats)


def longest_edge(volume: BSplineVolume, space: TrialSpace) -> float:
    """h: the longest straight distance between neighbouring corners of the mapped elements, in the volume's units."""
    u, v, w = space.breaks
    longest = 0.0
    for start in range(0, len(u) - 1, LAYERS):
        corners = volume.grid(u[start : start + LAYERS + 1], v, w)  # (LAYERS + 1, e_v + 1, e_w + 1, 3)
        edges = (np.diff(corners, axis=a) for a in range(3))
        longest = max(longest, *(float(np.einsum("...i,...i->...", edge, edge).max()) for edge in edges))
    return max(space.shared(longest**0.5))
