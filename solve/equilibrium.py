"""Finds where the forces of a law that is not linear balance the loads, by Newton's method with exact derivatives."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from parameterize.arrays import Array, Mask
from parameterize.conjugate_gradients import INDEFINITE, conjugate_gradients
from parameterize.spline.body import Body
from parameterize.time_limit import check_time

from .assembly import Assembled, assemble_body_data
from .diagnostics import ConvergenceError, judge
from .discretization.error_norms import Compared, error_norms
from .discretization.groups import OnPatches
from .discretization.nonlinear import Forces, Tangent
from .discretization.on_regions import demand_area, demand_supports
from .discretization.space import longest_edges
from .discretization.stiff_supports import given_way, on_stiff_supports
from .discretization.unknowns import Glued, Unknowns, unknowns_of
from .discretization.weak import WeakFace
from .field import BodyField
from .forms.at_rest import AtRest
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.coupled import demand_uncoupled
from .forms.form import Form
from .forms.under_law import UnderLaw
from .linear.krylov import generalized_residuals
from .linear.low_order import entries_of, on_trilinear, survey_of, surveyed
from .linear.nodal import NodalBasis
from .options import SolveOptions
from .patch_system import PatchProblem, systems_of
from .reactions import Balance, balance
from .solution import Solution, SolveReport
from .system import Preconditioner, demand_fixed, field_of, glued, is_diagonalized, preconditioner

ENOUGH = 0.8  # share of the forces along a step that may be left at its end
SHORTEST = 2.0**-12  # of a step
REACHED = 1e-12  # share of the largest coefficient by which those given on faces may differ from it
INNER = (1e-8, 1e-3)  # tolerances of the linear solves: the residual of Newton's method, within these

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Compare the forces of a law with the loads, on a body whose problem on each patch is stated.

    known: the coefficients that are given on faces. fixed: the mask of these coefficients. inverses: the last
    preconditioner of a law with a history, which is that of the body at rest. before: the forces of the last load step,
    whose derivative is that of the flow that goes on: a body that yields begins a step with it.
    """

    body: Body
    problem: BoundaryValueProblem
    stated: Sequence[PatchProblem]
    unknowns: Unknowns
    forces: Forces
    loads: OnPatches
    known: OnPatches
    fixed: Mask
    options: SolveOptions
    linear_iterations: int
    inverses: list[Preconditioner] = field(default_factory=list)
    before: Forces | None = None

    @classmethod
    def of(
        cls, body: Body, problem: Any, patches: Sequence[PatchProblem], options: SolveOptions, linear_iterations: int
    ) -> "Equilibrium":
        """Return the balance of a problem. Raises ValueError where a region has no area, or supports leave it free.

        linear_iterations: the largest number of iterations of the linear solver in a Newton step.
        """
        if placed_nowhere(problem):
            raise ValueError(
                "newton: fluxes alone do not determine the solution: give a value, or an exchange, on a face or a "
                "region"
            )
        demand_uncoupled(problem, "it couples regions in linear problems only")
        found = assemble_body_data(laws_of_faces(problem, patches), options)
        problem, patches = problem.sharing(found.conditions), found.stated(patches)
        matrix, loads, known = found.matrix, found.loads, found.known
        demand_area(problem, matrix.weak, patches[0].space, body.patches)
        if problem.conditions and not any(own.space.dirichlet for own in patches):
            demand_supports(problem, matrix.weak, patches[0].space, body.patches)
        matrix, loads = on_stiff_supports(matrix, loads)
        if len(body.parts) > 1 and not problem.form.has_reaction:
            free = surveyed(matrix).free
            for part in body.parts:
                demand_fixed(part, free[list(part)], patches[0].space)
        unknowns = unknowns_of([patch.space for patch in patches], body.interfaces)
        ones = matrix.layout.joined(unknowns.spread(np.ones((loads.components, *unknowns.shape))))
        known = matrix.layout.joined(unknowns.completed(known))
        forces = Forces(matrix, [patch.problem.form for patch in patches])
        fixed = ones.flat == 0.0
        return cls(body, problem, patches, unknowns, forces, loads, known, fixed, options, linear_iterations)

    @property
    def at_rest(self) -> OnPatches:
        """Return coefficients that are zero."""
        return 0.0 * self.loads

    def advanced(self, full: OnPatches) -> "Equilibrium":
        """Return the balance for the next load step, with the history at the end of this one."""
        forces = self.forces.advanced(full)
        return replace(self, forces=forces, before=None if forces is self.forces else self.forces)

    def found(self, full: OnPatches, share: float, history: list[float], patience: int | None = None) -> OnPatches:
        """Return the coefficients for which the forces balance a share of the loads, starting from `full`.

        The residuals are appended to the history. Raises ConvergenceError, after so many steps (`patience`) that do not
        halve the residual, too.
        """
        loads, known, made = share * self.loads, share * self.known, 0
        inner = self.forces.apply(full)
        if not np.isfinite(inner.flat).all():
            raise ConvergenceError("newton: the law gives no finite forces at the start; give another one in start")
        while True:
            missing = replace(full, flat=np.where(self.fixed, known.flat - full.flat, 0.0))
            rest = inner - loads
            size = sum(float(np.linalg.norm(self.unknowns.assembled(forces))) for forces in (inner, loads))
            history.append(float(np.linalg.norm(self.unknowns.collect(rest))) / size if size else 0.0)
            log.info("share %.3g of the loads, step %d: residual %.1e", share, made, history[-1])
            is_reached = _largest(missing) <= REACHED * _largest(self.known)
            if history[-1] <= self.options.tolerance and is_reached:
                return full
            if made == self.options.max_iterations:
                raise ConvergenceError(_failed(history, f"after {made} iterations"))
            if patience is not None and made > patience and history[-1] > 0.5 * history[-1 - patience]:
                raise ConvergenceError(_failed(history, f"which stalls after {made} iterations"))
            check_time()
            step = self._step(full, rest, missing, history[-1], made == 0)
            is_free = not is_reached or (made == 0 and self.before is not None)
            searched = self._searched(full, step, inner, loads, is_free)
            if searched is None:
                raise ConvergenceError(_failed(history, "and no step lowers it"))
            (full, inner), made = searched, made + 1

    def _step(self, full: OnPatches, rest: OnPatches, missing: OnPatches, residual: float, is_first: bool) -> OnPatches:
        """Return Newton's step, after which the coefficients on faces have their given values."""
        forces = self.before if is_first and self.before is not None else self.forces
        tangent = forces.derivative(full)
        form = self.forces.forms[0]
        if form.symmetric and not tangent.is_symmetric:
            raise ValueError(f"{type(form).__name__} has a derivative that is not symmetric: set `symmetric = False`")
        right = -self.unknowns.collect(rest + tangent.apply(missing))
        free = self._solved(full, tangent, right, float(np.clip(residual, *INNER)))
        return missing + rest.layout.joined(self.unknowns.spread(free))

    def _solved(self, full: OnPatches, tangent: Tangent, right: Array, tolerance: float) -> Array:
        """Return the solution of a linear system, by GMRES where the matrix is not definite."""
        joined, form = self.loads.layout.joined, self.forces.forms[0]

        def product(x: Array) -> Array:
            return self.unknowns.collect(tangent.apply(joined(self.unknowns.spread(x))))

        def low_order(nodes: Glued) -> bsr_array:
            forces = Forces(on_trilinear(nodes, self.forces.matrix), self.forces.forms)
            linear = forces.derivative(NodalBasis.of(glued(self.unknowns)).values(at))
            return entries_of(nodes, linear.pointwise, len(right), form.symmetric, self.forces.matrix)

        at = self.at_rest if form.history else full
        if not (self.inverses and form.history):
            first = tangent if not form.history else Forces(self.forces.matrix, self.forces.forms).derivative(at)
            blocks = [first.block(i) for i in range(len(right))]
            survey = survey_of(self.forces.matrix, blocks)
            operators = [own[0] for own in blocks] if is_diagonalized(self.unknowns, len(right)) else ()
            self.inverses[:] = [preconditioner(self.body, self.unknowns, survey, operators, low_order, is_loose=False)]
        system = product, right, self.inverses[0], tolerance, self.linear_iterations
        if form.symmetric:
            found = conjugate_gradients(*system)
            log.debug("%d iterations of the linear solver %s", found.iterations, found.breakdown)
            if form.history or found.breakdown != INDEFINITE:  # the tangent of a body that yields is positive
                return np.asarray(found.x)
        return np.asarray(generalized_residuals(*system).x)

    def _searched(
        self,
        full: OnPatches,
        step: OnPatches,
        inner: OnPatches,
        loads: OnPatches,
        is_free: bool,
    ) -> tuple[OnPatches, OnPatches] | None:
        """Return the coefficients after the step or a part of it, and the forces there; None where no part is accepted.

        A part is accepted where the forces along the step fall below a share of their earlier size, or where all forces
        become smaller. Finite forces suffice for a step (`is_free`) that also changes coefficients on faces, or begins
        a load step of a law with a history.
        """
        rest, along = self.unknowns.collect(inner - loads).ravel(), self.unknowns.chosen(step).ravel()
        before, size = ENOUGH * abs(float(rest @ along)), float(np.linalg.norm(rest))
        length = 1.0
        while length >= SHORTEST:
            new = full + length * step
            forces = self.forces.apply(new)
            left = self.unknowns.collect(forces - loads).ravel()
            work, norm = abs(float(left @ along)), float(np.linalg.norm(left))
            if np.isfinite(norm) and (is_free or work <= before or norm < size):
                return new, forces
            length *= 0.5
        return None

    def solution(self, full: OnPatches, history: Sequence[float], more: int, **said: Any) -> Solution:
        """Return the solution, with its errors where the exact solution is known.

        history: the residuals of Newton's method. more: how many of them are no iterations. said: further fields of the
        report.
        """
        errors, problem, patches = None, self.problem, self.stated
        if problem.exact is not None:
            rows = zip(patches, full, strict=True)
            parts = [Compared(patch.volume, patch.space, own, patch.problem.exact_at) for patch, own in rows]
            errors = error_norms(parts, self.options.thread_count)
        dofs = len(full[0]) * self.unknowns.count
        doubtful, meaningful = judge(problem, patches, errors, None, dofs)
        given: dict[str, Any] = {
            "elements": sum(patch.space.elements for patch in patches),
            "dofs": dofs,
            "h": longest_edges([patch.volume for patch in patches], [patch.space for patch in patches]),
            "iterations": len(history) - more,
            "converged": True,
            "residual": history[-1],
            "seconds": {},
            "errors": errors,
            "notices": tuple(doubtful),
            "meaningful": meaningful,
            "residuals": tuple(history),
        }
        given |= said | {"notices": (*said.get("notices", ()), *given["notices"])}
        field = self._with_state(field_of(self.body, patches, full), full)
        return Solution.of(field, [patch.problem for patch in patches], SolveReport(**given), problem)

    def _with_state(self, field: BodyField, full: OnPatches) -> BodyField:
        """Return a field with what the law shows of its internal variables as splines on each patch."""
        if not self.forces.states:
            return field
        each = zip(field.patches, self.forces.fitted(full), strict=True)
        states = [(one, None if own is None else np.moveaxis(own, 0, -1)) for one, own in each]
        return replace(field, patches=tuple(replace(one, state=state) for one, state in states))

    def balance(self, full: OnPatches, share: float) -> Balance:
        """Return the loads at a share of them and what the supports answer."""
        matrix, loads = self.forces.matrix, share * self.loads
        faces = [
            replace(face, values=share * face.values, loads=share * face.loads) if isinstance(face, WeakFace) else face
            for face in matrix.faces
        ]
        systems = systems_of(self.stated, Assembled(matrix, loads, share * self.known, self.problem.conditions))
        return balance(self.problem, systems, self.unknowns, faces, full, self.forces.apply(full))

    def given_way(self, full: OnPatches, share: float) -> float:
        """Return the largest distance by which a held region gives way."""
        faces = self.forces.matrix.weak
        return given_way([replace(face, values=share * face.values) for face in faces], full)


