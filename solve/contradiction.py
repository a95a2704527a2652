"""Data that contradict the exact solution beside them: the errors are then no measure of the discretization."""

from __future__ import annotations

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import AXES, BSplineVolume

from .field import Points
from .forms.parser import ExpressionError
from .forms.problem import BoundaryValueProblem

SAMPLES = np.linspace(0.05, 0.95, 7)  # parameters per direction
TOLERANCE = 1e-6
TWO_PROBLEMS = "the errors compare the solutions of two problems"


def contradictions(volume: BSplineVolume, problem: BoundaryValueProblem) -> tuple[str, ...]:
    """Return what does not fit a problem's exact formulas on the volume, one line each; none without such formulas.

    Source and Dirichlet data are compared with those of the formulas at 7 points per direction, unless these are not
    finite there.
    """
    found = []
    if not problem.exact_formulas:
        return ()
    if not problem.knows("source"):
        if any("abs" in formula.text for formula in problem.exact_formulas):
            found.append(
                "exact contains abs: where its argument changes sign, u has a kink that the source derived from it "
                "does not know, and the errors stay"
            )
    elif not problem.not_differentiable and not _source_fits(volume, problem):
        found.append(f"{problem.label('source')} is not that of exact: {TWO_PROBLEMS}")
    if problem.knows("boundary") and not all(_values_fit(volume, problem, face) for face in problem.dirichlet):
        found.append(f"{problem.label('boundary')} differs from exact: {TWO_PROBLEMS}")
    return tuple(found)


def _source_fits(volume: BSplineVolume, problem: BoundaryValueProblem) -> bool:
    """Rounding is measured by the terms of the law, which may cancel in the source."""
    points = _points(volume, SAMPLES, SAMPLES, SAMPLES)
    given = problem.source_at(points)
    try:
        derived = problem.source_of_exact(points)
    except ExpressionError:  # perhaps the reason why the source is given
        return True
    return _agree(given, derived, max(np.abs(given).max(), problem.size_of_exact(points)))


def _values_fit(volume: BSplineVolume, problem: BoundaryValueProblem, face: str) -> bool:
    axis, side = AXES.index(face[0]), float(face[1])
    points = _points(volume, *(np.array([side]) if a == axis else SAMPLES for a in range(3)))
    given = problem.boundary_at(points)
    try:
        exact, _ = problem.exact_at(points)
    except ExpressionError:
        return True
    return _agree(given, exact, max(np.abs(given).max(), np.abs(exact).max()))


def _points(volume: BSplineVolume, u: Array, v: Array, w: Array) -> Points:
    return Points.of(np.moveaxis(volume.grid(u, v, w), -1, 0), (u, v, w))


def _agree(a: Array, b: Array, scale: float) -> bool:
    return bool(np.abs(a - b).max() <= TOLERANCE * scale)
