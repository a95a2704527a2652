"""Defines PatchSolids: the solid that each patch of a body belongs to, which has a material and a name of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import IntArray, Mask, listed
from ..display import Brief


@dataclass(frozen=True, eq=False, repr=False)
class PatchSolids(Brief):
    """The solids of a body: a number for each patch, and their names.

    Parameters
    ----------
    numbers : (patches,) array of int
        The solid of each patch, from 0 on; left out where all patches are of one.
    names : tuple of str
        Of the solids, "" of one that has none; left out where none has. Solids of equal names have equal materials.

    Raises
    ------
    ValueError
        For numbers that are not whole or negative, and for fewer names than solids.
    """

    numbers: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        numbers = np.asarray(self.numbers)
        if numbers.ndim != 1 or (numbers.size and (numbers.dtype.kind not in "iu" or numbers.min() < 0)):
            raise ValueError("the solids of patches must be whole numbers from 0 on, one a patch")
        object.__setattr__(self, "numbers", numbers.astype(np.int64))
        object.__setattr__(self, "names", tuple(self.names))
        if self.names and len(self.names) <= numbers.max(initial=0):
            raise ValueError(f"there is a solid {numbers.max()}, but the solids have {len(self.names)} names")

    @classmethod
    def of(cls, given: "PatchSolids | Sequence[str] | ArrayLike", count: int) -> "PatchSolids":
        """Return the solids of so many patches, given as such, or as the name or the number of each patch's solid.

        Raises ValueError for other numbers of patches, and as the class does.
        """
        found = given if isinstance(given, cls) else cls._of_each(np.asarray(given))
        if not len(found.numbers):
            return cls(np.zeros(count, dtype=np.int64), found.names)
        if len(found.numbers) != count:
            raise ValueError(f"solids are given of {len(found.numbers)} patches: the body has {count}")
        return found

    @classmethod
    def _of_each(cls, given: NDArray[Any]) -> "PatchSolids":
        """Return the solids from the name or the number of each patch's solid."""
        if given.dtype.kind != "U":
            return cls(given)
        names = list(dict.fromkeys(given.tolist()))
        return cls(np.array([names.index(name) for name in given.tolist()]), tuple(names))

    @property
    def is_plain(self) -> bool:
        """Return whether all patches are of one solid without a name."""
        return not any(self.names) and not self.numbers.any()

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Return the names of all solids; "solid2" is the second one where it has none."""
        named = dict(enumerate(self.names))
        count = max(len(self.names), 1 + int(self.numbers.max(initial=0)))
        return tuple(named.get(number) or f"solid{number + 1}" for number in range(count))

    @property
    def are_several(self) -> bool:
        """Return whether the patches belong to more than one solid."""
        return bool((self.numbers != self.numbers[:1]).any())

    @property
    def of_patches(self) -> list[str]:
        """Return the name of each patch's solid."""
        return np.array(self.labels, dtype=object)[self.numbers].tolist()

    def has(self, name: str) -> Mask:
        """Return which of the patches belong to solids of a name. Raises ValueError for a name that there is not."""
        if name not in self.labels:
            raise ValueError(f"there is no solid {name!r}: the body has {self.told}")
        return np.isin(self.numbers, [number for number, label in enumerate(self.labels) if label == name])

    @property
    def told(self) -> str:
        """Return the names of the solids as text."""
        return listed(list(dict.fromkeys(self.labels)), 12)
