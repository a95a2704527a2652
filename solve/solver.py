"""Solves any problem: a solve, the system for a loop of one's own, and the check of a problem's data before them."""

from dataclasses import replace
from typing import Any

from parameterize.old_names import takes_volume
from parameterize.spline.body import BodyLike, as_body

from .answer import NOT_ESTIMATED
from .asked.away import away
from .asked.functional import functional
from .asked.interval import answers
from .assembly import assemble_body_data, balanced
from .discretization.grading import Grading
from .discretization.on_regions import demand_area, demand_supports
from .discretization.parted import shared_unknowns
from .discretization.quadrature import gauss_rule, map_planes
from .equilibrium import laws_of_faces
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.elasticity import Elasticity
from .forms.nonlinear_body import NonlinearBody
from .forms.poisson import Poisson
from .forms.problem import Problem
from .load_path import along_the_load
from .motions import at_rest, has_rigid, solved_with_motions
from .options import SolveOptions, check_device
from .preparation import discretized, on_patches
from .solution import Solution
from .system import System


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
    grading : Grading, optional
        Breakpoints of the trial space that are finer at some places; the map's own by default. `refine` halves their
        spans, too.
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
    ask : Ask or str, or a list of these
        Quantities to answer, each with an interval, such as "ux at (10, 0, 0)", "von_mises max over z > 20", "mean T
        over nz > 0.9", "reaction z of u0", "flow over u1" and "energy": `solution.answers`.
    load_steps : int
        For a law that is not linear, such as `Plasticity` and `NeoHookean`: number of equal steps in which loads and
        given displacements grow; 10 by default. A step that has no solution is halved, and where halving ends, so does
        the load: `report.load_factor` is the share that the body carries, and `report.converged` is False.
    keep : object, optional
        Where the load steps are kept, with methods `save` and `load`: an interrupted solve goes on after the last one.
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
        For arguments out of range, for Neumann data that do not balance the source, and for an ask that is not one of
        the problem and the body.
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
    if isinstance(problem, NonlinearBody):
        return along_the_load(body, problem, options)
    if has_rigid(problem):
        return _with_motions(body, problem, options)
    functionals = [functional(ask, problem, body) for ask in options.ask]
    system = discretized(body, problem, options)
    solution = system.solve_with(options)
    if not functionals:
        return solution
    found = answers(system, solution, functionals, options)
    return replace(solution, report=replace(solution.report, asked=found))


def _with_motions(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions) -> Solution:
    """Return the solution of a problem with rigid regions; asks have no intervals."""
    functionals = [functional(ask, problem, body) for ask in options.ask]
    _, solution = solved_with_motions(problem, options, lambda still: discretized(body, still, options))
    found = tuple(
        replace(one.answer(solution), why=f"{NOT_ESTIMATED}: the motion of a rigid region is found by the solve")
        for one in (away(one, solution) for one in functionals)
    )
    return replace(solution, report=replace(solution.report, asked=found)) if found else solution


@takes_volume
def discretize(
    body: BodyLike,
    problem: Poisson | Elasticity | Problem,
    *,
    refine: int = 0,
    degree: int | None = None,
    grading: Grading | None = None,
    threads: int | None = None,
    quadrature: str = SolveOptions.quadrature,
    comm: Any = None,
    formulation: str | None = None,
) -> System:
    """Return the linear system of a problem, for a loop of the user's own.

    Parameters
    ----------
    body, problem, refine, degree, grading, threads, quadrature, comm, formulation
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
        refine=refine,
        degree=degree,
        grading=grading,
        threads=threads,
        quadrature=quadrature,
        comm=comm,
        formulation=formulation,
    )
    return discretized(body, problem, options)


def check_problem(body: BodyLike, problem: BoundaryValueProblem, comm: Any = None) -> None:
    """Evaluate a problem's data at the points of the coarsest solve; finer levels use points between these.

    comm: a communicator of mpi4py whose processes share the work. Raises ExpressionError where the data are not finite
    or have the wrong sign, ValueError where they do not balance.
    """
    problem.demand_held()
    problem = at_rest(problem, comm)
    options = SolveOptions(threads=1, quadrature="gauss", comm=comm)
    glued = as_body(body)
    placed, patches = on_patches(glued, problem, options)
    patches = laws_of_faces(placed, patches)
    unknowns = shared_unknowns(glued, [patch.space for patch in patches], comm)
    own = [patches[number] for number in unknowns.patches]
    found = assemble_body_data(own, options, unknowns)
    faces, loads = found.matrix.weak, found.loads
    demand_area(problem, faces, unknowns.processes, glued.patches)
    if problem.fixes_nothing and problem.conditions:
        demand_supports(problem, faces, unknowns.processes, glued.patches, found.matrix.couplings)
    if problem.fixes_nothing and not problem.form.has_reaction:
        balanced(unknowns.collect(loads), unknowns)
    if problem.exact is not None:
        with unknowns.agreed():
            for patch in own:
                with patch.space.agreed():
                    for _, _, x in map_planes(patch.volume, gauss_rule(patch.space)):
                        patch.problem.exact_at(x)
