"""Finds how rigid regions move under their loads: by unit motions, and the forces with which the body answers them.

A rigid region moves by u = d + theta x (x - c), c its centre. The body is linear, so the force and the moment with
which a region acts on the body depend on its motion by a matrix of six rows. This is the Schur complement of the
stiffness, found by a solve for each unit motion. The force and the moment must be those of the loads on the region.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import size_of
from parameterize.threads import one_blas_thread

from .assembly import Assembled, stated_by
from .diagnostics import ConvergenceError
from .discretization.on_regions import renewed
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.condition import Condition
from .forms.coupled import demand_uncoupled
from .forms.rigid import Rigid, RigidMotion
from .forms.total_loads import Moment, RemoteForce, TotalForce
from .options import SolveOptions
from .patch_system import systems_of
from .reactions import Balance
from .solution import Solution
from .system import System

TIGHTER = 1e-2  # times the tolerance: motions of all of the region are large beside the strains that they cause
LEAST = 1e-13  # tolerance
FREE = 1e-9  # share of the largest stiffness against motions of regions, below which nothing holds a motion


def has_rigid(problem: BoundaryValueProblem) -> bool:
    """Return whether a problem has rigid regions whose motion is unknown."""
    is_problem = isinstance(problem, BoundaryValueProblem)
    return is_problem and any(isinstance(one, Rigid) and one.motion is None for one in problem.conditions)


def _first(problem: BoundaryValueProblem) -> Condition:
    return next(one for one in problem.conditions if isinstance(one, Rigid))


def at_rest(problem: BoundaryValueProblem, comm: Any = None) -> BoundaryValueProblem:
    """Return a problem whose rigid regions move as given and not else, without the loads on them.

    Raises ValueError for several processes, and beside cyclic symmetry.
    """
    if not has_rigid(problem):
        return problem
    demand_uncoupled(problem, "it goes without rigid regions")
    if comm is not None and comm.size > 1:
        raise ValueError(f"{_first(problem).role}: rigid regions are solved in one process: leave comm out")
    kept = [one for one in problem.conditions if _carrier(one, problem.conditions) is None]
    still = [one.moved(one.given, np.zeros(3), one) if isinstance(one, Rigid) else one for one in kept]
    return problem.with_conditions(still)


def solved_with_motions(
    problem: BoundaryValueProblem, options: SolveOptions, system_of: Callable[[BoundaryValueProblem], System]
) -> tuple[System, Solution]:
    """Return the system and the solution of a problem with rigid regions. system_of: that of another problem.

    Raises ValueError where a region's motion is not held, ConvergenceError where a solve for a unit motion fails.
    """
    if options.device != "cpu":
        raise ValueError(f"{_first(problem).role}: rigid regions are solved on device='cpu' only")
    still = at_rest(problem, options.comm)
    first = system_of(still)
    if first.formulation != "displacement":
        raise ValueError(f"{_first(problem).role}: it is solved with formulation='displacement' only")
    regions = [_region(i, one, first) for i, one in enumerate(still.conditions) if isinstance(one, Rigid)]
    wanted = np.concatenate([_load_on(one, problem.conditions) for one in regions])
    free = np.concatenate([one.condition.unknown for one in regions])
    given = np.concatenate([one.condition.given for one in regions])
    length = size_of(first.body.patches)
    scales = np.tile([length] * 3 + [1.0] * 3, len(regions))  # a unit of each motion moves points alike
    numbers = np.flatnonzero(free)
    tight, counts = replace(options, tolerance=max(TIGHTER * options.tolerance, LEAST), start=None, ask=()), [0]

    def solved(system: System) -> Array:
        found = system._iterate(tight)
        counts[0] += found.iterations
        if not found.converged:
            raise ConvergenceError(f"the solve for a unit motion of {regions[0].condition.role} does not converge")
        return found.x

    with one_blas_thread():
        fixed = moved(first, regions, given)
        start = solved(fixed)
        rest = _actions(fixed._balance(fixed._filled(start)), regions)
        columns, fields = [], []
        for number in numbers:
            motion = given.copy()
            motion[number] += scales[number]
            other = moved(first, regions, motion)
            own = solved(replace(other, right=other.right - fixed.right))
            fields.append(own)
            columns.append(_actions(other._balance(other._filled(start + own)), regions) - rest)
        weights, motion, steps = scales[numbers], given.copy(), np.zeros(len(numbers))
        if len(numbers):
            stiffness = np.array(columns).T[numbers] * weights[:, None]
            _demand_held(stiffness, regions)
            steps = np.linalg.solve(stiffness, (wanted - rest)[numbers] * weights)
        motion[numbers] += weights * steps
        last = moved(first, regions, motion)
        guess = start + sum((step * own for step, own in zip(steps, fields, strict=True)), np.zeros_like(start))
    solution = last.solve_with(replace(tight, start=last.field(guess.ravel())))
    found = _actions(solution.report.balance, regions)
    size = float(np.abs(np.concatenate([found * scales, wanted * scales])).max()) or 1.0
    rests = np.abs(np.where(free, (found - wanted) * scales, 0.0)).reshape(-1, 6).max(axis=1) / size
    rows = zip(regions, motion.reshape(-1, 6).tolist(), rests.tolist(), strict=True)
    motions = [
        RigidMotion(one.condition.role, _triple(one.centre.tolist()), _triple(row[:3]), _triple(row[3:]), rest)
        for one, row, rest in rows
    ]
    report = replace(solution.report, rigid=tuple(motions), iterations=counts[0] + solution.report.iterations)
    return last, replace(solution, report=report)


@dataclass(frozen=True, eq=False)
class _Region:
    """Hold a rigid region, the number of its condition, and its centre (3,)."""

    number: int
    condition: Rigid
    centre: Array

    def about_centre(self, force: Array, moment: Array) -> Array:
        """Return a force, and its moment about the origin as that about the centre (6,)."""
        return np.concatenate([force, moment - np.cross(self.centre, force)])


def _region(number: int, condition: Rigid, system: System) -> _Region:
    """Return a rigid region with the centre of its area. Raises ValueError where springs act on it."""
    moment, area = np.zeros(3), 0.0
    for i, other in enumerate(system.problem.conditions):
        shared = sum(float((face.weights * (face.holds(number) & face.holds(i))).sum()) for face in system.matrix.weak)
        if other.factor is not None and shared > 0.0:
            raise ValueError(f"{other.role} acts on {condition.role}: give springs on other regions")
    for face in system.matrix.weak:
        weights = face.weights * face.holds(number)
        moment, area = moment + np.asarray(face.x) @ weights, area + float(weights.sum())
    return _Region(number, condition, moment / area)


def _carrier(load: Condition, conditions: Sequence[Condition]) -> Rigid | None:
    """Return the rigid region that carries a load: one stated in total on the same region; None where none does."""
    if not isinstance(load, TotalForce | Moment | RemoteForce):
        return None
    return next((one for one in conditions if isinstance(one, Rigid) and one.region == load.region), None)


def _load_on(region: _Region, conditions: Sequence[Condition]) -> Array:
    """Return the force, and the moment about the centre (6,), of the loads on a rigid region."""
    found = np.zeros(6)
    for load in conditions:
        carrier = _carrier(load, conditions)
        if carrier is None or carrier.role != region.condition.role:
            continue
        if isinstance(load, Moment):
            found[3:] += load.total
        elif isinstance(load, RemoteForce):
            found += region.about_centre(load.total, np.cross(np.array(load.point), load.total))
        elif isinstance(load, TotalForce):
            found[:3] += load.total
    return found


def _actions(balance: Balance | None, regions: Sequence[_Region]) -> Array:
    """Return the forces and the moments about their centres (6 n,) with which regions act on the body."""
    if balance is None or balance.moments is None:
        raise ConvergenceError("the motions of rigid regions are not found: forces and moments are too large")
    forces, moments = balance.reactions, balance.moments.reactions
    roles = [(one, one.condition.role) for one in regions]
    return np.concatenate([one.about_centre(np.array(forces[role]), np.array(moments[role])) for one, role in roles])


def _demand_held(stiffness: Array, regions: Sequence[_Region]) -> None:
    """Raise ValueError where the body does not resist a motion of its rigid regions. stiffness: in units of work."""
    sizes = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))
    if sizes[0] <= FREE * sizes[-1]:
        named = ", ".join(one.condition.role for one in regions)
        raise ValueError(f"{named}: nothing else holds the body, give fix, roller, symmetry, spring or foundation")


def moved(system: System, regions: Sequence[_Region], motion: Array) -> System:
    """Return the system in which regions have a motion (6 n,): shifts of their centres, and turns."""
    new = {one.number: (one, row) for one, row in zip(regions, motion.reshape(-1, 6), strict=True)}

    def of(problem: Any) -> Any:
        rows = enumerate(problem.conditions)
        own = [new[i][0].condition.moved(new[i][1], new[i][0].centre, one) if i in new else one for i, one in rows]
        return problem.with_conditions(own)

    patches = [stated_by(patch, of(patch.problem)) for patch in system.patches]
    stated = [stated_by(patch, of(patch.problem)) for patch in system.stated]
    matrix, unknowns = system.matrix, system.unknowns
    faces = [renewed(face, patches[face.patches[0]].problem) for face in matrix.weak]
    found = Assembled(matrix, matrix.layout.empty(3), matrix.layout.empty(3), ()).renewed(patches)
    whole = matrix.with_faces(faces)
    known = matrix.layout.joined(unknowns.completed(found.known))
    systems = systems_of(stated, found._replace(matrix=whole, known=known))
    right = unknowns.collect(found.loads - whole.apply(known))
    return replace(system, problem=of(system.problem), stated=stated, patches=systems, matrix=whole, right=right)


def _triple(row: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = row
    return x, y, z
