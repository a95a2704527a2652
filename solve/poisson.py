"""solve_poisson: from a volume and a scalar problem to a solution with its errors."""

from __future__ import annotations

import functools
import logging
import time
from collections.abc import Mapping

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .balance import balanced, missing_mean
from .contradiction import contradictions
from .discretization.dirichlet import boundary_coefficients
from .discretization.natural import FaceMass, RobinOperator, face_rule
from .discretization.norms import error_norms
from .discretization.operator import Operator, System, Window, assemble, free_window, prepare
from .discretization.planes import map_planes
from .discretization.quadrature import GaussRule, gauss_rule
from .discretization.space import TrialSpace, embedded, trial_space
from .failure import announce, check_unknowns, solve_notices
from .field import SplineField
from .forms.elastic_problem import Elasticity
from .forms.problem import Poisson
from .linear.cg import LinearResult, conjugate_gradients
from .linear.preconditioner import FastDiagonalization, fast_diagonalization
from .meaning import doubts
from .options import SolverOptions
from .solution import Solution, solution_of, with_estimate
from .threads import one_blas_thread

DEVICES = ("cpu", "cuda")

log = logging.getLogger(__name__)


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
    estimate: bool | None = None,
    threads: int | None = None,
    device: str = "cpu",
    start: SplineField | None = None,
) -> Solution:
    """Solve -div(kappa grad u) + c u = f on a volume.

    refine: how often every span of the map's knots is halved for the trial space; degree: default the map's own.
    tolerance: of |r| / |b| for the linear solver.
    certified: the verdict of the map's certificate, if known; anything but "certified" is logged and noted.
    threads: default NUMBA_NUM_THREADS, OMP_NUM_THREADS or the cores at hand; the result is the same for any number.
    device: "cpu", or "cuda" for the iteration on a GPU by torch (not with Robin faces).
    start: a solution in a space that this one contains, as that of one refinement less: the iteration starts there
        instead of at zero, and saves a third on maps that take many.
    estimate: of the error, from the residual; default: where the problem has no exact solution.
    strict: raise ConvergenceError where the linear solver fails; otherwise the report says `converged` is False.

    Raises ValueError for arguments out of range and for Neumann data that do not balance the source, ExpressionError
    where the data are not finite or have the wrong sign.
    """
    options = SolverOptions(
        tolerance=tolerance,
        max_iterations=max_iterations,
        certified=certified,
        threads=threads,
        device=device,
        start=start,
    )
    check_device(device, problem)
    problem = problem.on(volume)
    space = trial_space(volume, refine, degree)
    check_unknowns(space, problem.dirichlet)
    _warm_up()
    prepare(space, problem.reaction is not None)
    with one_blas_thread():
        solution = _solve(volume, problem, space, options)
        if estimate or (estimate is None and problem.exact is None):
            solution = with_estimate(solution, space, problem)
    announce(solution, strict)
    return solution


def check_data(volume: BSplineVolume, problem: Poisson) -> None:
    """Evaluate a problem's data where the coarsest solve needs them; finer levels need them at points between.

    Raises ExpressionError where they are not finite or have the wrong sign, ValueError where they do not balance.
    """
    problem, space = problem.on(volume), trial_space(volume)
    boundary_coefficients(volume, space, problem.boundary_at, problem.dirichlet)
    system = _assemble(volume, space, problem, gauss_rule(space))
    _add_faces(volume, space, problem, system.load)
    if problem.is_floating:
        balanced(system.load)
    if problem.exact is not None:
        for _, fields in map_planes(volume, gauss_rule(space)):
            problem.exact_at(*fields[:, 0])


def _assemble(volume: BSplineVolume, space: TrialSpace, problem: Poisson, rule: GaussRule, threads: int = 1) -> System:
    return assemble(
        volume,
        space,
        problem.source_at,
        rule,
        kappa=None if problem.kappa is None else problem.kappa_at,
        reaction=None if problem.reaction is None else problem.reaction_at,
        window=free_window(space, problem.dirichlet),
        threads=threads,
    )


