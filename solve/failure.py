"""When a solve cannot be trusted: what is said of the map and of a linear solver that did not converge."""

from __future__ import annotations

import logging
from collections.abc import Collection

import numpy as np

from parameterize.arrays import Array
from parameterize.quality.quality import scaled_jacobian
from parameterize.spline.volume import AXES, BSplineVolume

from .discretization.assembly import Assembled
from .discretization.operator import free_window
from .discretization.planes import map_planes
from .discretization.quadrature import gauss_rule
from .discretization.space import TrialSpace
from .linear.cg import LinearResult
from .solution import Solution

log = logging.getLogger(__name__)


class ConvergenceError(RuntimeError):
    """The linear solver did not reach its tolerance; the last iterate is `solution`."""

    def __init__(self, solution: Solution) -> None:
        super().__init__(solution.report.notices[-1])
        self.solution = solution


def announce(solution: Solution, strict: bool) -> None:
    """Log a solution's notices; raise ConvergenceError where it has not converged and `strict` is asked for."""
    for notice in solution.report.notices:
        log.warning("%s", notice)
    if strict and not solution.report.converged:
        raise ConvergenceError(solution)


def check_unknowns(space: TrialSpace, dirichlet: Collection[str]) -> None:
    """Raise ValueError where data on the named faces leave nothing to solve for."""
    if any(part.stop <= part.start for part in free_window(space, dirichlet)):
        raise ValueError(f"degree {space.degrees} leaves no unknown inside the volume: raise refine or degree")


def solve_notices(
    volume: BSplineVolume,
    space: TrialSpace,
    assembled: Assembled,
    certified: str | None,
    result: LinearResult,
) -> tuple[str, ...]:
    """What the reader of a solve's numbers must know; the last line is that of a solver that did not converge."""
    notices = []
    if certified not in (None, "certified"):
        notices.append(f"the map is {certified}, not certified: do not trust the solution")
    if assembled.folded:
        notices.append(
            f"det J < 0 at {assembled.folded} of {assembled.points} Gauss points: solved with |det J| instead"
        )
    if not result.converged:
        notices.append(_no_convergence(volume, space, result))
    return tuple(notices)


def _no_convergence(volume: BSplineVolume, space: TrialSpace, result: LinearResult) -> str:
    parameters, point, scaled = worst_place(volume, space)
    cube = ", ".join(f"{axis}={value:.4g}" for axis, value in zip(AXES, parameters, strict=True))
    where = ", ".join(f"{axis}={value:.4g}" for axis, value in zip("xyz", point, strict=True))
    residuals = result.residuals
    return (
        f"no convergence: residual {residuals[0]:.1e} at the start, {residuals[-1]:.1e} after {result.iterations} "
        f"iterations (lowest {min(residuals):.1e}); the map is worst at {cube} ({where}): scaled Jacobian {scaled:.2g}"
    )


def worst_place(volume: BSplineVolume, space: TrialSpace) -> tuple[Array, Array, float]:
    """Where the map's scaled Jacobian, det J over the product of its columns' lengths, is least at the Gauss points.

    Returns parameters (3,), the point in space (3,) and the value there: 1 where the parameter lines meet at right
    angles, 0 where the map degenerates.
    """
    rule = gauss_rule(space)
    parameters, point, least = np.zeros(3), np.zeros(3), np.inf
    for q, fields, _ in map_planes(volume, rule):
        jacobian = np.moveaxis(fields[:, 1:], (0, 1), (2, 3))  # (q_w, q_v, 3, 3)
        scaled = scaled_jacobian(jacobian)
        w, v = (int(i) for i in np.unravel_index(np.argmin(scaled), scaled.shape))
        if scaled[w, v] < least:
            least = float(scaled[w, v])
            parameters = np.array([rule.points[a][i] for a, i in enumerate((q, v, w))])
            point = fields[:, 0, w, v].copy()
    return parameters, point, least
