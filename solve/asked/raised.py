"""Solves on the raised space, to see what a solution lacks: one degree more on the same spans, finer at patches' ends.

What the raised solution adds to a solution is its error, but for the error of the raised solution itself. That is
smaller by an order where the solution is smooth. Singular places are at edges of patches as a rule: at reentrant edges,
where materials meet, and around held faces. There the degree alone helps little: half of the error is missing. So spans
at the ends of patches are divided in two, and the outer half again, where this costs little; a single span is halved.
"""

from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import collocation
from parameterize.spline.volume import BSplineVolume

from ..discretization.slab import shared_space
from ..discretization.space import MOST_DEGREE, TrialSpace, of_each
from ..discretization.weak import WeakFace
from ..field import BodyField
from ..linear.nodal import nodes
from ..mixed import MixedSystem, build_mixed
from ..options import SolveOptions
from ..reactions import Balance
from ..solution import Solution
from ..system import System, build
from .adjoint import adjoint
from .samples import Samples

LEFT = 0.02  # share of the residual that the iteration leaves: some 2 % of what the raised solution adds
LEFT_OF_GIVEN = 0.002  # where values are given: the start does not have those of the raised space
ENDS = (0.25, 0.5)  # where a span at the end of a patch is divided
AFFORDED = 1.5  # times as many coefficients as without divided ends
FEW = 20_000  # coefficients of a component that are always afforded
SLIVER = 1e-3  # of the largest held area: what is less lies beside the border of a face
MOST = 5_000_000  # coefficients of all components


@dataclass(frozen=True, eq=False)
class Raised:
    """Hold the solution on the raised space.

    system: that of the space. solution: with the balance of its loads, without errors and notices. is_divided: whether
    spans at the ends of patches are divided, so that it is better at singular places.
    """

    system: System
    solution: Solution
    is_divided: bool

    @classmethod
    def of(cls, system: System, solution: Solution, options: SolveOptions) -> "Raised":
        """Return the raised solution; the iteration starts at a solution of a system.

        options: those of the system's solve. Raises ValueError where `why_not_raised` says why.
        """
        if why := why_not_raised(system):
            raise ValueError(f"there is no raised space: {why}")
        is_divided = affords_ends(system)
        higher = raised_system(system, options, is_divided)
        left = LEFT_OF_GIVEN if system.has_given_values else LEFT
        found = higher.continued(start_in(higher, solution), left, options)
        report = replace(found.report, balance=evened(found.report.balance))
        return cls(higher, replace(found, report=report), is_divided)

    @cached_property
    def has_inner_rim(self) -> bool:
        """Return whether a region that is held ends inside of a patch's face; slivers of a region do not count."""
        shared, weak = self.system.unknowns.processes.shared, self.system.matrix.weak
        areas = [_held_areas(face) for face in weak]
        largest = max(shared(max((float(own.max()) for own in areas), default=0.0)))
        pairs = zip(areas, weak, strict=True)
        return any(shared(any(bool(((own > SLIVER * largest) & ~face.is_whole).any()) for own, face in pairs)))

    def dual(self, samples: Samples) -> BodyField:
        """Return the adjoint of a functional in the raised space."""
        return adjoint(self.system, samples)


def why_not_raised(system: System) -> str:
    """Return why a system has no raised space; "" where it has one."""
    if system.matrix.couplings:
        return "regions are coupled by a cyclic symmetry"
    if max(max(patch.space.degrees) for patch in system.stated) >= MOST_DEGREE:
        return f"degree {MOST_DEGREE} is the highest one"
    count = system.problem.form.components * _count(system, is_divided=False)
    return f"the raised space has {count:,} coefficients" if count > MOST else ""


