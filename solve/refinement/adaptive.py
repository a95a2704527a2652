"""Defines `adaptive`, which refines a problem on a body until what is asked is known as well as wanted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

from parameterize.display import Shown
from parameterize.spline.body import BodyLike, as_body

from ..asked.functional import functional
from ..discretization.grading import Grading
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..options import SolveOptions, check_device
from ..solution import Solution
from .loop import AdaptiveSolve, Limits, Step

ACCURACY = 0.02
TOLERANCE = 1e-8  # of the linear solver, by default: asked quantities then have seven digits
MOST_UNKNOWNS = 2_000_000
FEW = 64  # patches: their single spans are halved at first, for one degree more tells nothing of what is even in one


@dataclass(frozen=True, eq=False)
class Adapted(Shown):
    """Hold what a refinement found; printed as one line a step.

    Attributes
    ----------
    steps : tuple of Step
        The solves, coarsest first: each with its `grading`, `solution`, `energy_error`, `excess` and `seconds`.
    accuracy : float
        The accuracy that was wanted.
    stopped : str
        "" where it is reached, otherwise what stopped the refinement.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> problem = iga_nn.Poisson(source="1", boundary="0")
    >>> found = iga_nn.adaptive(benchmark_volume(1), problem, 0.05, ask="u at (0.5, 0.5, 0.5)")
    >>> found.reached, found.solution.answers[0].width <= 0.05
    (True, True)
    """

    steps: tuple[Step, ...] = field(repr=False)
    accuracy: float
    stopped: str

    @property
    def reached(self) -> bool:
        """Return whether the accuracy is reached."""
        return not self.stopped

    @property
    def solution(self) -> Solution:
        """Return the solution of the last step."""
        return self.steps[-1].solution

    def __str__(self) -> str:
        lines = [_line(step) for step in self.steps]
        end = "reached" if self.reached else f"not reached: {self.stopped}"
        return "\n".join([*lines, f"accuracy {100.0 * self.accuracy:g} % {end}"])


def _line(step: Step) -> str:
    asked = [f"{one.ask} = {one.value:.6g} ± {100.0 * (one.width or math.nan):.2g} %" for one in step.solution.answers]
    return ", ".join(
        [f"{step.solution.report.dofs} dofs", f"estimated energy error {100.0 * step.energy_error:.2g} %", *asked]
    )


def adaptive(
    body: BodyLike,
    problem: BoundaryValueProblem,
    accuracy: float = ACCURACY,
    *,
    max_unknowns: float = MOST_UNKNOWNS,
    time_limit: float = math.inf,
    callback: Callable[[Step], object] | None = None,
    **how: Any,
) -> Adapted:
    """Solve, and refine where it counts, until what is asked is known as well as wanted.

    Parameters
    ----------
    body, problem
        As in `iga_nn.solve`.
    accuracy : float
        Half of each interval over its value, 0.02 for 2 %. Without `ask` it is the estimated error in the energy norm,
        over the norm of the solution.
    max_unknowns : float
        The most unknowns of one solve.
    time_limit : float
        Seconds after which no further solve starts.
    callback : function, optional
        Called with each `Step` as soon as it is done.
    **how
        Options of `iga_nn.solve`: ask, degree, tolerance (1e-8 here) and others; refine and grading are those of the
        first solve.

    Returns
    -------
    Adapted
        Its `solution`, the `steps` to it, and whether the accuracy is `reached`, or what `stopped` the refinement.

    Raises
    ------
    ValueError
        As `iga_nn.solve`, for an accuracy that is no number between 0 and 1, and for several processes.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> print(iga_nn.adaptive(benchmark_volume(1), iga_nn.Poisson(exact="x*y*z"), 0.01).reached)
    True
    """
    options = SolveOptions.of({"tolerance": TOLERANCE} | how)
    limits = Limits(unknowns=max_unknowns, seconds=time_limit)
    refinement = refinement_of(body, problem, options, accuracy, limits)
    steps = []
    for step in refinement.steps():
        steps.append(step)
        if callback is not None:
            callback(step)
    return Adapted(tuple(steps), accuracy, refinement.stopped)


def refinement_of(
    body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions, accuracy: float, limits: Limits
) -> AdaptiveSolve:
    """Return the refinement of `adaptive`, to be iterated over. Raises ValueError as `adaptive`."""
    if not (isinstance(accuracy, Real) and 0.0 < accuracy < 1.0):
        raise ValueError(f"accuracy must be a number between 0 and 1, such as 0.02 for 2 %, got {accuracy!r:.80}")
    if options.comm is not None:
        raise ValueError("an accuracy is refined for in one process: leave comm out")
    check_device(options.device, problem)
    glued = as_body(body)
    functionals = [functional(ask, problem, glued) for ask in options.ask]
    grading = (options.grading or Grading.of(glued)).uniform(options.refine)
    if len(glued) <= FEW:
        grading = grading.refined({sheet: [count == 1] * count for sheet, count in enumerate(grading.spans)})
    return AdaptiveSolve(glued, problem, replace(options, refine=0), grading, accuracy, functionals, limits)
