"""Solves laws that are not linear by Newton's method: exact derivatives by jets, a line search, load steps."""

import logging
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.conjugate_gradients import INDEFINITE, conjugate_gradients
from parameterize.spline.volume import BSplineVolume, demand_volume
from parameterize.threads import one_blas_thread

from .assembly import assemble_data
from .diagnostics import ConvergenceError, judge
from .discretization.errors import Part, error_norms
from .discretization.nonlinear import Forces, Tangent
from .discretization.on_regions import demand_area
from .discretization.space import TrialSpace, embedded, longest_edge
from .discretization.weak import WeakFace
from .field import SplineField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.form import Form
from .forms.problem import Problem
from .linear.krylov import generalized_residuals
from .linear.preconditioner import fast_diagonalization
from .options import SolveOptions
from .patch_system import PatchProblem
from .solution import Solution, SolveReport
from .solver import prepared

ENOUGH = 0.8  # share of the forces along a step that may be left at its end
SHORTEST = 2.0**-12  # of a step
REACHED = 1e-12  # share of the largest coefficient by which those given on faces may differ from it
INNER = (1e-8, 1e-3)  # tolerances of the linear solves: the residual of Newton's method, within these

log = logging.getLogger(__name__)


def newton(
    volume: BSplineVolume,
    problem: Problem,
    *,
    start: SplineField | None = None,
    load_steps: int = 1,
    refine: int = 0,
    degree: int | None = None,
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
    volume : BSplineVolume
        The map.
    problem : Problem
        The law and its data.
    start : SplineField, optional
        Start of the iteration, a field of the same degree in the trial space or a coarser space; zero by default.
    load_steps : int
        Number of equal steps in which source and data on faces grow to their values; each starts at the last solution.
    refine, degree, threads, quadrature
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
        regions without area, and where fluxes alone are given.
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
        threads=threads,
        quadrature=quadrature,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    if not (isinstance(load_steps, Integral) and load_steps >= 1):
        raise ValueError(f"load_steps must be a whole number, at least 1, got {load_steps!r:.80}")
    if weak := [c.role for c in problem.conditions if c.is_essential and not c.is_strong]:
        raise ValueError(f"{weak[0]}: newton holds all of u on whole faces of the cube only: write a region such as u0")
    demand_volume(volume)
    placed, (patch,) = prepared(volume, problem, options)
    space = patch.space
    if placed.fixes_nothing and not placed.form.has_reaction:
        raise ValueError(
            "newton: fluxes alone do not determine the solution: give a value, or an exchange, on a face or a region"
        )
    with one_blas_thread():
        balance = _Balance.of(volume, placed, space, options, linear_iterations)
        full = np.zeros_like(balance.load)
        if start is not None:
            full = embedded(start.coefficients, start.degrees, start.knots, space)
            full = np.array(full[None] if full.ndim == 3 else np.moveaxis(full, -1, 0))
        history: list[float] = []
        for step in range(1, load_steps + 1):
            full = balance.found(full, step / load_steps, history)
        return _solution(patch, full, balance, history, load_steps)


@dataclass(frozen=True, eq=False)
class _Balance:
    """Compare the forces of a law with the loads; arrays are (c, n_u, n_v, n_w).

    known: the coefficients that are given on faces. is_fixed: the mask of these coefficients.
    """

    forces: Forces
    load: Array
    known: Array
    is_fixed: NDArray[np.bool_]
    options: SolveOptions
    linear_iterations: int

    @classmethod
    def of(
        cls, volume: BSplineVolume, problem: Any, space: TrialSpace, options: SolveOptions, linear_iterations: int
    ) -> "_Balance":
        """Return the balance of a problem. Raises ValueError where a region has no area that is free of values.

        linear_iterations: the largest number of iterations of the linear solver in a Newton step.
        """
        operator, load, known = assemble_data(volume, _Loads(problem), space, options)  # type: ignore[arg-type]
        on_regions = [face for face in operator.faces.values() if isinstance(face, WeakFace)]
        demand_area(problem, on_regions, space, [volume])
        is_fixed = np.ones(load.shape, dtype=bool)
        is_fixed[:, *space.window] = False
        return cls(Forces.of(operator, volume, problem.form), load, known, is_fixed, options, linear_iterations)

    def found(self, full: Array, share: float, history: list[float]) -> Array:
        """Return the coefficients for which the forces balance a share of the loads, starting from `full`.

        The residuals are appended to the history. Raises ConvergenceError.
        """
        load, made = share * self.load, 0
        inner = self.forces.apply(full)
        if not np.isfinite(inner).all():
            raise ConvergenceError("newton: the law gives no finite forces at the start; give another one in start")
        while True:
            missing = np.where(self.is_fixed, share * self.known - full, 0.0)
            rest = inner - load
            size = float(np.linalg.norm(inner) + np.linalg.norm(load))
            history.append(float(np.linalg.norm(rest[~self.is_fixed])) / size if size else 0.0)
            log.info("share %.3g of the loads, step %d: residual %.1e", share, made, history[-1])
            is_reached = np.abs(missing).max() <= REACHED * np.abs(self.known).max(initial=0.0)
            if history[-1] <= self.options.tolerance and is_reached:
                return full
            if made == self.options.max_iterations:
                raise ConvergenceError(_failed(history, f"after {made} iterations"))
            step = self._step(full, rest, missing, history[-1])
            searched = self._searched(full, step, inner, load, bool(is_reached))
            if searched is None:
                raise ConvergenceError(_failed(history, "and no step lowers it"))
            (full, inner), made = searched, made + 1

    def _step(self, full: Array, rest: Array, missing: Array, residual: float) -> Array:
        """Return Newton's step, after which the coefficients on faces have their given values."""
        tangent, form = self.forces.derivative(full), self.forces.form
        if form.symmetric and not tangent.is_symmetric:
            raise ValueError(f"{type(form).__name__} has a derivative that is not symmetric: set `symmetric = False`")
        window = (slice(None), *tangent.space.window)
        right = -np.ascontiguousarray((rest + tangent.apply(missing))[window])
        step = missing.copy()
        step[window] = _solved(tangent, right, form.symmetric, float(np.clip(residual, *INNER)), self.linear_iterations)
        return step

    def _searched(
        self, full: Array, step: Array, inner: Array, load: Array, is_reached: bool
    ) -> tuple[Array, Array] | None:
        """Return the coefficients after the step or a part of it, and the forces there; None where no part is accepted.

        A part is accepted where the forces along the step fall below a share of their earlier size, or where all forces
        become smaller; after a step that also changes coefficients on faces (not `is_reached`), finite forces suffice.
        """
        free, length = ~self.is_fixed, 1.0
        rest = (inner - load)[free]
        before, size = ENOUGH * abs(float(rest @ step[free])), float(np.linalg.norm(rest))
        while length >= SHORTEST:
            new = full + length * step
            forces = self.forces.apply(new)
            left = (forces - load)[free]
            along, norm = abs(float(left @ step[free])), float(np.linalg.norm(left))
            if np.isfinite(norm) and (not is_reached or along <= before or norm < size):
                return new, forces
            length *= 0.5
        return None


class _Loads:
    """State a problem under a simple law, of which only the loads and the data on faces are assembled."""

    def __init__(self, problem: BoundaryValueProblem) -> None:
        self.problem, self.form = problem, _Simple()
        self.form.components = problem.form.components

    def __getattr__(self, name: str) -> Any:
        return getattr(self.problem, name)


class _Simple(Form):
    """Define the law of Laplace's equation."""

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the gradient."""
        return grad


def _solved(tangent: Tangent, right: Array, is_symmetric: bool, tolerance: float, most: int) -> Array:
    """Return the solution of a linear system within the given iterations, by GMRES where the matrix is not definite."""
    blocks = [fast_diagonalization(tangent.block(i)) for i in range(len(right))]

    def precondition(residual: Array) -> Array:
        return np.stack([block(part) for block, part in zip(blocks, residual, strict=True)])

    system = tangent.apply_free, right, precondition, tolerance, most
    if is_symmetric and (found := conjugate_gradients(*system)).breakdown != INDEFINITE:
        return np.asarray(found.x)
    return np.asarray(generalized_residuals(*system).x)


def _failed(history: list[float], why: str) -> str:
    """Return the message of a failure of Newton's method with its remedy, in one line."""
    return (
        f"newton: no convergence, residual {history[-1]:.1e} {why}: raise load_steps (or max_iterations), or start "
        "nearer to the solution"
    )


def _solution(patch: PatchProblem, full: Array, balance: _Balance, history: list[float], more: int) -> Solution:
    """Return the solution, with its errors where the exact solution is known."""
    volume, problem, space, errors = patch.volume, patch.problem, patch.space, None
    if problem.exact is not None:
        errors = error_norms([Part(volume, space, full, problem.exact_at)], balance.forces.threads)
    dofs = len(full) * space.dofs
    doubtful, meaningful = judge(problem, [patch], errors, None, dofs)
    report = SolveReport(
        elements=space.elements,
        dofs=dofs,
        h=longest_edge(volume, space),
        iterations=len(history) - more,
        converged=True,
        residual=history[-1],
        seconds={},
        errors=errors,
        notices=tuple(doubtful),
        meaningful=meaningful,
        residuals=tuple(history),
    )
    coefficients = full[0] if len(full) == 1 else np.moveaxis(full, 0, -1)
    return Solution(space.degrees, space.knots, coefficients, volume, report=report, problem=problem)
