"""The figures of an output folder. All values are those of the spline itself, sampled: VTK only draws them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.injective import Meeting
from parameterize.volume import BSplineVolume

from .curves import draw_history, draw_study
from .map_figures import draw_cut, draw_distortion, draw_faces, draw_folds, draw_lines, draw_meeting
from .rendering import can_draw
from .solution_figures import draw_error, draw_errors, draw_values
from .studies import Study

if TYPE_CHECKING:
    from solve import Elasticity, Poisson, Solution

__all__ = [
    "draw_cut",
    "draw_defects",
    "draw_distortion",
    "draw_error",
    "draw_errors",
    "draw_face_names",
    "draw_faces",
    "draw_folds",
    "draw_history",
    "draw_levels",
    "draw_lines",
    "draw_map",
    "draw_meeting",
    "draw_solution",
    "draw_study",
    "draw_values",
]

PNG = (".png",)


def draw_map(
    folder: Path,
    volume: BSplineVolume,
    history: dict[str, NDArray[Any]],
    endings: Sequence[str] = PNG,
    marks: Array | None = None,
) -> None:
    """Write the loss history with each of the endings, and where VTK can draw faces, lines, cut and distortion.

    marks: as in draw_faces.
    """
    for ending in endings:
        draw_history(folder / f"history{ending}", history)
    if can_draw():
        draw_faces(folder / "faces.png", volume, marks)
        draw_lines(folder / "lines.png", volume)
        draw_cut(folder / "cut.png", volume)
        draw_distortion(folder / "distortion.png", volume)


def draw_defects(folder: Path, volume: BSplineVolume, places: Array, meeting: Meeting | None) -> None:
    """Write folds.png where there are places (k, 3), and meeting.png where the boundary meets itself."""
    if (len(places) or meeting) and can_draw():
        if len(places):
            draw_folds(folder / "folds.png", volume, places)
        if meeting:
            draw_meeting(folder / "meeting.png", volume, meeting)


def draw_solution(
    folder: Path,
    volume: BSplineVolume,
    solutions: Sequence[Solution],
    problem: Poisson | Elasticity,
    endings: Sequence[str] = PNG,
) -> None:
    """Write convergence (with each of the endings) where there are several levels, and where VTK can draw error.png.

    solutions: coarsest first, of a problem with an exact solution. Where the solver broke down there are no figures.
    """
    from solve import ConvergenceRow

    if not all(np.all(np.isfinite(solution.coefficients)) for solution in solutions):
        return
    if len(solutions) > 1:
        levels = [ConvergenceRow(solution.report, None, None) for solution in solutions]
        draw_levels(folder, "convergence", {max(solutions[-1].degrees): levels}, endings)
    if can_draw():
        draw_error(folder / "error.png", volume, solutions[-1], problem)


def draw_levels(folder: Path, name: str, study: Study, endings: Sequence[str] = PNG) -> None:
    """Write the errors over the mesh size to NAME with each of the endings."""
    for ending in endings:
        draw_study(folder / f"{name}{ending}", study)


def draw_face_names(folder: Path, volume: BSplineVolume) -> None:
    """Write named_faces.png, where VTK can draw."""
    if can_draw():
        draw_faces(folder / "named_faces.png", volume)
