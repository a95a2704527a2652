"""Defines Sheets: the directions of patches that interfaces tie, which have the same breakpoints in every space.

An interface ties the directions along it. All directions that are tied to one another, through any number of patches,
are a sheet: a new knot of one of them runs through all of these patches.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import IntArray, Mask
from .body import Body, numbers_of_classes
from .interface_rows import kinds


@dataclass(frozen=True, eq=False)
class Sheets:
    """Say to which sheet each direction of each patch belongs.

    numbers: (patches, 3), the number of the sheet. flipped: (patches, 3), whether the direction runs against its sheet,
    which runs as its first direction. mirrored: (sheets,), whether a sheet is tied to itself in reverse, as across a
    Moebius ring: its breakpoints are those of both ways. first: (sheets,), the number 3 * patch + direction of the
    first direction.
    """

    numbers: IntArray
    flipped: Mask
    mirrored: Mask
    first: IntArray

    def __len__(self) -> int:
        return len(self.first)

    @classmethod
    def of(cls, body: Body) -> "Sheets":
        """Return the sheets of a body."""
        rows, count, pairs = body.interface_rows, 3 * len(body), [np.empty((2, 0), dtype=np.int64)]
        for kind, members in kinds(rows, np.zeros(len(body), dtype=np.int64)):
            for own, other, is_flipped in kind.directions:
                one, two = 3 * rows[members][:, [0, 2]].T + np.array([[own], [other]])
                there, back = (two + count, two) if is_flipped else (two, two + count)
                pairs += [np.stack([one, there]), np.stack([one + count, back])]
        ways = numbers_of_classes(2 * count, np.concatenate(pairs, axis=1))  # of each direction, and of its reverse
        forth, back = ways[:count], ways[count:]
        numbers = np.unique(np.minimum(forth, back), return_inverse=True)[1]
        first = np.unique(numbers, return_index=True)[1]
        flipped = forth != forth[first][numbers]
        return cls(numbers.reshape(-1, 3), flipped.reshape(-1, 3), (forth == back)[first], first)
