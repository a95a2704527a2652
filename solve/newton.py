"""Solves laws that are not linear by Newton's method: exact derivatives by jets, a line search, load steps."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from parameterize.arrays import Array, Mask
from parameterize.conjugate_gradients import INDEFINITE, conjugate_gradients
from parameterize.old_names import takes_volume
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.threads import one_blas_thread

from .assembly import OnePatch, assemble_body_data
from .diagnostics import ConvergenceError, judge
from .discretization.error_norms import Compared, error_norms
from .discretization.grading import Grading
from .discretization.groups import OnPatches
from .discretization.nonlinear import Forces, Tangent
from .discretization.on_regions import demand_area
from .discretization.space import longest_edges
from .discretization.unknowns import Glued, Unknowns, unknowns_of
from .field import FieldOnBody
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.form import Form
from .forms.problem import Problem
from .forms.under_law import UnderLaw
from .linear.krylov import generalized_residuals
from .linear.low_order import entries_of, on_trilinear, survey_of, surveyed
from .linear.nodal import NodalBasis
from .options import SolveOptions
from .patch_system import PatchProblem
from .preparation import prepared
from .solution import Solution, SolveReport
from .system import coefficients_in, demand_fixed, field_of, glued, is_diagonalized, preconditioner

ENOUGH = 0.8  # share of the forces along a step that may be left at its end
SHORTEST = 2.0**-12  # of a step
REACHED = 1e-12  # share of the largest coefficient by which those given on faces may differ from it
INNER = (1e-8, 1e-3)  # tolerances of the linear solves: the residual of Newton's method, within these

log = logging.getLogger(__name__)


@takes_volume
def newton(
    body: BodyLike,
    problem: Problem,
    *,
    start: FieldOnBody | None = None,
    load_steps: int = 1,
    refine: int = 0,
    degree: int | None = None,
    grading: Grading | None = None,
    threads: int | None = None,
    quadrature: str = SolveOptions.quadrature,
    tolerance: float = 1e-10,
    max_iterations: int = 30,
    linear_iterations: int = 1000,
) -> Solution:
    """Solve a problem whose law is not linear, by Newton's method.

    The law is written as any other (`iga_nn.Form`), with `linear = False`; its derivative follows from it, exactly.
    Where it is not symmetric, the law says `symmetric = False`. Data on faces do not depend on u: loads are dead.

    Parameters
    ----------
    body : BSplineVolume or Body
        The map, or the maps.
    problem : Problem
        The law and its data.
    start : SplineField or BodyField, optional
        Start of the iteration, a field of the same degree in the trial space or a coarser space; zero by default.
    load_steps : int
        Number of equal steps in which source and data on faces grow to their values; each starts at the last solution.
    refine, degree, grading, threads, quadrature
        As in `iga_nn.solve`.
    tolerance : float
        Tolerance of the forces that are not balanced, relative to all forces.
    max_iterations : int
        Largest number of Newton steps in a load step.
    linear_iterations : int
        Largest number of iterations of the linear solver in a Newton step.

    Returns
    -------
    Solution
        The solution; its report has Newton's iterations and residuals of all load steps, one after another.

    Raises
    ------
    ValueError
        For arguments out of range, for a law without a derivative, or whose derivative contradicts `symmetric`, for
        regions without area, for a start of other components, and where fluxes alone are given.
    TypeError
        For a start that is no field, and for an object that is no problem or no body.
    ConvergenceError
        Where the tolerance is not met.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> class Radiating(iga_nn.Form):
    ...     linear = symmetric = False
    ...     def flux(self, u, grad, x):
    ...         return (1 + u[0] ** 3) * grad
    >>> report = iga_nn.newton(benchmark_volume(2), iga_nn.Problem(Radiating(), exact="1+x*y"), refine=1).report
    >>> report.l2_relative < 1e-3, report.iterations < 8
    (True, True)
    """
    options = SolveOptions(
        refine=refine,
        degree=degree,
        grading=grading,
        threads=threads,
        quadrature=quadrature,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    if not (isinstance(load_steps, Integral) and load_steps >= 1):
        raise ValueError(f"load_steps must be a whole number, at least 1, got {load_steps!r:.80}")
    whole = as_body(body)
    placed, patches = prepared(whole, problem, options)
    if weak := [c.role for c in problem.conditions if c.is_essential and not c.is_strong]:
        raise ValueError(f"{weak[0]}: newton holds all of u on whole faces of the cube only: write a region such as u0")
    if placed.fixes_nothing and not placed.form.has_reaction:
        raise ValueError(
            "newton: fluxes alone do not determine the solution: give a value, or an exchange, on a face or a region"
        )
    with one_blas_thread():
        balance = _Balance.of(whole, placed, patches, options, linear_iterations)
        full = 0.0 * balance.loads
        if start is not None:
            full = full.layout.joined(coefficients_in(start, patches))
        history: list[float] = []
        for step in range(1, load_steps + 1):
            full = balance.found(full, step / load_steps, history)
        return _solution(whole, placed, patches, full, balance, history, load_steps)


@dataclass(frozen=True, eq=False)
class _Balance:
    """Compare the forces of a law with the loads.

    known: the coefficients that are given on faces. fixed: the mask of these coefficients.
    """

    body: Body
    unknowns: Unknowns
    forces: Forces
    loads: OnPatches
    known: OnPatches
    fixed: Mask
    options: SolveOptions
    linear_iterations: int

    @classmethod
    def of(
        cls, body: Body, problem: Any, patches: Sequence[PatchProblem], options: SolveOptions, linear_iterations: int
    ) -> "_Balance":
        """Return the balance of a problem. Raises ValueError where a region has no area that is free of values.

        linear_iterations: the largest number of iterations of the linear solver in a Newton step.
        """
        problems: list[Any] = [UnderLaw(patch.problem, _Simple(patch.problem.form.components)) for patch in patches]
        simple = [OnePatch(own.volume, one, own.space) for own, one in zip(patches, problems, strict=True)]
        found = assemble_body_data(simple, options)
        matrix, loads, known = found.matrix, found.loads, found.known
        demand_area(problem, matrix.weak, patches[0].space, body.patches)
        if len(body.parts) > 1 and not problem.form.has_reaction:
            free = surveyed(matrix).free
            for part in body.parts:
                demand_fixed(part, free[list(part)], patches[0].space)
        unknowns = unknowns_of([patch.space for patch in patches], body.interfaces)
        ones = matrix.layout.joined(unknowns.spread(np.ones((loads.components, *unknowns.shape))))
        known = matrix.layout.joined(unknowns.completed(known))
        forces = Forces(matrix, [patch.problem.form for patch in patches])
        return cls(body, unknowns, forces, loads, known, ones.flat == 0.0, options, linear_iterations)

    def found(self, full: OnPatches, share: float, history: list[float]) -> OnPatches:
        """Return the coefficients for which the forces balance a share of the loads, starting from `full`.

        The residuals are appended to the history. Raises ConvergenceError.
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
            step = self._step(full, rest, missing, history[-1])
            searched = self._searched(full, step, inner, loads, is_reached)
            if searched is None:
                raise ConvergenceError(_failed(history, "and no step lowers it"))
            (full, inner), made = searched, made + 1

    def _step(self, full: OnPatches, rest: OnPatches, missing: OnPatches, residual: float) -> OnPatches:
        """Return Newton's step, after which the coefficients on faces have their given values."""
        tangent = self.forces.derivative(full)
        form = self.forces.forms[0]
        if form.symmetric and not tangent.is_symmetric:
            raise ValueError(f"{type(form).__name__} has a derivative that is not symmetric: set `symmetric = False`")
        right = -self.unknowns.collect(rest + tangent.apply(missing))
        free = self._solved(full, tangent, right, float(np.clip(residual, *INNER)))
        return missing + rest.layout.joined(self.unknowns.spread(free))

    def _solved(self, full: OnPatches, tangent: Tangent, right: Array, tolerance: float) -> Array:
        """Return the solution of a linear system, by GMRES where the matrix is not definite."""
        blocks, joined = [tangent.block(i) for i in range(len(right))], self.loads.layout.joined
        survey = survey_of(self.forces.matrix, blocks)
        form = self.forces.forms[0]

        def product(x: Array) -> Array:
            return self.unknowns.collect(tangent.apply(joined(self.unknowns.spread(x))))

        def low_order(nodes: Glued) -> bsr_array:
            forces = Forces(on_trilinear(nodes, self.forces.matrix), self.forces.forms)
            linear = forces.derivative(NodalBasis.of(glued(self.unknowns)).values(full))
            return entries_of(nodes, linear.pointwise, len(right), form.symmetric, self.forces.matrix)

        operators = [own[0] for own in blocks] if is_diagonalized(self.unknowns, len(right)) else ()
        inverse = preconditioner(self.body, self.unknowns, survey, operators, low_order, is_loose=False)
        system = product, right, inverse, tolerance, self.linear_iterations
        if form.symmetric and (found := conjugate_gradients(*system)).breakdown != INDEFINITE:
            return np.asarray(found.x)
        return np.asarray(generalized_residuals(*system).x)

    def _searched(
        self,
        full: OnPatches,
        step: OnPatches,
        inner: OnPatches,
        loads: OnPatches,
        is_reached: bool,
    ) -> tuple[OnPatches, OnPatches] | None:
        """Return the coefficients after the step or a part of it, and the forces there; None where no part is accepted.

        A part is accepted where the forces along the step fall below a share of their earlier size, or where all forces
        become smaller; after a step that also changes coefficients on faces (not `is_reached`), finite forces suffice.
        """
        rest, along = self.unknowns.collect(inner - loads).ravel(), self.unknowns.chosen(step).ravel()
        before, size = ENOUGH * abs(float(rest @ along)), float(np.linalg.norm(rest))
        length = 1.0
        while length >= SHORTEST:
            new = full + length * step
            forces = self.forces.apply(new)
            left = self.unknowns.collect(forces - loads).ravel()
            work, norm = abs(float(left @ along)), float(np.linalg.norm(left))
            if np.isfinite(norm) and (not is_reached or work <= before or norm < size):
                return new, forces
            length *= 0.5
        return None


def _largest(values: OnPatches) -> float:
    return float(np.abs(values.flat).max(initial=0.0))


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


def _solution(
    body: Body,
    problem: BoundaryValueProblem,
    patches: Sequence[PatchProblem],
    full: OnPatches,
    balance: _Balance,
    history: list[float],
    more: int,
) -> Solution:
    """Return the solution, with its errors where the exact solution is known."""
    errors = None
    if problem.exact is not None:
        rows = zip(patches, full, strict=True)
        parts = [Compared(patch.volume, patch.space, own, patch.problem.exact_at) for patch, own in rows]
        errors = error_norms(parts, balance.options.thread_count)
    dofs = len(full[0]) * balance.unknowns.count
    doubtful, meaningful = judge(problem, patches, errors, None, dofs)
    report = SolveReport(
        elements=sum(patch.space.elements for patch in patches),
        dofs=dofs,
        h=longest_edges([patch.volume for patch in patches], [patch.space for patch in patches]),
        iterations=len(history) - more,
        converged=True,
        residual=history[-1],
        seconds={},
        errors=errors,
        notices=tuple(doubtful),
        meaningful=meaningful,
        residuals=tuple(history),
    )
    return Solution.of(field_of(body, patches, full), [patch.problem for patch in patches], report, problem)
