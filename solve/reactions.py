"""Computes the reactions of the supports from the residual of the equations, so that they balance the loads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from parameterize.arrays import Array, in_brackets
from parameterize.spline.volume import FACE_NAMES

from .discretization.coupling import Coupling
from .discretization.face_data import FaceRule
from .discretization.groups import CoefficientLayout, OnPatches
from .discretization.operator import FaceTerm
from .discretization.processes import Processes
from .discretization.space import TrialSpace
from .discretization.unknowns import Unknowns
from .discretization.weak import WeakFace
from .field import part_of
from .forms.boundary_value_problem import BoundaryValueProblem
from .patch_system import PatchSystem
from .resultant import Resultants

CANCELLED = 1e-9  # share of all parts of the forces below which the forces are rounding: each balances itself


@dataclass(frozen=True)
class Moments:
    """Hold the moments about the origin of the loads (3,), and of the reaction of each support (3,).

    They balance as the forces do, but for bodies whose maps are rational, or of a degree above that of the trial
    space: there they balance to the accuracy of the solution. Under large strains forces act where the body has gone.
    """

    load: tuple[float, ...]
    reactions: Mapping[str, tuple[float, ...]]

    def as_dict(self) -> dict[str, Any]:
        """Return the entries of a level in report.json."""
        return {"load": list(self.load), "reactions": {role: list(own) for role, own in self.reactions.items()}}


@dataclass(frozen=True)
class Balance:
    """Hold the loads on the body and the reactions of its supports: forces of elasticity, inflows of a scalar law.

    Attributes
    ----------
    load : tuple of float
        The integral (c,) of the source and of all given fluxes.
    reactions : dict of str to tuple of float
        By support, which is a region's condition or a face of the cube: the integral (c,) of its action on the body.
    areas : dict of str to float
        By condition, the area of its region.
    imbalance : float or None
        The largest component of the sum of load and reactions, over the sum of their sizes: the error of the linear
        solver. None for a law with a reaction, which takes a part of the load inside the body.
    moments : Moments or None
        The moments of loads and reactions about the origin; None for a scalar law, and where processes share the body.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> bar = iga_nn.Elasticity(fix="u0", load={"u1": (1, 0, 0)})
    >>> found = iga_nn.solve(benchmark_volume(2), bar).report.balance
    >>> list(found.reactions), found.imbalance < 1e-8
    (["fix 'u0'"], True)
    """

    load: tuple[float, ...]
    reactions: Mapping[str, tuple[float, ...]]
    areas: Mapping[str, float]
    imbalance: float | None
    moments: Moments | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the entries of a level in report.json."""
        found: dict[str, Any] = {"load": list(self.load)}
        found["reactions"] = {role: list(force) for role, force in self.reactions.items()}
        found["areas"] = dict(self.areas)
        found |= {} if self.imbalance is None else {"imbalance": self.imbalance}
        return found | ({} if self.moments is None else {"moments": self.moments.as_dict()})

    @property
    def is_told(self) -> bool:
        """Return whether a report shows the balance: where it is one of forces, or where data are given on regions."""
        return len(self.load) > 1 or not all(role.endswith(FACE_NAMES) for role in self.reactions)

    def __str__(self) -> str:
        answers = [f"{role} answers {_shown(force)}" for role, force in self.reactions.items()]
        rest = "" if self.imbalance is None else f" (balanced to {self.imbalance:.0e})"
        return ", ".join([f"load {_shown(self.load)}", *answers]) + rest


def _shown(force: Sequence[float]) -> str:
    return in_brackets(force) if len(force) == 3 else ", ".join(f"{part:.6g}" for part in force)


