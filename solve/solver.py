"""One entrance for all problems: check, discretize, solve."""

from __future__ import annotations

import functools
import logging
import time
from dataclasses import replace
from typing import Any

import numpy as np

from parameterize.spline.volume import BSplineVolume

from .balance import balanced
from .discretization.assembly import assemble
from .discretization.operator import prepare
from .discretization.planes import map_planes
from .discretization.quadrature import gauss_rule
from .discretization.space import trial_space
from .failure import check_unknowns
from .forms.elasticity import Elasticity
from .forms.poisson import Poisson
from .forms.problem import BoundaryValueProblem, Problem
from .options import SolverOptions
from .solution import Solution
from .system import MassForm, System, assemble_data, build, check_device, problem_rule
from .threads import checked_threads

log = logging.getLogger(__name__)


def solve_problem(
    volume: BSplineVolume,
    problem: Poisson | Elasticity | Problem,
    *,
    refine: int = 0,
    degree: int | None = None,
    threads: int | None = None,
    quadrature: str = "spline",
    **how: Any,
) -> Solution:
    """Solve a problem on a volume.

    refine: how often every span of the map's knots is halved for the trial space; degree: default the map's own.
    threads: default NUMBA_NUM_THREADS, OMP_NUM_THREADS or the cores at hand; the result is the same for any number.
    quadrature: of the operator: "spline", Gauss rules of the spline space, as many points as the map and the law need;
        "gauss", `degree` Gauss points a span; "gauss+1", one more. Errors have degree + 2 points a span in any case.
    how: the fields of `SolverOptions`: tolerance, max_iterations, certified, device, start, estimate, strict.

    Raises ValueError for arguments out of range and for Neumann data that do not balance the source, ExpressionError
    where the data are not finite or have the wrong sign, TypeError for what is no problem or no volume.
    """
    options = SolverOptions(**how)
    _check_types(volume, problem)
    check_device(options.device, problem)
    system = discretize(volume, problem, refine=refine, degree=degree, threads=threads, quadrature=quadrature)
    return system.solve(**how)


def discretize(
    volume: BSplineVolume,
    problem: Poisson | Elasticity | Problem,
    *,
    refine: int = 0,
    degree: int | None = None,
    threads: int | None = None,
    quadrature: str = "spline",
) -> System:
    """Return the linear system of a problem, for loops of one's own; arguments and errors as in `solve_problem`."""
    _check_types(volume, problem)
    count, placed, space = checked_threads(threads), problem.on(volume), trial_space(volume, refine, degree)
    check_unknowns(space, placed.dirichlet)
    _warm_up(placed.form.components == 1 and placed.form.symmetric)
    start = time.process_time()
    rule = problem_rule(volume, placed, space, quadrature)
    chosen = time.process_time() - start
    prepare(space, rule, placed.form.has_reaction)
    system = build(volume, placed, space, count, rule)
    return replace(system, setup=system.setup + chosen)


def check_problem(volume: BSplineVolume, problem: BoundaryValueProblem) -> None:
    """Evaluate a problem's data where the coarsest solve needs them; finer levels need them at points between.

    Raises ExpressionError where they are not finite or have the wrong sign, ValueError where they do not balance.
    """
    problem, space = problem.on(volume), trial_space(volume)
    rule = gauss_rule(space)
    assembled, _, _ = assemble_data(volume, problem, space, rule)
    if len(problem.natural) == 6 and not problem.form.has_reaction:
        balanced(assembled.load)
    if problem.exact is not None:
        for _, _, x in map_planes(volume, rule):
            problem.exact_at(x)


def _check_types(volume: object, problem: object) -> None:
    if not isinstance(volume, BSplineVolume):
        raise TypeError(f"volume must be a BSplineVolume, got {type(volume).__name__}")
    if not isinstance(problem, BoundaryValueProblem):
        raise TypeError(f"problem must be a Poisson, an Elasticity or a Problem, got {type(problem).__name__}")


@functools.cache
def _warm_up(is_scalar: bool) -> None:
    """Compile the kernels, or load them from the cache, so that no level's seconds contain it."""
    log.info("preparing the compiled kernels: some seconds on the first use, then they are cached")
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1)
    cube = BSplineVolume.uniform(corners, degree=1)
    space = trial_space(cube, 1)
    if is_scalar:
        for kappa in ("1", ["1", "0", "0", "1", "0", "1"]):
            build(cube, Poisson(exact="x*x", kappa=kappa), space).solve()
    else:
        build(cube, Elasticity(exact=("x*x", "y", "z")), space).solve()
        assemble(cube, space, MassForm(), is_scalar=False).operator.apply(np.zeros((1, *space.shape)))
