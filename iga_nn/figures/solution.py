"""Draws a solution: its values on the boundary, its error on the boundary and on the mid-sections."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from parameterize.spline.volume import BSplineVolume
from solve import Solution
from solve.forms.problem import BoundaryValueProblem

from ..levels import EXACT_ERRORS, TITLES
from .evaluate import SECTIONS, all_grids, points_on, sampled_error, solution_on
from .render import Patch, check_drawable
from .style import SAMPLES, color_bar, colors, error_range, even_range, panels_of, save, show_around, show_section


def draw_error(
    path: str | Path | None, volume: BSplineVolume, solution: Solution, problem: BoundaryValueProblem
) -> Figure:
    """Draw |u - u_h| on the boundary and on the three mid-sections in logarithmic colours, and write its norms."""
    points, errors = sampled_error(volume, solution, problem, SAMPLES)
    limits = error_range([errors])
    figure, rows = panels_of(2, 3)
    boundary = [Patch(p, colors(e, limits)) for p, e in zip(points[:6], errors[:6], strict=True)]
    show_around(rows[0][:2], boundary)
    _write_numbers(rows[0][2], solution)
    for panel, title, where, values in zip(rows[1], SECTIONS, points[6:], errors[6:], strict=True):
        show_section(panel, title, where, colors(values, limits))
    color_bar(figure, rows, limits, r"$|u - u_h|$")
    return save(figure, path, "Error on the boundary and on the mid-sections")


def draw_values(
    path: str | Path | None, volume: BSplineVolume, solution: Solution, title: str, *, exaggerate: float | None = None
) -> Figure:
    """Draw u_h, or the length of a vector u_h, on the boundary, from the front and from behind.

    exaggerate: draw the body displaced by that many times u_h, a vector.
    """
    grids = all_grids(SAMPLES)[:6]
    values = [solution_on(solution, grid) for grid in grids]
    points = [points_on(volume, grid) for grid in grids]
    if exaggerate is not None:
        moved = [solution.grid(*grid).reshape(SAMPLES, SAMPLES, 3) for grid in grids]
        points = [where + exaggerate * by for where, by in zip(points, moved, strict=True)]
    limits = even_range(values)
    figure, (panels,) = panels_of(1, 2)
    show_around(panels, [Patch(p, colors(v, limits)) for p, v in zip(points, values, strict=True)])
    color_bar(figure, panels, limits, title)
    return save(figure, path)


def plot_solution(solution: Solution, what: str, file: str | Path | None) -> Figure:
    """Return the values of a solution, or its error, on the boundary; the error on the mid-sections, too."""
    check_drawable(what, ("values", "error"))
    if what == "error":
        if solution.problem.exact is None:
            raise ValueError("the error is not known: the problem has no exact solution; plot 'values'")
        return draw_error(file, solution.geometry, solution, solution.problem)
    title = "u" if solution.coefficients.ndim == 3 else "|u|"
    return draw_values(file, solution.geometry, solution, title)


def _write_numbers(panel: Any, solution: Solution) -> None:
    report = solution.report
    errors = [(TITLES[key], getattr(report, key)) for key in EXACT_ERRORS]
    lines = [f"{report.dofs:,} unknowns"]
    lines += [f"{title} {value:.3e}" for title, value in errors if value is not None]
    if not report.converged:
        lines.append("NOT CONVERGED")
    panel.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", fontsize=14, linespacing=1.8)