def balance(
    problem: BoundaryValueProblem,
    patches: Sequence[PatchSystem],
    unknowns: Unknowns,
    faces: Sequence[FaceTerm],
    coefficients: Sequence[Array],
    products: OnPatches,
    couplings: Sequence[Coupling] = (),
) -> Balance:
    """Return the balance of a solution's coefficients (c, n_u, n_v, n_w) of each patch, and of their products.

    faces: the terms on faces of the patches. couplings: those that couple regions.
    """
    processes, layout, total = unknowns.processes, products.layout, unknowns.processes.total
    added = Resultants(problem.form.components, _has_moments(problem, processes, faces))
    places = added.places(patches)
    if problem.form.has_large_strains:  # forces act where the body has gone
        places = [None if place is None else place + own for place, own in zip(places, coefficients, strict=True)]
    loads, full = layout.joined([patch.loads for patch in patches]), layout.joined(coefficients)
    residuals = products - loads
    fixed = unknowns.on_fixed(residuals)
    rows = processes.shared(list(_of_faces(unknowns.patches, patches, fixed, places, added)))
    reactions: dict[str, Array] = {}
    for _, role, force in sorted(chain.from_iterable(rows), key=lambda row: row[0]):
        reactions[role] = reactions.get(role, 0.0) + force
    own = added.none
    for part, place in zip(loads, places, strict=True):
        own = own + added.of(part, place)
    roles = chain.from_iterable(processes.shared(_supports(problem, patches)))
    supports = {role: added.none.copy() for role in roles}
    for face in faces:
        here, on_face = [patches[place].problem for place in face.patches], full.of(face.patches)
        if isinstance(face, WeakFace):
            moved = face.values_of(on_face) if problem.form.has_large_strains else 0.0
            at = np.asarray(face.x) + moved
            own = own + _given(face, at, layout, places, added)
            own = own - _add_regions(here[0], face, at, on_face, supports, added)
        elif isinstance(face, FaceRule):
            own = own - _add_robin_faces(here, face, on_face, supports)
    for coupling in couplings:
        is_free = layout.joined(unknowns.spread(np.ones((problem.form.components, *unknowns.shape))))
        tied = replace(residuals, flat=residuals.flat * is_free.flat)
        parts = zip(tied if coupling.is_tied else coupling.forces(full), places, strict=True)
        supports[coupling.condition.role] = np.sum([added.of(part, place) for part, place in parts], axis=0)
    whole = total(own)
    reactions |= {role: total(force) for role, force in supports.items()}
    components = problem.form.components
    load, moment = whole[:components], whole[components:]
    turning = {role: force[components:] for role, force in reactions.items()}
    reactions = {role: force[:components] for role, force in reactions.items()}
    forces = [load, *reactions.values()]
    size = float(np.abs(forces).sum())
    scale = float(total(np.abs(loads.flat).sum() + np.abs(residuals.flat).sum()))
    size = scale if size < CANCELLED * scale else size
    imbalance = None
    if reactions and not problem.form.has_reaction:
        imbalance = float(np.abs(np.sum(forces, axis=0)).max()) / size if size > 0.0 else 0.0
    weak = [face for face in faces if isinstance(face, WeakFace)]
    areas = {
        condition.role: float(total(sum(face.weights[face.holds(i)].sum() for face in weak)))
        for i, condition in enumerate(problem.conditions)
        if not condition.is_strong
    }
    moments = Moments(tuple(moment.tolist()), _as_tuples(turning)) if added.has_moments else None
    return Balance(tuple(load.tolist()), _as_tuples(reactions), areas, imbalance, moments)


def _as_tuples(forces: Mapping[str, Array]) -> dict[str, tuple[float, ...]]:
    return {role: tuple(np.atleast_1d(force).tolist()) for role, force in forces.items()}


def _has_moments(problem: BoundaryValueProblem, processes: Processes, faces: Sequence[FaceTerm]) -> bool:
    """Return whether moments are added up: of the forces on a body that may turn, which one process has."""
    turns = len(problem.form.free_motions(np.zeros((3, 1)))) > 0
    return turns and len(processes.shared(None)) == 1 and not any(isinstance(face, FaceRule) for face in faces)