def _largest(values: OnPatches) -> float:
    return float(np.abs(values.flat).max(initial=0.0))


def placed_nowhere(problem: BoundaryValueProblem) -> bool:
    """Return whether nothing fixes the solution."""
    return problem.fixes_nothing and not problem.form.has_reaction


def laws_of_faces(problem: BoundaryValueProblem, patches: Sequence[PatchProblem]) -> list[PatchProblem]:
    """Return the problem on each patch under a linear law, which loads and data on faces are assembled for.

    Problems of linear laws are returned as they are.
    """
    if problem.form.linear:
        return list(patches)
    is_weak = any(one.is_essential and not one.is_strong for one in problem.conditions)
    laws: list[Any] = [UnderLaw(own.problem, _simple(own.problem.form, is_weak)) for own in patches]
    return [replace(own, problem=law) for own, law in zip(patches, laws, strict=True)]


def _simple(form: Form, is_weak: bool) -> Form:
    """Return the law of which loads and data on faces are assembled: where regions are held, the law at rest."""
    return AtRest(form) if is_weak else _Simple(form.components)


class _Simple(Form):
    """Define the law of Laplace's equation, of which only loads and data on faces are assembled."""

    def __init__(self, components: int) -> None:
        self.components = components

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the gradient."""
        return grad


def _failed(history: list[float], why: str) -> str:
    """Return the message of a failure of Newton's method with its remedy, in one line."""
    return (
        f"newton: no convergence, residual {history[-1]:.1e} {why}: raise load_steps (or max_iterations), or start "
        "nearer to the solution"
    )
