"""Data that contradict the exact solution beside them: the errors are then no measure of the discretization."""

from __future__ import annotations

import numpy as np

from parameterize.spline.volume import AXES, BSplineVolume

from .forms.formula import ExpressionError
from .forms.problem import Poisson

SAMPLES = np.linspace(0.05, 0.95, 7)  # parameters per direction
TOLERANCE = 1e-6


def contradictions(volume: BSplineVolume, problem: Poisson) -> tuple[str, ...]:
    """What does not fit a problem's exact formula on the volume, one line each; none without such a formula.

    Source and Dirichlet data are compared with those of the formula at 7 points per direction, unless that is not
    finite there.
    """
    if not isinstance(problem.exact, str):
        return ()
    found = []
    if problem.source is None:
        if "abs" in problem.exact:
            found.append(
                "exact contains abs: where its argument changes sign, u has a kink that the source derived from it "
                "does not know, and the errors stay"
            )
    elif problem.is_differentiable and not _source_fits(volume, problem):
        found.append("source is not that of exact: the errors compare the solutions of two problems")
    if problem.boundary is not None and not all(_values_fit(volume, problem, face) for face in problem.dirichlet):
        found.append("boundary differs from exact: the errors compare the solutions of two problems")
    return tuple(found)


def _source_fits(volume: BSplineVolume, problem: Poisson) -> bool:
    """Rounding is measured by the second derivatives, which may cancel in the source."""
    points = np.moveaxis(volume.grid(SAMPLES, SAMPLES, SAMPLES), -1, 0)
    given = problem.source_at(*points)
    try:
        derived = problem.source_of_exact(*points)
    except ExpressionError:  # perhaps the reason why the source is given
        return True
    scale = max(np.abs(given).max(), np.abs(problem.exact_hessian(*points)).max())
    return bool(np.abs(given - derived).max() <= TOLERANCE * scale)


def _values_fit(volume: BSplineVolume, problem: Poisson, face: str) -> bool:
    axis, side = AXES.index(face[0]), float(face[1])
    u, v, w = (np.array([side]) if a == axis else SAMPLES for a in range(3))
    points = np.moveaxis(volume.grid(u, v, w), -1, 0)
    given = problem.boundary_at(*points)
    try:
        exact, _ = problem.exact_at(*points)
    except ExpressionError:
        return True
    return bool(np.abs(given - exact).max() <= TOLERANCE * max(np.abs(given).max(), np.abs(exact).max()))
