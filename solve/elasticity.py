"""solve_elasticity: from a volume and an elastic problem to displacements with their errors."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .discretization.dirichlet import boundary_coefficients
from .discretization.elastic_operator import assemble_elasticity
from .discretization.natural import face_rule
from .discretization.norms import Errors, squared_errors
from .discretization.operator import free_window
from .discretization.planes import map_planes
from .discretization.quadrature import gauss_rule
from .discretization.space import TrialSpace, trial_space
from .failure import announce, check_unknowns, solve_notices
from .forms.elastic_problem import Elasticity
from .linear.cg import conjugate_gradients
from .linear.preconditioner import fast_diagonalization
from .meaning import doubts
from .options import SolverOptions
from .solution import Solution, solution_of, with_estimate
from .threads import one_blas_thread


def solve_elasticity(
    volume: BSplineVolume,
    problem: Elasticity,
    *,
    refine: int = 0,
    degree: int | None = None,
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
    certified: str | None = None,
    strict: bool = False,
    estimate: bool | None = None,
    threads: int | None = None,
) -> Solution:
    """Solve for the displacements of an elastic body; arguments and errors raised are those of `solve_poisson`.

    The solution's coefficients are (m_u, m_v, m_w, 3).
    """
    options = SolverOptions(tolerance=tolerance, max_iterations=max_iterations, certified=certified, threads=threads)
    problem = problem.on(volume)
    space = trial_space(volume, refine, degree)
    check_unknowns(space, problem.dirichlet)
    _warm_up()
    with one_blas_thread():
        solution = _solve(volume, problem, space, options)
        if estimate or (estimate is None and problem.exact is None):
            solution = with_estimate(solution, space, problem)
    announce(solution, strict)
    return solution


def check_elastic_data(volume: BSplineVolume, problem: Elasticity) -> None:
    """Evaluate a problem's data where the coarsest solve needs them. Raises ExpressionError where not finite."""
    problem, space = problem.on(volume), trial_space(volume)
    _displacements(volume, space, problem)
    _add_tractions(volume, space, problem, np.zeros((3, *space.shape)))
    for _, fields in map_planes(volume, gauss_rule(space)):
        problem.force_at(*fields[:, 0])
        if problem.exact is not None:
            problem.exact_at(*fields[:, 0])


@functools.cache
def _warm_up() -> None:
    """Compile the kernels, or load them from the cache, so that no level's seconds contain it."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1)
    cube = BSplineVolume.uniform(corners, degree=1)
    _solve(cube, Elasticity(exact=("x*x", "y", "z")), trial_space(cube, 1), SolverOptions(max_iterations=10, threads=1))


def _solve(volume: BSplineVolume, problem: Elasticity, space: TrialSpace, options: SolverOptions) -> Solution:
    threads = options.thread_count
    clock = [time.process_time()]
    rule = gauss_rule(space)
    window = free_window(space, problem.dirichlet)
    system = assemble_elasticity(volume, space, problem.force_at, problem.constants, rule, window, threads)
    _add_tractions(volume, space, problem, system.load)
    coefficients = _displacements(volume, space, problem)
    right = (system.load - system.operator.apply(coefficients))[:, *window]
    blocks = [fast_diagonalization(system.operator.block(c), rule) for c in range(3)]

    def preconditioner(residual: Array) -> Array:
        return np.stack([block(part) for block, part in zip(blocks, residual, strict=True)])

    clock.append(time.process_time())
    result = conjugate_gradients(
        system.operator.apply_free, right, preconditioner, options.tolerance, options.max_iterations
    )
    coefficients[:, *window] = result.x
    clock.append(time.process_time())
    errors = _errors(volume, space, coefficients, problem, threads) if problem.exact is not None else None
    clock.append(time.process_time())
    judged = doubts(volume, problem, errors, coefficients.size)
    notices = (*judged.notices, *solve_notices(volume, space, system, options.certified, result))
    spline = np.moveaxis(coefficients, 0, -1)
    return solution_of(volume, space, spline, result, clock, errors, notices, judged.meaningful)


def _displacements(volume: BSplineVolume, space: TrialSpace, problem: Elasticity) -> Array:
    """Coefficients (3, n_u, n_v, n_w) of the displacement data, zero where they are free."""

    def component(c: int) -> Callable[[Array, Array, Array], Array]:
        return lambda x, y, z: problem.displacement_at(x, y, z)[c]

    return np.stack([boundary_coefficients(volume, space, component(c), problem.dirichlet) for c in range(3)])


def _add_tractions(volume: BSplineVolume, space: TrialSpace, problem: Elasticity, load: Array) -> None:
    """Add the tractions' load to (3, n_u, n_v, n_w), in place."""
    for name in problem.traction:
        rule = face_rule(volume, space, name)
        for component, pull in zip(load, problem.traction_at(name, rule.points, rule.normal), strict=True):
            component[rule.layer] += rule.integrate(pull)


def _errors(volume: BSplineVolume, space: TrialSpace, coefficients: Array, problem: Elasticity, threads: int) -> Errors:
    """Norms over the three components together."""

    def component(c: int) -> Callable[[Array, Array, Array], tuple[Array, Array | None]]:
        def exact(x: Array, y: Array, z: Array) -> tuple[Array, Array | None]:
            value, gradient = problem.exact_at(x, y, z)
            return value[c], None if gradient is None else gradient[c]

        return exact

    parts = [squared_errors(volume, space, coefficients[c], component(c), threads) for c in range(3)]
    return Errors.from_squares(np.sum([squares for squares, _ in parts], axis=0), all(known for _, known in parts))
