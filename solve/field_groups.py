"""Defines FieldGroup: functions on patches of equal degrees, knots and laws as one array, evaluated at once."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from numbers import Real
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body
from parameterize.spline.patch_groups import PatchGroup
from parameterize.spline.spline_stack import SplineStack

from .field import FieldOnBody, Points, SplineField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.hooke import Hooke

OF_PATCHES = {"prefix", "data", "faces", "conditions", "dirichlet"}  # of problems whose law may yet be the same


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
    states : int
        Number of the columns before it that are internal variables of the law.
    gradients : SplineStack, optional
        The gradients in space that quantities take, three columns a component; by default those of the functions.
    """

    numbers: IntArray
    maps: SplineStack
    values: SplineStack
    problem: BoundaryValueProblem | None
    has_pressure: bool = False
    states: int = 0
    gradients: SplineStack | None = None

    def __len__(self) -> int:
        return len(self.numbers)

    def take(self, rows: IntArray | slice) -> "FieldGroup":
        """Return some of the patches. rows: their places in the group."""
        maps, values = self.maps.take(rows), self.values.take(rows)
        gradients = None if self.gradients is None else self.gradients.take(rows)
        return replace(self, numbers=self.numbers[rows], maps=maps, values=values, gradients=gradients)

    def function_on(self, u: Array, v: Array, w: Array) -> Array:
        """Return the functions (k, len(u), len(v), len(w), c) on a tensor grid: their components alone."""
        values = self.values.grid(u, v, w)
        return values[..., : values.shape[-1] - self.more]

    @property
    def more(self) -> int:
        """Return the number of columns of a state and a pressure."""
        return self.states + self.has_pressure

    def points_on(self, u: Array, v: Array, w: Array) -> Points:
        """Return the points (3, k, len(u), len(v), len(w)) of the patches on a tensor grid of parameters."""
        return Points.of(np.ascontiguousarray(np.moveaxis(self.maps.grid(u, v, w), -1, 0)), (u, v, w))


def groups_of(
    function: FieldOnBody, body: Body | None = None, problems: Sequence[BoundaryValueProblem] = ()
) -> tuple[FieldGroup, ...]:
    """Return the patches of a function on a body in groups. Raises ValueError where the body is unknown.

    body: by default that of the function. problems: of the patches, by default those that the function knows.
    """
    glued, patches = body or function.on_body, function.patches
    known: Sequence[BoundaryValueProblem | None]
    known = problems or [getattr(patch, "problem", None) for patch in patches]
    return tuple(group for own in glued.groups for group in _divided(own, patches, known))


def _divided(
    maps: PatchGroup, patches: Sequence[SplineField], problems: Sequence[BoundaryValueProblem | None]
) -> list[FieldGroup]:
    """Return the groups of equal functions and laws among patches with maps of equal degrees and knots."""
    members: dict[Any, list[int]] = defaultdict(list)
    laws = _laws([problems[number] for number in maps.numbers.tolist()])
    for row, (number, law) in enumerate(zip(maps.numbers.tolist(), laws, strict=True)):
        own = patches[number]
        parts = own.pressure is None, own.state is None
        members[own.degrees, *parts, *(knots.tobytes() for knots in own.knots), law].append(row)
    stack = maps.stack
    found = []
    for rows in members.values():
        numbers = maps.numbers[rows]
        own = [patches[number] for number in numbers.tolist()]
        values = SplineStack(own[0].degrees, own[0].knots, np.stack([patch.columns for patch in own]))
        problem, has_pressure = problems[int(numbers[0])], own[0].pressure is not None
        states = 0 if own[0].state is None else own[0].state.shape[-1]
        found.append(FieldGroup(numbers, stack.take(np.array(rows)), values, problem, has_pressure, states))
    return found


def _laws(problems: Sequence[BoundaryValueProblem | None]) -> Iterator[int]:
    """Yield the number of the law of each problem: laws are the same with equal numbers, laws of Hooke and other parts.

    A datum that is a field is another one on each patch.
    """
    numbers: dict[Any, int] = {}  # of laws, by their numbers and the identity of the rest
    known: dict[Any, int] = {}  # by the identity of all parts, which is found in no time
    for problem in problems:
        parts = () if problem is None else _parts(problem)
        identity = tuple(map(id, parts))
        if identity not in known:
            law = tuple(part if isinstance(part, Real | Hooke) else id(part) for part in parts)
            known[identity] = numbers.setdefault(law, len(numbers))
        yield known[identity]


def _parts(problem: BoundaryValueProblem) -> tuple[Any, ...]:
    """Return what the law of a problem consists of."""
    own = vars(problem)
    entries = chain.from_iterable(datum.entries for datum in problem.data.values())
    return (*(value for name, value in own.items() if name not in OF_PATCHES), *entries)
