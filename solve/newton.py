"""Solves laws that are not linear by Newton's method: exact derivatives by jets, a line search, load steps."""

from numbers import Integral

from parameterize.old_names import takes_volume
from parameterize.spline.body import BodyLike, as_body
from parameterize.threads import one_blas_thread

from .discretization.grading import Grading
from .equilibrium import Equilibrium
from .field import FieldOnBody
from .forms.problem import Problem
from .options import SolveOptions
from .preparation import prepared
from .solution import Solution
from .system import coefficients_in


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
    with one_blas_thread():
        balance = Equilibrium.of(whole, placed, patches, options, linear_iterations)
        full = balance.at_rest
        if start is not None:
            full = full.layout.joined(coefficients_in(start, patches))
        history: list[float] = []
        for step in range(1, load_steps + 1):
            full = balance.found(full, step / load_steps, history)
            balance = balance.advanced(full)
        return balance.solution(full, history, load_steps)
