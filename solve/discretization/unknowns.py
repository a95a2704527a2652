"""Numbers the unknowns of a body: the coefficients of all patches that boundary data leave free, shared ones once.

A vector of unknowns is spread to the coefficients of the patches, and integrals over the patches are collected to a
vector: with Q the matrix of the first, the matrix of a body is A = Q^T (matrices of the patches) Q.
"""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import shared_numbers
from parameterize.spline.interface import Interface

from .groups import CoefficientLayout, OnPatches
from .processes import Processes
from .space import TrialSpace


class Unknowns(Protocol):
    """Describe the unknowns of a body; a vector has one row of them for each component.

    Where processes share the body, each has some of its patches, or some rows of its only patch, and a vector has the
    unknowns that its process owns. All processes call each method.
    """

    @property
    def processes(self) -> Processes:
        """Return the processes that share the body."""

    @property
    def patches(self) -> Sequence[int]:
        """Return the numbers of the patches of this process."""

    @property
    def count(self) -> int:
        """Return the number of coefficients of one component, fixed ones included, shared ones once."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the shape of one component of a vector."""

    def spread(self, x: Array) -> Sequence[Array]:
        """Return the coefficients (c, n_u, n_v, n_w) of each patch of a vector (c, ...), zero where they are fixed."""

    def collect(self, integrals: Sequence[Array]) -> Array:
        """Return the vector (c, ...) of integrals (c, n_u, n_v, n_w) over each patch, copies of an unknown added."""

    def assembled(self, integrals: Sequence[Array]) -> Array:
        """Return the integrals (c, ...) of all coefficients, fixed ones included, copies of a coefficient added."""

    def chosen(self, coefficients: Sequence[Array]) -> Array:
        """Return the vector (c, ...) of the coefficients (c, n_u, n_v, n_w) of a function on each patch."""

    def completed(self, known: Sequence[Array]) -> Sequence[Array]:
        """Return all fixed coefficients of each patch from those that its own data fix, (c, n_u, n_v, n_w) each."""

    def on_fixed(self, integrals: Sequence[Array]) -> list[Array]:
        """Return integrals (c, n_u, n_v, n_w) over each patch, those of a fixed coefficient summed over all patches.

        The sum stands in the first patch whose data fix the coefficient, the other patches have zero.
        """

    @property
    def place(self) -> slice:
        """Return where the vector of this process is in `joined`, along its second dimension."""

    def joined(self, x: Array) -> Array:
        """Return the vectors (c, ...) of all processes, one after another."""

    def whole(self, coefficients: Sequence[Array]) -> list[Array]:
        """Return the coefficients (c, n_u, n_v, n_w) of every patch of the body from those of this process."""

    def agreed(self) -> AbstractContextManager[None]:
        """Return a context that raises an error of one process on all; one patch agrees where data are evaluated."""