def raised_system(system: System, options: SolveOptions, is_divided: bool) -> System:
    """Return the system of the same problem on the raised space. is_divided: whether patches' ends are."""
    comm = options.comm if system.body.is_single else None
    spaces = [shared_space(space, comm) for space in _raised_spaces(system, is_divided)]
    patches = [replace(patch, space=space) for patch, space in zip(system.stated, spaces, strict=True)]
    make = build_mixed if isinstance(system, MixedSystem) else build
    return make(system.body, system.problem, patches, options)


def _raised_spaces(system: System, is_divided: bool) -> list[TrialSpace]:
    """Return the raised space of each patch; patches share theirs as they share their spaces."""
    volumes = {id(patch.space): patch.volume for patch in system.stated}  # spaces are shared by maps of equal knots
    return of_each(
        lambda space: raised_space(space.whole, volumes[id(space)], is_divided),
        [patch.space for patch in system.stated],
    )


def _count(system: System, is_divided: bool) -> int:
    """Return the number of coefficients of all patches of a component in the raised space."""
    return sum(space.dofs for space in _raised_spaces(system, is_divided))


def affords_ends(system: System) -> bool:
    """Return whether spans at the ends of patches are divided: where it costs little."""
    return _count(system, is_divided=True) <= max(FEW, AFFORDED * _count(system, is_divided=False))


def raised_space(space: TrialSpace, volume: BSplineVolume, is_divided: bool) -> TrialSpace:
    """Return the space of one degree more on the same spans. is_divided: whether those at the ends of patches are."""
    own, maps = zip(space.knots, space.degrees, strict=True), zip(volume.knots, volume.degrees, strict=True)
    u, v, w = (raised_knots(*row, *of_map, is_divided) for row, of_map in zip(own, maps, strict=True))
    p, q, r = space.degrees
    return replace(space, degrees=(p + 1, q + 1, r + 1), knots=(u, v, w))


def raised_knots(knots: Array, degree: int, of_map: Array, map_degree: int, is_divided: bool) -> Array:
    """Return the knot vector of one degree more, from that of a space and that of its map.

    Where the map is smooth the space is smoother by one, so that there are hardly more functions. At the map's own
    knots it is as smooth as the map: on one that is smoother errors are larger than before. A single span is halved
    where ends are divided: one degree more adds nothing to a solution that is even across it.
    """
    values, repeats = np.unique(knots, return_counts=True)
    for value, repeat in zip(*np.unique(of_map, return_counts=True), strict=True):
        repeats[values == value] = np.maximum(repeats[values == value], degree + 1 - map_degree + repeat)
    repeats[[0, -1]] = degree + 2
    row = np.repeat(values, repeats)
    if not is_divided:
        return row
    if len(values) == 2:
        return np.sort(np.append(row, values.mean()))
    first, last = values[1] - values[0], values[-1] - values[-2]
    ends = [(values[0] + share * first, values[-1] - share * last) for share in ENDS]
    return np.sort(np.append(row, ends))


def _held_areas(face: WeakFace) -> Array:
    """Return the area (k,) on which something is held of each patch's face."""
    held = face.gamma > 0.0
    found = np.bincount(face.owners[held], face.weights[held], minlength=len(face.patches))
    return found.astype(np.float64, copy=False)  # whole numbers where there are no points


def evened(balance: Balance | None) -> Balance | None:
    """Return the balance whose reactions have what the iteration leaves of the loads, each by its size."""
    if balance is None or balance.imbalance is None or not balance.reactions:
        return balance
    forces = np.array(list(balance.reactions.values()))
    sizes = np.abs(forces)
    shares = np.divide(sizes, sizes.sum(axis=0), out=np.zeros_like(sizes), where=sizes.sum(axis=0) > 0.0)
    forces = forces - shares * (np.array(balance.load) + forces.sum(axis=0))
    return replace(balance, reactions=dict(zip(balance.reactions, map(tuple, forces.tolist()), strict=True)))


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
    found, known = np.zeros(system.pressures.count), dict[int, Any]()
    for own, extraction, numbers in zip(
        coefficients, system.pressures.of_patches, system.pressures.numbers, strict=True
    ):
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
