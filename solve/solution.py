"""Solution: the spline that a solve returns, with its map and report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .discretization.norms import Errors
from .discretization.space import TrialSpace, longest_edge
from .estimate import Problem, error_estimate
from .field import SplineField
from .linear.cg import LinearResult
from .meaning import doubtful_estimate
from .report import SolveReport


@dataclass(frozen=True, eq=False)
class Solution(SplineField):
    """The discrete solution: a spline of the parameters, the map it lives on, and the report."""

    geometry: BSplineVolume
    report: SolveReport


def solution_of(
    volume: BSplineVolume,
    space: TrialSpace,
    coefficients: Array,
    result: LinearResult,
    clock: Sequence[float],
    errors: Errors | None,
    notices: tuple[str, ...],
    meaningful: bool,
) -> Solution:
    """Spline and report of a solve. clock: process seconds before and after set-up, after iteration and errors."""
    report = SolveReport(
        elements=space.elements,
        dofs=coefficients.size,
        h=longest_edge(volume, space),
        iterations=result.iterations,
        converged=result.converged,
        residual=result.residuals[-1],
        seconds=dict(zip(("setup", "solve", "errors"), np.diff(clock).tolist(), strict=True)),
        errors=errors,
        notices=notices,
        meaningful=meaningful,
        residuals=result.residuals,
    )
    return Solution(space.degrees, space.knots, coefficients, volume, report)


def with_estimate(solution: Solution, space: TrialSpace, problem: Problem) -> Solution:
    """The same solution with the estimated error in its report; the time it takes counts as that of the errors."""
    start = time.process_time()
    coefficients = solution.coefficients
    components = coefficients[None] if coefficients.ndim == 3 else np.moveaxis(coefficients, -1, 0)
    found = error_estimate(solution.geometry, space, components, problem)
    seconds = solution.report.seconds
    seconds = seconds | {"errors": seconds["errors"] + time.process_time() - start}
    doubtful = doubtful_estimate(found)
    report = replace(
        solution.report,
        estimate=found,
        seconds=seconds,
        notices=(*doubtful, *solution.report.notices),  # the last one may be that of a solver that did not converge
        meaningful=solution.report.meaningful and not doubtful,
    )
    return replace(solution, report=report)
