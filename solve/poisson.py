"""solve_poisson: from a volume and a problem to a solution with its errors."""

from __future__ import annotations

import functools
import logging
import time
from dataclasses import dataclass

import numpy as np

from parameterize.volume import BSplineVolume

from .boundary import boundary_coefficients
from .field import SplineField
from .linear import conjugate_gradients
from .norms import error_norms
from .operators import System, assemble
from .planes import map_planes
from .precondition import fast_diagonalization
from .problem import Poisson
from .quadrature import gauss_rule
from .report import SolveReport
from .space import TrialSpace, longest_edge, trial_space

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Solution(SplineField):
    """The discrete solution: a scalar spline of the parameters, the map it lives on, and the report."""

    geometry: BSplineVolume
    report: SolveReport


class ConvergenceError(RuntimeError):
    """The linear solver did not reach its tolerance; the last iterate is `solution`."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        report = solution.report
        super().__init__(f"no convergence: residual {report.residual:.1e} after {report.iterations} iterations")


def solve_poisson(
    volume: BSplineVolume,
    problem: Poisson,
    *,
    refine: int = 0,
    degree: int | None = None,
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
    certified: str | None = None,
    strict: bool = False,
) -> Solution:
    """Solve -Laplace u = f with Dirichlet data on a volume.

    refine: how often every span of the map's knots is halved for the trial space; degree: default the map's own.
    tolerance: of |r| / |b| for the linear solver.
    certified: the verdict of the map's certificate, if known; anything but "certified" is logged and noted.
    strict: raise ConvergenceError where the linear solver fails; otherwise the report says `converged` is False.

    Raises ValueError for arguments out of range, ExpressionError where the data are not finite.
    """
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance must lie between 0 and 1, got {tolerance}")
    if max_iterations < 1:
        raise ValueError(f"max_iterations must be at least 1, got {max_iterations}")
    space = trial_space(volume, refine, degree)
    if min(space.shape) < 3:
        raise ValueError(f"degree {space.degrees} leaves no unknown inside the volume: raise refine or degree")
    _warm_up()
    solution = _solve(volume, problem, space, tolerance, max_iterations, certified)
    for notice in solution.report.notices:
        log.warning("%s", notice)
    if strict and not solution.report.converged:
        raise ConvergenceError(solution)
    return solution


def check_data(volume: BSplineVolume, problem: Poisson) -> None:
    """Evaluate a problem's data where the coarsest solve needs them; finer levels need them at points between.

    Raises ExpressionError where they are not finite.
    """
    space = trial_space(volume)
    boundary_coefficients(volume, space, problem.boundary_at)
    for _, fields in map_planes(volume, gauss_rule(space)):
        problem.source_at(*fields[:, 0])
        if problem.exact is not None:
            problem.exact_at(*fields[:, 0])


@functools.cache
def _warm_up() -> None:
    """Compile the kernels, or load them from the cache, so that no level's seconds contain it."""
    log.info("preparing the compiled kernels: some seconds on the first use, then they are cached")
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1)
    cube = BSplineVolume.uniform(corners, degree=1)
    _solve(cube, Poisson(exact="x*x"), trial_space(cube, 1), 1e-10, 10, None)


def _solve(
    volume: BSplineVolume,
    problem: Poisson,
    space: TrialSpace,
    tolerance: float,
    max_iterations: int,
    certified: str | None,
) -> Solution:
    clock = [time.process_time()]
    rule = gauss_rule(space)
    system = assemble(volume, space, problem.source_at, rule)
    coefficients = boundary_coefficients(volume, space, problem.boundary_at)
    residual = (system.load - system.operator.apply(coefficients))[1:-1, 1:-1, 1:-1]
    preconditioner = fast_diagonalization(system.operator, rule)
    clock.append(time.process_time())
    result = conjugate_gradients(system.operator.apply_free, residual, preconditioner, tolerance, max_iterations)
    coefficients[1:-1, 1:-1, 1:-1] = result.x
    clock.append(time.process_time())
    errors = None
    if problem.exact is not None:
        errors = error_norms(volume, space, coefficients, problem.exact_at)
    clock.append(time.process_time())
    report = SolveReport(
        elements=space.elements,
        dofs=space.dofs,
        h=longest_edge(volume, space),
        iterations=result.iterations,
        converged=result.converged,
        residual=result.residuals[-1],
        seconds=dict(zip(("setup", "solve", "errors"), np.diff(clock).tolist(), strict=True)),
        errors=errors,
        notices=_notices(system, certified),
        residuals=result.residuals,
    )
    return Solution(space.degrees, space.knots, coefficients, volume, report)


def _notices(system: System, certified: str | None) -> tuple[str, ...]:
    notices = []
    if certified not in (None, "certified"):
        notices.append(f"the map is {certified}, not certified: do not trust the solution")
    if system.folded:
        notices.append(f"det J < 0 at {system.folded} of {system.points} Gauss points: solved with |det J| instead")
    return tuple(notices)
