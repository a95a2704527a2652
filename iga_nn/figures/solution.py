"""Figures of a solution: its values on the boundary, its error on the boundary and on the mid-sections."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from parameterize.spline.volume import BSplineVolume

from ..levels import EXACT_ERRORS, TITLES
from .color_range import error_range, even_range
from .evaluate import SECTIONS, all_grids, points_on, sampled_error, solution_on
from .render import Patch, draw, widest_view
from .style import PANEL, SAMPLES, color_bar, colors, panels_of, save, show_around

if TYPE_CHECKING:
    from solve import Elasticity, Poisson, Solution

    Problem = Poisson | Elasticity


def draw_error(path: Path, volume: BSplineVolume, solution: Solution, problem: Problem) -> None:
    """|u - u_h| on the boundary and on the three mid-sections, logarithmic colours; the error norms beside it."""
    points, errors = sampled_error(volume, solution, problem, SAMPLES)
    limits = error_range([errors])
    figure, rows = panels_of(2, 3)
    boundary = [Patch(p, colors(e, limits)) for p, e in zip(points[:6], errors[:6], strict=True)]
    show_around(rows[0][:2], boundary)
    _write_numbers(rows[0][2], solution)
    for axis, panel in enumerate(rows[1]):
        patch = Patch(points[6 + axis], colors(errors[6 + axis], limits), lit=False)
        panel.imshow(draw([patch], widest_view(patch.points.reshape(-1, 3)), PANEL))
        panel.set_title(SECTIONS[axis], fontsize=13)
    color_bar(figure, rows, limits, r"$|u - u_h|$")
    figure.suptitle("Error on the boundary and on the mid-sections", fontsize=14)
    save(figure, path)


def draw_values(
    path: Path, volume: BSplineVolume, solution: Solution, title: str, *, exaggerate: float | None = None
) -> None:
    """u_h on the boundary, of vectors the length, from the front and from behind.

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
    save(figure, path)


def draw_errors(path: Path, volume: BSplineVolume, solutions: Sequence[Solution], problem: Problem) -> None:
    """|u - u_h| of several meshes in one range of colours, a row a mesh: the boundary and the three mid-sections.

    The layout of the paper's Fig. 14, with the L2 error marked.
    """
    samples = [sampled_error(volume, solution, problem, SAMPLES) for solution in solutions]
    limits = error_range([errors for _, errors in samples])
    figure, rows = panels_of(len(solutions), 4)
    for row, (points, errors), solution in zip(rows, samples, solutions, strict=True):
        for panel, title, shown in zip(row, ("boundary", *SECTIONS), (slice(6), *range(6, 9)), strict=True):
            lit = isinstance(shown, slice)
            chosen = range(6) if isinstance(shown, slice) else (shown,)
            patches = [Patch(points[i], colors(errors[i], limits), lit=lit) for i in chosen]
            cloud = np.concatenate([patch.points.reshape(-1, 3) for patch in patches])
            panel.imshow(draw(patches, widest_view(cloud, tilt=0.45 if lit else 0.0), PANEL))
            panel.set_title(title, fontsize=13)
        report = solution.report
        relative = "" if report.l2_relative is None else f"relative L2 error {report.l2_relative:.3e}, "
        label = f"{report.dofs} unknowns, {relative}L2 error {report.l2:.3e}"
        row[0].text(0.0, 0.0, label, transform=row[0].transAxes, fontsize=14)
    color_bar(figure, rows, limits, r"$|u - u_h|$")
    save(figure, path)


def _write_numbers(panel: Any, solution: Solution) -> None:
    report = solution.report
    errors = [(TITLES[key], getattr(report, key)) for key in EXACT_ERRORS]
    lines = [f"{report.dofs:,} unknowns"]
    lines += [f"{title} {value:.3e}" for title, value in errors if value is not None]
    if not report.converged:
        lines.append("NOT CONVERGED")
    panel.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", fontsize=14, linespacing=1.8)
