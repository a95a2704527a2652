"""Solves on the raised space, to see what a solution lacks: one degree more on the same spans, finer at patches' ends.

What the raised solution adds to a solution is its error, but for the error of the raised solution itself. That is
smaller by an order where the solution is smooth. Singular places are at edges of patches as a rule: at reentrant edges,
where materials meet, and around held faces. There the degree alone helps little. So spans at the ends of patches of
several spans are divided in two, and the outer half again: the space stays small, and has a quarter of the span there.
"""

from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import collocation

from ..discretization.slab import shared_space
from ..discretization.space import MOST_DEGREE, TrialSpace, of_each
from ..field import BodyField
from ..linear.nodal import nodes
from ..mixed import MixedSystem, build_mixed
from ..options import SolveOptions
from ..solution import Solution
from ..system import System, build
from .adjoint import adjoint
from .samples import Samples

LEFT = 0.01  # share of the residual that the iteration leaves: 1 % of what the raised solution adds, and less
ENDS = (0.25, 0.5)  # where a span at the end of a patch is divided


@dataclass(frozen=True, eq=False)
class Raised:
    """Hold the solution on the raised space.

    system: that of the space. solution: with the balance of its loads, without errors and notices.
    """

    system: System
    solution: Solution

    @classmethod
    def of(cls, system: System, solution: Solution, options: SolveOptions) -> "Raised":
        """Return the raised solution; the iteration starts at a solution of a system.

        options: those of the system's solve. Raises ValueError where `why_not_raised` says why.
        """
        if why := why_not_raised(system):
            raise ValueError(f"there is no raised space: {why}")
        higher = raised_system(system, options)
        return cls(higher, higher.continued(start_in(higher, solution), LEFT, options))

    def dual(self, samples: Samples) -> BodyField:
        """Return the adjoint of a functional in the raised space."""
        return adjoint(self.system, samples)


def why_not_raised(system: System) -> str:
    """Return why a system has no raised space; "" where it has one."""
    if max(max(patch.space.degrees) for patch in system.stated) >= MOST_DEGREE:
        return f"degree {MOST_DEGREE} is the highest one"
    return ""


def raised_system(system: System, options: SolveOptions) -> System:
    """Return the system of the same problem on the raised space."""
    comm = options.comm if system.body.is_single else None
    spaces = of_each(raised_space, [patch.space.whole for patch in system.stated])
    patches = [
        replace(patch, space=shared_space(space, comm)) for patch, space in zip(system.stated, spaces, strict=True)
    ]
    make = build_mixed if isinstance(system, MixedSystem) else build
    return make(system.body, system.problem, patches, options)


def raised_space(space: TrialSpace) -> TrialSpace:
    """Return the space of one degree more on the same spans, with those at the ends of patches divided."""
    u, v, w = (raised_knots(knots, degree) for knots, degree in zip(space.knots, space.degrees, strict=True))
    p, q, r = space.degrees
    return replace(space, degrees=(p + 1, q + 1, r + 1), knots=(u, v, w))


def raised_knots(knots: Array, degree: int) -> Array:
    """Return the knot vector of one degree more.

    Simple knots stay simple, so that there are hardly more functions; knots of less smoothness keep it. On a single
    span nothing is divided.
    """
    values, repeats = np.unique(knots, return_counts=True)
    repeats[(repeats > 1) | (degree == 1)] += 1
    row = np.repeat(values, repeats)
    if len(values) == 2:
        return row
    first, last = values[1] - values[0], values[-1] - values[-2]
    ends = [(values[0] + share * first, values[-1] - share * last) for share in ENDS]
    return np.sort(np.append(row, ends))


def start_in(system: System, field: BodyField) -> Array:
    """Return the vector (N,) of a system's space that has the values of a field at the Greville points."""
    alike: dict[Hashable, list[int]] = defaultdict(list)
    for number, (own, patch) in enumerate(zip(field.patches, system.stated, strict=True)):
        alike[patch.space.key, own.degrees, *(row.tobytes() for row in own.knots)].append(number)
    full: list[Any] = [None] * len(system.stated)
    pressure: list[Any] = [None] * len(system.stated)
    for numbers in alike.values():
        first, space = field.patches[numbers[0]], system.stated[numbers[0]].space
        u, v, w = (
            _between(row, degree, wanted, higher)
            for row, degree, wanted, higher in zip(
                first.knots, first.degrees, space.whole.knots, space.degrees, strict=True
            )
        )
        for number in numbers:
            own = field.patches[number]
            coefficients = own.coefficients.reshape(*own.coefficients.shape[:3], -1)
            full[number] = _along((u[space.rows], v, w), np.moveaxis(coefficients, -1, 0))
            if own.pressure is not None:
                pressure[number] = _along((u, v, w), own.pressure[None])[0]
    here = [full[number] for number in system.unknowns.patches]
    found = system.unknowns.chosen(here).ravel()
    return np.append(found, _pressures(system, pressure)) if isinstance(system, MixedSystem) else found


def _pressures(system: MixedSystem, coefficients: Sequence[Array]) -> Array:
    """Return the pressures nearest to coefficients (n_u, n_v, n_w) in the trial space of each patch."""
    found, known = np.zeros(system.pressures.count), dict[int, Array]()
    for own, extraction, numbers in zip(coefficients, system.pressures.of_patches, system.pressures.numbers, strict=True):
        for part in extraction:
            if id(part) not in known:
                known[id(part)] = np.linalg.pinv(part)
        u, v, w = (known[id(part)] for part in extraction)
        found[numbers] = _along((u, v, w), own[None])[0]
    return found


def _between(knots: Array, degree: int, wanted: Array, higher: int) -> Array:
    """Return the matrix from coefficients to those of the spline with the same values at its Greville points."""
    points = nodes(wanted, higher)
    values = collocation(knots, degree, points).toarray()
    return np.asarray(np.linalg.solve(collocation(wanted, higher, points).toarray(), values))


def _along(matrices: Knots, x: Array) -> Array:
    """Return three matrices applied along the last three axes of x (c, n_u, n_v, n_w)."""
    u, v, w = matrices
    return np.asarray(np.einsum("ai,bj,ck,gijk->gabc", u, v, w, x, optimize=True))