def check_device(device: str, problem: Poisson | Elasticity) -> None:
    """Raise ValueError for a device that is unknown or absent, or that cannot solve the problem."""
    if device not in DEVICES:
        raise ValueError(f"device must be one of {', '.join(DEVICES)}, got {device!r}")
    if device != "cpu":
        if isinstance(problem, Elasticity):
            raise ValueError(f"elasticity runs on device='cpu' only, got device={device!r}")
        if problem.robin:
            raise ValueError(f"Robin faces run on device='cpu' only, got device={device!r}")
        from .linear.cuda import check_available  # torch comes in here only

        check_available(device)


@functools.cache
def _warm_up() -> None:
    """Compile the kernels, or load them from the cache, so that no level's seconds contain it."""
    log.info("preparing the compiled kernels: some seconds on the first use, then they are cached")
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1)
    cube = BSplineVolume.uniform(corners, degree=1)
    for problem in (Poisson(exact="x*x"), Poisson(exact="x*x", kappa=["1", "0", "0", "1", "0", "1"])):
        _solve(cube, problem, trial_space(cube, 1), SolverOptions(max_iterations=10, threads=1))


def _solve(volume: BSplineVolume, problem: Poisson, space: TrialSpace, options: SolverOptions) -> Solution:
    clock = [time.process_time()]
    rule = gauss_rule(space)
    system = _assemble(volume, space, problem, rule, options.thread_count)
    robin = _add_faces(volume, space, problem, system.load)
    operator = RobinOperator(system.operator, tuple(robin.values())) if robin else system.operator
    coefficients = boundary_coefficients(volume, space, problem.boundary_at, problem.dirichlet)
    window = system.operator.window
    right = (system.load - operator.apply(coefficients))[window]
    preconditioner = _preconditioner(system.operator, rule, robin)
    if preconditioner.singular:
        right = balanced(right)
    clock.append(time.process_time())
    result = _iterate(operator, right, preconditioner, options, _first_guess(options.start, space, window))
    coefficients[window] = result.x
    if preconditioner.singular:
        coefficients += missing_mean(volume, space, coefficients, problem)
    clock.append(time.process_time())
    errors = None
    if problem.exact is not None:
        errors = error_norms(volume, space, coefficients, problem.exact_at, options.thread_count)
    clock.append(time.process_time())
    contradictory = contradictions(volume, problem)
    judged = doubts(volume, problem, None if contradictory else errors, coefficients.size)
    notices = (*contradictory, *judged.notices, *solve_notices(volume, space, system, options.certified, result))
    return solution_of(volume, space, coefficients, result, clock, errors, notices, judged.meaningful)


def _iterate(
    operator: Operator | RobinOperator,
    right: Array,
    preconditioner: FastDiagonalization,
    options: SolverOptions,
    guess: Array | None,
) -> LinearResult:
    tolerance, most = options.tolerance, options.max_iterations
    if options.device == "cpu":
        return conjugate_gradients(operator.apply_free, right, preconditioner, tolerance, most, guess)
    from .linear.cuda import solve_on_device

    assert isinstance(operator, Operator)
    return solve_on_device(operator, preconditioner, right, tolerance, most, options.device, guess)


def _first_guess(start: SplineField | None, space: TrialSpace, window: Window) -> Array | None:
    return None if start is None else embedded(start.coefficients, start.degrees, start.knots, space)[window]


def _add_faces(volume: BSplineVolume, space: TrialSpace, problem: Poisson, load: Array) -> dict[str, FaceMass]:
    """Add Neumann's and Robin's data to the load (n_u, n_v, n_w), in place; the terms of the Robin faces by name."""
    terms = {}
    for name in (*problem.neumann, *problem.robin):
        rule = face_rule(volume, space, name)
        if name in problem.neumann:
            data = problem.flux_at(name, rule.points, rule.normal)
        else:
            alpha, data = problem.robin_at(name, rule.points, rule.normal)
            terms[name] = FaceMass(rule, alpha * rule.measure)
        load[rule.layer] += rule.integrate(data)
    return terms


def _preconditioner(operator: Operator, rule: GaussRule, robin: Mapping[str, FaceMass]) -> FastDiagonalization:
    extra = np.zeros(operator.space.shape)
    for term in robin.values():
        term.add_diagonal(extra)
    return fast_diagonalization(operator, rule, {name: term.mean for name, term in robin.items()}, extra)
