"""Defines Parted: the unknowns of the patches that a process of an MPI job has, and its messages to the others.

Each process has some patches of a body (docs/mpi.md). A coefficient on interfaces between patches of several processes
is owned by the first of them; the others have copies of it. Integrals over copies are added by the owner, in the order
of the processes, and what it finds is sent back to all: copies are equal to the last bit.
"""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body

from .groups import CoefficientLayout, OnPatches
from .partition import partition
from .processes import Messenger, agreed
from .space import TrialSpace
from .unknowns import Glued, Window, unknowns_of

Link = tuple[int, IntArray]  # another process, and the numbers of some coefficients here


@dataclass(frozen=True, eq=False, kw_only=True)
class Parted(Glued):
    """Number the unknowns of the patches of one process; the attributes of Glued are those of these patches.

    whole_body: the unknowns of the body. owners: (patches,), the process of each patch of the body. messenger: passes
    messages. held: (size,), the number of each coefficient in the body. own: the other processes with copies of own
    coefficients. copies: the owners of the copies here.
    """

    whole_body: Glued
    owners: IntArray
    messenger: Messenger
    held: IntArray
    own: Sequence[Link]
    copies: Sequence[Link]

    @classmethod
    def among(cls, comm: object, whole: Glued, owners: IntArray) -> "Parted":
        """Return the unknowns of this process from those of the body and the process (patches,) of each patch."""
        messenger = Messenger(comm)
        holds = np.zeros((int(owners.max()) + 1, whole.count), dtype=bool)
        for numbers, owner in zip(whole.numbers, owners, strict=True):
            holds[owner, numbers] = True
        owner_of, rank = holds.argmax(axis=0), messenger.rank
        here, place = np.flatnonzero(owners == rank), np.cumsum(holds[rank]) - 1
        others = [other for other in range(len(holds)) if other != rank]
        own = [(other, place[np.flatnonzero(holds[other] & (owner_of == rank))]) for other in others]
        copies = [(other, place[np.flatnonzero(holds[rank] & (owner_of == other))]) for other in others]
        return cls(
            spaces=tuple(whole.spaces[i] for i in here),
            numbers=tuple(place[whole.numbers[i]] for i in here),
            count=whole.count,
            fixed=whole.fixed[holds[rank]],
            whole_body=whole,
            owners=owners,
            messenger=messenger,
            held=np.flatnonzero(holds[rank]),
            own=[link for link in own if len(link[1])],
            copies=[link for link in copies if len(link[1])],
        )

    @property
    def processes(self) -> Messenger:
        """Return the processes that share the body."""
        return self.messenger

    @property
    def patches(self) -> Sequence[int]:
        """Return the numbers of the patches of this process."""
        return self._patches_of(self.messenger.rank)

    def _patches_of(self, process: int) -> list[int]:
        return np.flatnonzero(self.owners == process).tolist()

    @property
    def is_own(self) -> Mask:
        """Return whether this process owns each coefficient."""
        found = np.ones(len(self.fixed), dtype=bool)
        for _, places in self.copies:
            found[places] = False
        return found

    @cached_property
    def first_to_fix(self) -> list[Mask]:
        """Return for each patch the mask of the coefficients that its data are the first to fix in the body."""
        return [self.whole_body.first_to_fix[number] for number in self.patches]

    @property
    def of_body(self) -> Glued:
        """Return the unknowns of the body that processes share."""
        return self.whole_body

    @cached_property
    def alone(self) -> Glued:
        """Return the unknowns of the patches of this process, as if it were the only one."""
        return Glued(self.spaces, self.numbers, len(self.fixed), self.fixed)

    @property
    def rows(self) -> IntArray:
        """Return where the vector of `alone` stands in a vector of the body."""
        return np.searchsorted(self.whole_body.free, self.held[self.alone.free])

    @property
    def own_rows(self) -> IntArray:
        """Return where the vector of this process stands in a vector of the body."""
        return np.searchsorted(self.whole_body.free, self.held[self.free])

    def with_copies(self, x: Array) -> Array:
        """Return the vector (k, c) of `alone` that has the values of a vector (m, c)."""
        every = np.zeros((x.shape[1], len(self.fixed)))
        every[:, self.free] = x.T
        self.fill(every)
        return np.ascontiguousarray(every[:, self.alone.free].T)

    def without_copies(self, integrals: Array) -> Array:
        """Return the vector (m, c) of integrals (k, c) in the vector of `alone`, copies added."""
        every = np.zeros((integrals.shape[1], len(self.fixed)))
        every[:, self.alone.free] = integrals.T
        self.add(every)
        return np.ascontiguousarray(every[:, self.free].T)

    def fill(self, coefficients: Array) -> None:
        """Overwrite the copies among coefficients (c, size) by the values of their owners."""
        for places, values in self._passed(coefficients, self.own, self.copies):
            coefficients[:, places] = values

    def add(self, integrals: Array) -> None:
        """Add to own integrals (c, size) those over the copies of other processes."""
        for places, values in self._passed(integrals, self.copies, self.own):
            integrals[:, places] += values

    def _passed(self, values: Array, sent: Sequence[Link], wanted: Sequence[Link]) -> list[tuple[IntArray, Array]]:
        """Return places here and the values (c, k) that other processes send for them; values (c, size) are sent."""
        received = [(rank, np.empty((len(values), len(places)))) for rank, places in wanted]
        self.messenger.exchange([(rank, np.take(values, places, axis=1)) for rank, places in sent], received)
        return [(places, part) for (_, places), (_, part) in zip(wanted, received, strict=True)]

    @property
    def place(self) -> slice:
        """Return where the vector of this process is in `joined`, along its second dimension."""
        counts = self.messenger.shared(self.shape[0])
        first = sum(counts[: self.messenger.rank])
        return slice(first, first + self.shape[0])

    def joined(self, x: Array) -> Array:
        """Return the vectors (c, m) of all processes, one after another."""
        counts = self.messenger.shared(x.shape[1])
        return np.stack([self.messenger.gather(row, counts) for row in x])

    def whole(self, coefficients: Sequence[Array]) -> list[Array]:
        """Return the coefficients (c, n_u, n_v, n_w) of every patch of the body from those of this process."""
        own, found = self.layout.joined(coefficients), [np.empty(0)] * len(self.owners)
        numbers = list(map(self._patches_of, range(int(self.owners.max()) + 1)))
        layouts = [CoefficientLayout.of([self.whole_body.spaces[number] for number in part]) for part in numbers]
        sizes = [own.components * int(layout.starts[-1]) for layout in layouts]
        each = np.split(self.messenger.gather(own.flat, sizes), np.cumsum(sizes)[:-1])
        for part, layout, flat in zip(numbers, layouts, each, strict=True):
            for number, values in zip(part, OnPatches(layout, own.components, flat), strict=True):
                found[number] = values
        return found

    def agreed(self) -> AbstractContextManager[None]:
        """Return a context that raises an error of one process on all."""
        return agreed(self.messenger.comm)


def shared_unknowns(body: Body, spaces: Sequence[TrialSpace], comm: object = None) -> Window | Glued:
    """Return the unknowns of the patches of this process; comm: an mpi4py communicator, None for a single process.

    Raises ValueError where a body of several patches has fewer than there are processes.
    """
    whole = unknowns_of(spaces, body.interfaces)
    count = getattr(comm, "size", 1)
    if count == 1 or not isinstance(whole, Glued):
        return whole
    if count > len(body):
        raise ValueError(f"patches: {len(body)}, processes: {count}; a process has one patch or more, start fewer")
    centres = np.stack([volume.control_points.reshape(-1, 3).mean(axis=0) for volume in body])
    weights = np.array([np.prod(space.shape) for space in spaces], dtype=np.float64)
    return Parted.among(comm, whole, partition(centres, weights, count))
