"""Puts the patches of one shape into one array, so that a body of thousands of patches costs no more than its points.

Patches of equal degrees and equal numbers of functions are a group: their coefficients are an array (patches, c, n_u,
n_v, n_w). The arrays of all groups are parts of one array without dimensions, in which a patch has (c, n_u, n_v, n_w),
so that spreading a vector to the patches and collecting integrals are one pass over numbers. Matrices of a group have a
leading dimension of patches, too (`stack.PatchStack`), and compiled kernels run over it. A body of one patch is a group
of one.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array, IntArray

from .space import TrialSpace


@dataclass(frozen=True)
class CoefficientLayout:
    """Say where the coefficients of each patch stand among those of a body.

    shapes: (n_u, n_v, n_w) of each patch. groups: the numbers of the patches of each group, in ascending order.
    """

    shapes: tuple[tuple[int, ...], ...]
    groups: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, spaces: Sequence[TrialSpace]) -> "CoefficientLayout":
        """Return the layout of patches with the given spaces."""
        found: dict[Any, list[int]] = {}
        for number, space in enumerate(spaces):
            found.setdefault((space.degrees, space.shape), []).append(number)
        return cls(tuple(space.shape for space in spaces), tuple(map(tuple, found.values())))

    @cached_property
    def starts(self) -> IntArray:
        """Return the place of each patch's first coefficient, and the number of all coefficients, (patches + 1,)."""
        sizes, order = np.prod(self.shapes, axis=1), np.concatenate(self.groups)
        starts = np.empty(len(sizes) + 1, dtype=np.int64)
        ends = np.cumsum(sizes[order])
        starts[order], starts[-1] = ends - sizes[order], ends[-1]
        return starts

    @cached_property
    def places(self) -> tuple[IntArray, IntArray]:
        """Return the group (patches,) of each patch, and its place (patches,) there."""
        of, place = np.empty((2, len(self.shapes)), dtype=np.int64)
        for number, group in enumerate(self.groups):
            of[list(group)], place[list(group)] = number, np.arange(len(group))
        return of, place

    def empty(self, components: int) -> "OnPatches":
        """Return zero on all patches."""
        return OnPatches(self, components, np.zeros(components * self.starts[-1]))

    def joined(self, parts: Sequence[Array]) -> "OnPatches":
        """Return arrays (c, n_u, n_v, n_w) of the patches as parts of one array, the same ones where they are."""
        if isinstance(parts, OnPatches) and parts.layout == self:
            return parts
        return OnPatches(self, len(parts[0]), self._row(parts))

    def numbers(self, of_patches: Sequence[IntArray], components: int, step: int) -> IntArray:
        """Return the number of each entry of an array of all patches, `step` more for each component.

        of_patches: the numbers (n_u, n_v, n_w) of the coefficients of each patch.
        """
        more = step * np.arange(components)[:, None]
        return self._row([own.ravel() + more for own in of_patches])

    def _row(self, parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate([parts[number].ravel() for group in self.groups for number in group])


@dataclass(frozen=True, eq=False)
class OnPatches(Sequence[Array]):
    """Hold an array (c, n_u, n_v, n_w) for each patch of a body, all of them parts of one array `flat`.

    They add up, and are multiplied by numbers, as vectors do.
    """

    layout: CoefficientLayout
    components: int
    flat: Array
    __array_ufunc__ = None  # a number of NumPy times this is __rmul__, too

    def __len__(self) -> int:
        return len(self.layout.shapes)

    def __add__(self, other: "OnPatches") -> "OnPatches":
        return replace(self, flat=self.flat + other.flat)

    def __sub__(self, other: "OnPatches") -> "OnPatches":
        return replace(self, flat=self.flat - other.flat)

    def __rmul__(self, factor: float) -> "OnPatches":
        return replace(self, flat=factor * self.flat)

    @overload
    def __getitem__(self, number: int) -> Array: ...
    @overload
    def __getitem__(self, number: slice) -> list[Array]: ...
    def __getitem__(self, number: int | slice) -> Array | list[Array]:
        """Return the array of a patch, a part of `flat`."""
        if isinstance(number, slice):
            return [self[i] for i in range(len(self))[number]]
        shape = self.layout.shapes[number]  # raises IndexError, which ends a loop over the patches
        return self._from(self.layout.starts[:-1][number], (self.components, *shape))

    @property
    def in_groups(self) -> Iterator[Array]:
        """Yield the array (patches, c, n_u, n_v, n_w) of each group, a part of `flat`."""
        for group in self.layout.groups:
            shape = (len(group), self.components, *self.layout.shapes[group[0]])
            yield self._from(self.layout.starts[group[0]], shape)

    def of(self, patches: IntArray) -> Array:
        """Return a copy (k, c, n_u, n_v, n_w) of the arrays of some patches of one group."""
        group, places = self._of_group(patches)
        return group[places]

    def add(self, patches: IntArray, values: Array) -> None:
        """Add to the arrays of some patches of one group values (k, c, n_u, n_v, n_w)."""
        group, places = self._of_group(patches)
        group[places] += values

    def _of_group(self, patches: IntArray) -> tuple[Array, IntArray]:
        groups, places = self.layout.places
        return list(self.in_groups)[groups[patches[0]]], places[patches]

    def _from(self, start: int, shape: tuple[int, ...]) -> Array:
        first = self.components * start
        return self.flat[first : first + math.prod(shape)].reshape(shape)
