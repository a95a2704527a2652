"""Defines PatchGroup: patches of equal degrees and knots as one array, over which work goes at once.

A hexahedral mesh of thousands of patches is one group, or a few; one cube is a group of one patch.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray, Knots
from .volume import BSplineVolume


@dataclass(frozen=True, eq=False)
class PatchGroup:
    """Patches of equal degrees and knots, all of them polynomial or all rational.

    Attributes
    ----------
    numbers : (k,) array of int
        Of the patches in their body, ascending.
    degrees, knots
        Of all patches, as of `BSplineVolume`.
    control_points : (k, n_u, n_v, n_w, 3) array
        In the user's units.
    weights : (k, n_u, n_v, n_w) array, optional
        Of rational patches.
    """

    numbers: IntArray
    degrees: tuple[int, int, int]
    knots: Knots
    control_points: Array
    weights: Array | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the number of control points of a patch per direction."""
        _, n_u, n_v, n_w, _ = self.control_points.shape
        return n_u, n_v, n_w

    def __len__(self) -> int:
        return len(self.numbers)


def groups_of(patches: Sequence[BSplineVolume]) -> tuple[PatchGroup, ...]:
    """Return the groups of patches, in the order of their first patches."""
    members = defaultdict(list)
    for number, patch in enumerate(patches):
        rows = tuple(row.tobytes() for row in patch.knots)
        members[patch.degrees, rows, patch.weights is None].append(number)
    return tuple(_group(patches, numbers) for numbers in members.values())


def _group(patches: Sequence[BSplineVolume], numbers: list[int]) -> PatchGroup:
    own = [patches[number] for number in numbers]
    points = np.stack([patch.control_points for patch in own])
    weights = None if own[0].weights is None else np.stack([np.asarray(patch.weights) for patch in own])
    return PatchGroup(np.array(numbers), own[0].degrees, own[0].knots, points, weights)