def _of_faces(
    numbers: Sequence[int],
    patches: Sequence[PatchSystem],
    residuals: Sequence[Array],
    places: Sequence[Array | None],
    added: Resultants,
) -> Iterator[tuple[int, str, Array]]:
    """Yield the reactions of the fixed coefficients on each face: the patch's number, the face or what names it, sums.

    numbers: those of the patches in the body. places: those of the coefficients (3, n_u, n_v, n_w).
    """
    for number, patch, residual, place in zip(numbers, patches, residuals, places, strict=True):
        space, fixed = patch.space, np.zeros(residual.shape[1:], dtype=bool)
        for axis, name in ((i // 2, name) for i, name in enumerate(FACE_NAMES) if name in space.dirichlet):
            here = np.zeros_like(fixed)
            if fixed.size and (axis > 0 or _has_end(space, name)):
                here[tuple((-1 if name[1] == "1" else 0) if a == axis else slice(None) for a in range(3))] = True
            here &= ~fixed
            fixed |= here
            force = added.of((residual * here)[:, space.own], place)
            support = patch.problem.strong_on(name)
            yield number, patch.problem.prefix + name if support is None or support.name else support.role, force


def _has_end(space: TrialSpace, name: str) -> bool:
    """Return whether the first or the last row of u is among the rows of this process."""
    rows = space.rows
    if rows.start == rows.stop:
        return False
    return bool(rows.stop == space.whole.shape[0] if name == "u1" else rows.start == 0)


def _given(
    face: WeakFace, at: Array, layout: CoefficientLayout, places: Sequence[Array | None], added: Resultants
) -> Array:
    """Return the given fluxes of a face at its points, minus its part of the loads of coefficients.

    That part has the terms of given values, too, and its moments are those of the trial space.
    """
    on_patches = np.zeros((len(face.patches), face.form.components, *layout.shapes[face.patches[0]]))
    face.add_load(on_patches)
    found = added.of(face.weights * face.loads, at)
    for number, own in zip(face.patches, on_patches, strict=True):
        found = found - added.of(own, places[number])
    return found


def _supports(problem: BoundaryValueProblem, patches: Sequence[PatchSystem]) -> list[str]:
    """Return the roles of the supports on regions, and of the faces of patches with Robin data."""
    roles = [c.role for c in problem.conditions if c.is_support and not c.is_strong]
    problems = [patch.problem for patch in patches if patch.problem.faces]
    robin = [(own, one) for own in problems for one in own.faces if one.factor is not None]
    return roles + [own.prefix + name for own, one in robin for name in one.faces]


def _add_robin_faces(
    problems: Sequence[BoundaryValueProblem], face: FaceRule, coefficients: Array, found: dict[str, Array]
) -> Array:
    """Add the reactions of whole faces with Robin data, and return their flux into a body of u = 0.

    problems: those of the k patches. coefficients: (k, c, n_u, n_v, n_w).
    """
    alpha, given = face.data(problems[0])
    assert alpha is not None
    forces = ((given - alpha * face.values_of(coefficients)) * face.area).sum(axis=(2, 3))
    for problem, force in zip(problems, forces.T, strict=True):
        found[problem.prefix + face.name] += force
    return np.asarray((given * face.area).sum(axis=(1, 2, 3)))


def _add_regions(
    problem: BoundaryValueProblem,
    face: WeakFace,
    at: Array,
    coefficients: Array,
    found: dict[str, Array],
    added: Resultants,
) -> Array:
    """Add the reactions of supports on regions, and return the flux of an exchange into a body of u = 0.

    at: (3, m), where the forces act. coefficients: (k, c, n_u, n_v, n_w), of the patches of the faces.
    """
    outside, taken = added.none, np.zeros(len(face.weights), dtype=bool)
    pulls = face.pulls(coefficients) if any(one.is_essential for one in problem.conditions) else None
    for i, condition in enumerate(problem.conditions):
        here = face.holds(i)
        if condition.is_essential and condition.role in found and pulls is not None:
            chosen = np.flatnonzero(here & ~taken)
            found[condition.role] += added.of(pulls[:, chosen], at[:, chosen])
            taken |= here
        elif condition.factor is not None and here.any():
            chosen = np.flatnonzero(here)
            x, weights = part_of(face.x, chosen), face.weights[chosen]
            free = np.eye(problem.form.components)[:, :, None] - face.projector[:, :, chosen]
            given = condition.flux_at(problem, x, face.normal[:, chosen])
            u = np.einsum("cdm,dm->cm", free, face.traces(coefficients)[0][:, chosen])
            pull = np.einsum("cdm,dm->cm", condition.factors_at(len(u), x, face.normal[:, chosen]), u)
            found[condition.role] += added.of(weights * np.einsum("cdm,dm->cm", free, given - pull), at[:, chosen])
            outside += added.of(weights * np.einsum("cdm,dm->cm", free, given), at[:, chosen])
    return outside