@dataclass(frozen=True, eq=False)
class Window:
    """Number the unknowns of one patch, or of the slab of a process: a box of its coefficients."""

    space: TrialSpace
    patches: Sequence[int] = (0,)

    @property
    def processes(self) -> Processes:
        """Return the processes that share the patch."""
        return self.space

    @property
    def count(self) -> int:
        """Return the number of coefficients of one component, fixed ones included."""
        return self.space.dofs

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the number of free coefficients of this process in each direction."""
        return tuple(part.stop - part.start for part in self.space.window)

    def spread(self, x: Array) -> list[Array]:
        """Return the coefficients (.., n_u, n_v, n_w) of a vector (.., m_u, m_v, m_w), zero where they are fixed."""
        full = np.zeros((*x.shape[:-3], *self.space.shape))
        full[..., *self.space.window] = x
        self.space.fill(full)
        return [full]

    def collect(self, integrals: Sequence[Array]) -> Array:
        """Return the vector (.., m_u, m_v, m_w) of integrals (.., n_u, n_v, n_w), whose copies on slabs are added."""
        (result,) = integrals
        self.space.add(result)
        return np.ascontiguousarray(result[..., *self.space.window])

    def assembled(self, integrals: Sequence[Array]) -> Array:
        """Return the integrals (c, n_u, n_v, n_w), with the parts of other processes."""
        (result,) = integrals
        self.space.add(result)
        return result

    def chosen(self, coefficients: Sequence[Array]) -> Array:
        """Return the vector (c, m_u, m_v, m_w) of the coefficients of a function."""
        (full,) = coefficients
        return np.ascontiguousarray(full[:, *self.space.window])

    def completed(self, known: Sequence[Array]) -> Sequence[Array]:
        """Return the known coefficients."""
        return list(known)

    def on_fixed(self, integrals: Sequence[Array]) -> list[Array]:
        """Return the integrals, with the parts of other processes."""
        return [self.assembled(integrals)]

    @property
    def place(self) -> slice:
        """Return the own rows of this process among all free rows."""
        return self.space.place

    def joined(self, x: Array) -> Array:
        """Return the free rows (c, m_u, ..) of all processes."""
        return self.space.gather(x)

    def whole(self, coefficients: Sequence[Array]) -> list[Array]:
        """Return the rows (c, n_u, n_v, n_w) of all processes."""
        (own,) = coefficients
        return [self.space.gather(own[:, self.space.own])]

    def agreed(self) -> AbstractContextManager[None]:
        """Return a context without effect."""
        return nullcontext()


@dataclass(frozen=True, eq=False)
class Glued:
    """Number the unknowns of patches that are glued along faces.

    spaces: those of the patches. numbers: for each patch the number (n_u, n_v, n_w) of each coefficient in the body.
    count: how many coefficients the body has. fixed: (size,), whether boundary data fix a coefficient: where it lies on
    a Dirichlet face of some patch. Here the size is the count; `parted.Parted` has some of the patches, and a smaller
    size.
    """

    spaces: tuple[TrialSpace, ...]
    numbers: tuple[IntArray, ...]
    count: int
    fixed: Mask

    @classmethod
    def of(cls, spaces: Sequence[TrialSpace], interfaces: Sequence[Interface]) -> "Glued":
        """Return the unknowns of patches with the given spaces and interfaces."""
        numbers, count = shared_numbers([space.shape for space in spaces], interfaces)
        fixed = np.zeros(count, dtype=bool)
        for space, own in zip(spaces, numbers, strict=True):
            if space.dirichlet:
                inner = np.zeros(own.shape, dtype=bool)
                inner[space.free] = True
                fixed[own[~inner]] = True
        return cls(tuple(spaces), numbers, count, fixed)

    @property
    def processes(self) -> Processes:
        """Return the only process."""
        return self.spaces[0]

    @property
    def patches(self) -> Sequence[int]:
        """Return the numbers of all patches."""
        return range(len(self.spaces))

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the number of free coefficients that this process owns."""
        return self.free.shape

    @property
    def of_body(self) -> "Glued":
        """Return the unknowns of the body that processes share."""
        return self

    @property
    def alone(self) -> "Glued":
        """Return the unknowns of the patches of this process, as if it were the only one."""
        return self

    @property
    def rows(self) -> slice | IntArray:
        """Return where the vector of `alone` stands in a vector of the body."""
        return slice(None)

    @property
    def own_rows(self) -> slice | IntArray:
        """Return where the vector of this process stands in a vector of the body."""
        return slice(None)

    def with_copies(self, x: Array) -> Array:
        """Return the vector (k, c) of `alone` that has the values of a vector (m, c)."""
        return x

    def without_copies(self, integrals: Array) -> Array:
        """Return the vector (m, c) of integrals (k, c) in the vector of `alone`, copies added."""
        return integrals

    @property
    def is_own(self) -> Mask | bool:
        """Return whether this process owns each coefficient."""
        return True

    @cached_property
    def free(self) -> IntArray:
        """Return the numbers (m,) of the coefficients in a vector."""
        return np.flatnonzero(~self.fixed & self.is_own)

    @cached_property
    def layout(self) -> CoefficientLayout:
        """Return where the coefficients of each patch stand in an array of all."""
        return CoefficientLayout.of(self.spaces)

    @cached_property
    def places(self) -> list[IntArray]:
        """Return for each patch the place (n_u, n_v, n_w) of each coefficient in a vector; its length for others."""
        place = np.full(len(self.fixed), self.shape[0])
        place[self.free] = np.arange(self.shape[0])
        return [place[own] for own in self.numbers]

    def fill(self, coefficients: Array) -> None:
        """Overwrite the copies among coefficients (c, size) by the values of their owners."""

    def add(self, integrals: Array) -> None:
        """Add to own integrals (c, size) those over the copies of other processes."""

    def spread(self, x: Array) -> OnPatches:
        """Return the coefficients (c, n_u, n_v, n_w) of each patch of a vector (c, m), zero where they are fixed."""
        every = np.zeros((len(x), len(self.fixed)))
        every[:, self.free] = x
        self.fill(every)
        return OnPatches(self.layout, len(x), every.ravel()[self._entries(len(x))])

    def collect(self, integrals: Sequence[Array]) -> Array:
        """Return the vector (c, m) of integrals (c, n_u, n_v, n_w) over each patch, copies added."""
        return np.take(self._added(integrals), self.free, axis=1)

    def assembled(self, integrals: Sequence[Array]) -> Array:
        """Return the integrals (c, size) of all coefficients, copies added."""
        sums = self._added(integrals)
        self.fill(sums)
        return sums

    def _added(self, integrals: Sequence[Array]) -> Array:
        """Return the integrals (c, size) of all coefficients; copies are added to own ones alone."""
        parts, size = self.layout.joined(integrals), len(self.fixed)
        counted = np.bincount(self._entries(parts.components), parts.flat, parts.components * size)
        sums = counted.astype(np.float64, copy=False).reshape(parts.components, size)
        self.add(sums)
        return sums

    def chosen(self, coefficients: Sequence[Array]) -> Array:
        """Return the vector (c, m) of the coefficients of a function that is continuous across interfaces."""
        parts = self.layout.joined(coefficients)
        every = np.zeros((parts.components, len(self.fixed)))
        every.ravel()[self._entries(parts.components)] = parts.flat
        return np.take(every, self.free, axis=1)

    def _entries(self, components: int) -> IntArray:
        """Return the place of each entry of an array of all patches in an array (c, size)."""
        if components not in self._known_entries:
            entries = self.layout.numbers(self.numbers, components, len(self.fixed))
            self._known_entries[components] = entries
        return self._known_entries[components]

    @cached_property
    def _known_entries(self) -> dict[int, IntArray]:
        return {}

    @cached_property
    def first_to_fix(self) -> list[Mask]:
        """Return for each patch the mask (n_u, n_v, n_w) of the coefficients that its data are the first to fix."""
        taken, found = np.zeros(len(self.fixed), dtype=bool), []
        for space, own in zip(self.spaces, self.numbers, strict=True):
            if not space.dirichlet:
                found.append(np.zeros(own.shape, dtype=bool))
                continue
            given = ~taken[own]
            given[space.free] = False
            places = np.flatnonzero(given)
            first = places[np.unique(own.flat[places], return_index=True)[1]]  # a patch may be glued to itself
            mask = np.zeros(own.size, dtype=bool)
            mask[first] = True
            taken[own.flat[first]] = True
            found.append(mask.reshape(own.shape))
        return found

    def completed(self, known: Sequence[Array]) -> Sequence[Array]:
        """Return the fixed coefficients (c, n_u, n_v, n_w) of each patch, zero elsewhere.

        A coefficient has the value of the first patch whose data fix it: other patches may touch a Dirichlet face along
        an edge only.
        """
        every = np.zeros((len(known[0]), len(self.fixed)))
        for space, own, is_first, values in zip(self.spaces, self.numbers, self.first_to_fix, known, strict=True):
            if space.dirichlet:
                every[:, own[is_first]] = values[:, is_first]
        self.add(every)  # others have zero
        self.fill(every)
        return OnPatches(self.layout, len(every), every.ravel()[self._entries(len(every))])

    def on_fixed(self, integrals: Sequence[Array]) -> list[Array]:
        """Return integrals of fixed coefficients, summed over all patches, in the first patch whose data fix them."""
        total = self.assembled(integrals)
        return [total[:, own] * is_first for own, is_first in zip(self.numbers, self.first_to_fix, strict=True)]

    @property
    def place(self) -> slice:
        """Return all of a vector."""
        return slice(None)

    def joined(self, x: Array) -> Array:
        """Return the vector."""
        return x

    def whole(self, coefficients: Sequence[Array]) -> list[Array]:
        """Return the coefficients."""
        return list(coefficients)

    def agreed(self) -> AbstractContextManager[None]:
        """Return a context without effect."""
        return nullcontext()


def unknowns_of(spaces: Sequence[TrialSpace], interfaces: Sequence[Interface]) -> Window | Glued:
    """Return the unknowns of a body with the given spaces of its patches."""
    if len(spaces) == 1 and not interfaces:
        return Window(spaces[0])
    return Glued.of(spaces, interfaces)
