"""Defines PatchGroup: patches of equal degrees and knots as one array, over which work goes at once.

A hexahedral mesh of thousands of patches is one group, or a few; one cube is a group of one patch.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, IntArray, Knots, Mask
from .rational import Orders, homogeneous
from .spline_stack import SplineStack
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

    def rows(self, rows: slice | IntArray | Mask) -> "PatchGroup":
        """Return some of the patches, by their places in the group."""
        weights = None if self.weights is None else self.weights[rows]
        return replace(self, numbers=self.numbers[rows], control_points=self.control_points[rows], weights=weights)

    def divided(self, most: int) -> Iterator["PatchGroup"]:
        """Yield the group in parts of at most so many patches."""
        for begin in range(0, len(self), most):
            yield self.rows(slice(begin, begin + most))

    @property
    def coefficients(self) -> Array:
        """Return the control points (k, n_u, n_v, n_w, 3), of rational patches homogeneous, (.., 4)."""
        return self.control_points if self.weights is None else self.homogeneous

    @property
    def homogeneous(self) -> Array:
        """Return the homogeneous coefficients (k, n_u, n_v, n_w, 4); weights are 1 where there are none."""
        ones = np.ones(self.control_points.shape[:4])
        return homogeneous(self.control_points, ones if self.weights is None else self.weights)

    @property
    def stack(self) -> SplineStack:
        """Return the maps as splines without numbers."""
        return SplineStack(self.degrees, self.knots, self.coefficients, is_rational=self.weights is not None)

    def at(self, places: IntArray, parameters: ArrayLike) -> Array:
        """Return F (m, 3) at parameters (m, 3) of the patches at places (m,) of the group."""
        return self.stack.at(places, parameters)

    def jacobian(self, places: IntArray, parameters: ArrayLike) -> Array:
        """Return J[i, a, b] = dF_a / du_b (m, 3, 3) at parameters (m, 3) of the patches at places (m,)."""
        return self.stack.slopes_at(places, parameters)

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike, derivative: Orders = (0, 0, 0)) -> Array:
        """Return F or one of its partial derivatives on a tensor grid: (k, len(u), len(v), len(w), 3)."""
        return self.stack.on_grid((u, v, w), [derivative])[0]

    def grid_jacobian(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the Jacobian on a tensor grid: (k, len(u), len(v), len(w), 3, 3), last index the direction."""
        return self.stack.grid_slopes(u, v, w)


def group_of(patch: BSplineVolume) -> PatchGroup:
    """Return the group of one patch."""
    return _group([patch], [0])


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
