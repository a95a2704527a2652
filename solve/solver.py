"""One entrance for all problems: check, discretize, solve."""

import functools
import logging
from dataclasses import fields
from typing import Any

import numpy as np

from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import default_threads

from .discretization.operator import free_window
from .discretization.planes import map_planes
from .discretization.quadrature import gauss_rule
from .discretization.space import trial_space
from .forms.elasticity import Elasticity
from .forms.poisson import Poisson
from .forms.problem import BoundaryValueProblem, Problem
from .options import SolverOptions, SpaceOptions
from .solution import Solution
from .system import System, assemble_data, balanced, build, check_device

log = logging.getLogger(__name__)


def solve_problem(volume: BSplineVolume, problem: Poisson | Elasticity | Problem, **how: Any) -> Solution:
    """Solve a problem on a volume.

    how: the fields of `SpaceOptions`, refine, degree, threads and quadrature; and those of `SolverOptions`, tolerance,
    max_iterations, certified, device, start, estimate and strict.

    Raises ValueError for arguments out of range and for Neumann data that do not balance the source, ExpressionError
    where the data are not finite or have the wrong sign, TypeError for what is no problem or no volume.
    """
    of_space = {field.name for field in fields(SpaceOptions)} & how.keys()
    of_solver = {name: value for name, value in how.items() if name not in of_space}
    options = SolverOptions(**of_solver)
    _check_types(volume, problem)
    check_device(options.device, problem)
    return discretize(volume, problem, **{name: how[name] for name in of_space}).solve(**of_solver)


def discretize(volume: BSplineVolume, problem: Poisson | Elasticity | Problem, **how: Any) -> System:
    """Return the linear system of a problem, for loops of one's own. how: the fields of `SpaceOptions`.

    Raises what `solve_problem` does.
    """
    options = SpaceOptions(**how)
    _check_types(volume, problem)
    placed, space = problem.on(volume), trial_space(volume, options.refine, options.degree)
    if any(part.stop <= part.start for part in free_window(space, placed.dirichlet)):
        raise ValueError(f"degree {space.degrees} leaves no unknown inside the volume: raise refine or degree")
    _warm_up(volume.degrees, options.degree, placed.form.components == 1 and placed.form.symmetric)
    return build(volume, placed, space, options.threads or default_threads(), options.quadrature)


def check_problem(volume: BSplineVolume, problem: BoundaryValueProblem) -> None:
    """Evaluate a problem's data where the coarsest solve needs them; finer levels need them at points between.

    Raises ExpressionError where they are not finite or have the wrong sign, ValueError where they do not balance.
    """
    problem, space = problem.on(volume), trial_space(volume)
    assembled, _, _ = assemble_data(volume, problem, space, quadrature="gauss")
    if len(problem.natural) == 6 and not problem.form.has_reaction:
        balanced(assembled.load)
    if problem.exact is not None:
        for _, _, x in map_planes(volume, gauss_rule(space)):
            problem.exact_at(x)


def _check_types(volume: object, problem: object) -> None:
    if not isinstance(volume, BSplineVolume):
        raise TypeError(f"volume must be a BSplineVolume, got {type(volume).__name__}")
    if not isinstance(problem, BoundaryValueProblem):
        raise TypeError(f"problem must be a Poisson, an Elasticity or a Problem, got {type(problem).__name__}")


@functools.cache
def _warm_up(degrees: tuple[int, int, int], degree: int | None, is_scalar: bool) -> None:
    """Compile the kernels, or load them from the cache, so that no level's seconds contain it."""
    log.info("preparing the compiled kernels: some seconds on the first use, then they are cached")
    # A large block freed teaches glibc (mallopt(3), M_MMAP_THRESHOLD) to keep freed memory. Else every temporary of a
    # plane goes back to the system and is faulted in again: formulas take five times as long.
    np.empty(2**21)
    knots = [open_uniform_knots(p + 1, p) for p in degrees]
    rows = [greville(row, p) for row, p in zip(knots, degrees, strict=True)]
    cube = BSplineVolume(degrees, tuple(knots), np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1))  # type: ignore[arg-type]
    problem = Poisson(exact="x*x") if is_scalar else Elasticity(exact=("x*x", "y", "z"))
    build(cube, problem, trial_space(cube, 1, degree)).solve()
