"""Solves any problem: checks it, discretizes it, and solves the linear system."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from parameterize.arrays import listed
from parameterize.compilation import compilation_told
from parameterize.old_names import takes_volume
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume

from .assembly import assemble_body_data, balanced
from .discretization.on_regions import demand_area, demand_supports
from .discretization.parted import shared_unknowns
from .discretization.quadrature import gauss_rule, map_planes
from .discretization.slab import shared_space
from .discretization.space import TrialSpace, trial_space
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.elasticity import Elasticity
from .forms.poisson import Poisson
from .forms.problem import Problem
from .mixed import build_mixed, is_mixed
from .options import SolveOptions, check_device
from .patch_system import PatchProblem
from .solution import Solution
from .system import System, build


@takes_volume
def solve_problem(body: BodyLike, problem: Poisson | Elasticity | Problem, **how: Any) -> Solution:
    """Solve a problem on a volume, or on several patches.

    Parameters
    ----------
    body : BSplineVolume or Body
        The map, or the maps.
    problem : Poisson, Elasticity or Problem
        The law and its data.
    **how
        The options below, by name.

    Other Parameters
    ----------------
    refine : int
        Number of times that every span of the map's knots is halved for the trial space; 0 by default.
    degree : int, optional
        Degree of the trial space; the degree of the map by default.
    threads : int, optional
        Number of threads; the result does not depend on it. Default: NUMBA_NUM_THREADS, OMP_NUM_THREADS, or all cores.
    quadrature : str
        Rule of the operator: "spline", Gauss rules of the spline space with the points that the map and the law need;
        "gauss", `degree` Gauss points a span; "gauss+1", one point more. Errors always use degree + 2 points a span.
    comm : mpi4py.MPI.Comm, optional
        Communicator whose processes share the work, by default with one thread each; each returns the whole solution.
    formulation : str, optional
        "mixed" solves for the displacement and the pressure of an elastic body, "displacement" for the former alone. By
        default "mixed" where Poisson's ratio exceeds 0.45, the degree is at least 2, and one process does the work
        on the CPU.
    tolerance : float
        Tolerance of the residual, relative to the right-hand side; 1e-10 by default.
    max_iterations : int
        Largest number of iterations of the linear solver; 1000 by default.
    certified : str, optional
        Verdict of the map's certificate, if known; a verdict other than "certified" gives a notice.
    device : str
        "cpu", or "cuda" for the iteration on a GPU: for symmetric laws that are scalar or constant, in one process.
    start : SplineField or BodyField, optional
        Solution in a subspace, such as the space of one refinement less: the iteration starts there instead of at zero,
        which saves a third of the iterations on maps that need many.
    estimate : bool, optional
        Whether to estimate the error from the residual; by default where the problem has no exact solution.
    strict : bool
        Whether a failure of the linear solver raises ConvergenceError; otherwise `report.converged` is False. A failure
        before the first iteration leaves no solution, and always raises ConvergenceError.

    Returns
    -------
    Solution
        The spline u_h of each patch, its `field` and its `report`.

    Raises
    ------
    ValueError
        For arguments out of range and for Neumann data that do not balance the source.
    ExpressionError
        Where the data are not finite or have the wrong sign.
    TypeError
        For an object that is no problem or no volume, and for an unknown option.
    ConvergenceError
        Where the linear solver fails, see `strict`.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"), refine=1)
    >>> solution.report.dofs, solution.report.l2_relative < 1e-3
    (343, True)
    """
    return solve_with(body, problem, SolveOptions.of(how))


def solve_with(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions) -> Solution:
    """Return the solution of `solve_problem` for options in one object."""
    check_device(options.device, problem)
    return discretized(body, problem, options).solve_with(options)


@takes_volume
def discretize(
    body: BodyLike,
    problem: Poisson | Elasticity | Problem,
    *,
    refine: int = 0,
    degree: int | None = None,
    threads: int | None = None,
    quadrature: str = SolveOptions.quadrature,
    comm: Any = None,
    formulation: str | None = None,
) -> System:
    """Return the linear system of a problem, for a loop of the user's own.

    Parameters
    ----------
    body, problem, refine, degree, threads, quadrature, comm, formulation
        As in `iga_nn.solve`; the errors are the same, too.

    Returns
    -------
    System

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> system = iga_nn.discretize(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"), refine=1)
    >>> system.operator.shape, system.load.shape
    ((125, 125), (125,))
    """
    options = SolveOptions(
        refine=refine, degree=degree, threads=threads, quadrature=quadrature, comm=comm, formulation=formulation
    )
    return discretized(body, problem, options)


def discretized(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions, is_loose: bool = False) -> System:
    """Return the system of `discretize`; that of a loose body, for its modes, needs no supports."""
    glued = as_body(body)
    placed, patches = prepared(glued, problem, options)
    if not is_loose:
        problem.demand_held()
        if is_mixed(problem, patches, options):
            return build_mixed(glued, placed, patches, options)
    return build(glued, placed, patches, options, is_loose=is_loose)


def prepared(
    body: Body, problem: BoundaryValueProblem, options: SolveOptions
) -> tuple[BoundaryValueProblem, list[PatchProblem]]:
    """Check body and problem; return the problem placed in the body, and the problem on each patch."""
    placed, patches = _on_patches(body, problem, options)
    if all(any(part.stop <= part.start for part in patch.space.free) for patch in patches):
        raise ValueError(
            f"degree {patches[0].space.degrees} leaves no unknown inside the volume: raise refine or degree"
        )
    for of_map in {patch.volume.degrees for patch in patches}:
        _warm_up(of_map, options.degree, placed.form.components == 1 and placed.form.symmetric)
    return placed, patches


def _on_patches(
    body: Body, problem: BoundaryValueProblem, options: SolveOptions
) -> tuple[BoundaryValueProblem, list[PatchProblem]]:
    """Return the problem placed in the body, and the problem on each patch."""
    if not isinstance(problem, BoundaryValueProblem):
        raise TypeError(f"problem must be a Poisson, an Elasticity or a Problem, got {type(problem).__name__}")
    _demand_known_faces(body, problem)
    placed, spaces = problem.on(body), dict[Any, TrialSpace]()
    patches = []
    for volume, own, outer in zip(body, placed.on_patches(body), body.outer, strict=True):
        key = volume.degrees, *(row.tobytes() for row in volume.knots), own.dirichlet, outer
        if key not in spaces:
            spaces[key] = trial_space(volume, options.refine, options.degree, own.dirichlet, outer)
        patches.append(PatchProblem(volume, own, spaces[key]))
    if body.is_single:
        patches = [replace(patches[0], space=shared_space(patches[0].space, options.comm))]
    return placed, patches


def _demand_known_faces(body: Body, problem: BoundaryValueProblem) -> None:
    """Raise ValueError for data of faces that are not outer faces of the body."""
    outer = {body.face_name(*face) for face in body.outer_faces}
    if unknown := sorted(problem.patch_faces - outer):
        faces = "u0 to w1" if body.is_single else listed(sorted(outer), 12)
        raise ValueError(f"{unknown[0]} is no outer face of the body; its faces are {faces}")


def check_problem(body: BodyLike, problem: BoundaryValueProblem, comm: Any = None) -> None:
    """Evaluate a problem's data at the points of the coarsest solve; finer levels use points between these.

    comm: a communicator of mpi4py whose processes share the work. Raises ExpressionError where the data are not finite
    or have the wrong sign, ValueError where they do not balance.
    """
    problem.demand_held()
    options = SolveOptions(threads=1, quadrature="gauss", comm=comm)
    glued = as_body(body)
    _, patches = _on_patches(glued, problem, options)
    unknowns = shared_unknowns(glued, [patch.space for patch in patches], comm)
    own = [patches[number] for number in unknowns.patches]
    with unknowns.agreed():
        matrix, loads, _ = assemble_body_data(own, options)
    faces = matrix.weak
    demand_area(problem, faces, unknowns.processes, glued.patches)
    if problem.fixes_nothing and problem.conditions:
        demand_supports(problem, faces, unknowns.processes, glued.patches)
    if problem.fixes_nothing and not problem.form.has_reaction:
        balanced(unknowns.collect(loads), unknowns)
    if problem.exact is not None:
        with unknowns.agreed():
            for patch in own:
                with patch.space.agreed():
                    for _, _, x in map_planes(patch.volume, gauss_rule(patch.space)):
                        patch.problem.exact_at(x)


@functools.cache
def _warm_up(degrees: tuple[int, int, int], degree: int | None, is_scalar: bool) -> None:
    """Compile the kernels, or load them from the cache, so that the seconds of no level include the compilation."""
    # A large block freed teaches glibc (mallopt(3), M_MMAP_THRESHOLD) to keep freed memory. Else every temporary of a
    # plane goes back to the system and is faulted in again: formulas take five times as long.
    np.empty(2**21)
    knots = [open_uniform_knots(p + 1, p) for p in degrees]
    rows = [greville(row, p) for row, p in zip(knots, degrees, strict=True)]
    cube = as_body(BSplineVolume(degrees, tuple(knots), np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)))  # type: ignore[arg-type]
    problem = Poisson(exact="sin(x)") if is_scalar else Elasticity(exact=("sin(x)", "y", "z"))
    with compilation_told():
        options = SolveOptions(refine=1, degree=degree, threads=1)
        build(cube, *_on_patches(cube, problem, options), options).solve()
