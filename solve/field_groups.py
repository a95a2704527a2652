"""Defines FieldGroup: functions on patches of equal degrees, knots and laws as one array, evaluated at once."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.patch_groups import PatchGroup
from parameterize.spline.spline_stack import SplineStack

from .field import FieldOnBody, Points, SplineField
from .forms.boundary_value_problem import BoundaryValueProblem

OF_PATCHES = ("prefix", "data", "faces", "conditions", "dirichlet")  # of problems whose law may yet be the same


@dataclass(frozen=True, eq=False)
class FieldGroup:
    """Hold k patches, the functions on them, and their law.

    Attributes
    ----------
    numbers : (k,) array of int
        Of the patches in their body, ascending.
    maps, values : SplineStack
        Of k splines each; functions of one component have one column.
    problem : BoundaryValueProblem or None
        That of the first patch, whose law is the law of all; None where it is unknown.
    has_pressure : bool
        Whether the last column is a pressure.
    """

    numbers: IntArray
    maps: SplineStack
    values: SplineStack
    problem: BoundaryValueProblem | None
    has_pressure: bool = False

    def __len__(self) -> int:
        return len(self.numbers)

    def take(self, rows: IntArray | slice) -> "FieldGroup":
        """Return some of the patches. rows: their places in the group."""
        return replace(self, numbers=self.numbers[rows], maps=self.maps.take(rows), values=self.values.take(rows))

    def points_on(self, u: Array, v: Array, w: Array) -> Points:
        """Return the points (3, k, len(u), len(v), len(w)) of the patches on a tensor grid of parameters."""
        return Points.of(np.ascontiguousarray(np.moveaxis(self.maps.grid(u, v, w), -1, 0)), (u, v, w))


def groups_of(function: FieldOnBody) -> tuple[FieldGroup, ...]:
    """Return the patches of a function on a body in groups. Raises ValueError where the body is unknown."""
    return tuple(group for own in function.on_body.groups for group in _divided(own, function.patches))


def _divided(maps: PatchGroup, patches: Sequence[SplineField]) -> list[FieldGroup]:
    """Return the groups of equal functions and laws among patches with maps of equal degrees and knots."""
    members: dict[Any, list[int]] = defaultdict(list)
    for row, number in enumerate(maps.numbers.tolist()):
        own = patches[number]
        members[own.degrees, own.pressure is None, *(knots.tobytes() for knots in own.knots), *_law_of(own)].append(row)
    stack = SplineStack.of_maps(maps)
    return [_group(maps.numbers[rows], stack.take(np.array(rows)), patches) for rows in members.values()]


def _group(numbers: IntArray, maps: SplineStack, patches: Sequence[SplineField]) -> FieldGroup:
    own = [patches[number] for number in numbers.tolist()]
    values = SplineStack(own[0].degrees, own[0].knots, np.stack([patch.columns for patch in own]))
    return FieldGroup(numbers, maps, values, getattr(own[0], "problem", None), own[0].pressure is not None)


def _law_of(field: SplineField) -> tuple[Any, ...]:
    """Return what the laws on two patches have in common if they are the same: numbers, and the identity of the rest.

    A datum that is a field is another one on each patch.
    """
    problem: BoundaryValueProblem | None = getattr(field, "problem", None)
    if problem is None:
        return ()
    own = (value for name, value in vars(problem).items() if name not in OF_PATCHES)
    entries = (id(entry) for datum in problem.data.values() for entry in datum.entries)
    return (*(value if isinstance(value, Real) else id(value) for value in own), *entries)
