"""The figures of an output folder. All values are those of the spline itself, sampled: VTK only draws them.

A figure that cannot be drawn costs nothing but itself: the functions for whole folders return why, by file name.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.certificate.boundary import Meeting
from parameterize.spline.volume import BSplineVolume

from ..errors import one_line
from ..report.tables import Study
from .curves import draw_history, draw_study
from .map import draw_cut, draw_distortion, draw_faces, draw_folds, draw_lines, draw_meeting
from .render import can_draw
from .solution import draw_error, draw_errors, draw_values

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
Failures = dict[str, str]  # file name -> why the figure could not be drawn

log = logging.getLogger(__name__)


def attempt(failures: Failures, path: Path, draw: Callable[..., None], *given: Any) -> None:
    """Draw one figure by draw(path, *given); where that fails for any reason, say so, note it and go on."""
    try:
        draw(path, *given)
    except Exception as error:
        failures[path.name] = one_line(error) or type(error).__name__
        log.warning("%s could not be drawn: %s", path.name, failures[path.name])


def draw_map(
    folder: Path,
    volume: BSplineVolume,
    history: dict[str, NDArray[Any]],
    endings: Sequence[str] = PNG,
    marks: Array | None = None,
) -> Failures:
    """Write the loss history with each of the endings, and where VTK can draw faces, lines, cut and distortion.

    marks: as in draw_faces.
    """
    failures: Failures = {}
    for ending in endings:
        attempt(failures, folder / f"history{ending}", draw_history, history)
    if can_draw():
        attempt(failures, folder / "faces.png", draw_faces, volume, marks)
        for name, draw in (("lines", draw_lines), ("cut", draw_cut), ("distortion", draw_distortion)):
            attempt(failures, folder / f"{name}.png", draw, volume)
    return failures


def draw_defects(folder: Path, volume: BSplineVolume, places: Array, meeting: Meeting | None) -> Failures:
    """Write folds.png where there are places (k, 3), and meeting.png where the boundary meets itself."""
    failures: Failures = {}
    if (len(places) or meeting) and can_draw():
        if len(places):
            attempt(failures, folder / "folds.png", draw_folds, volume, places)
        if meeting:
            attempt(failures, folder / "meeting.png", draw_meeting, volume, meeting)
    return failures


def draw_solution(
    folder: Path,
    volume: BSplineVolume,
    solutions: Sequence[Solution],
    problem: Poisson | Elasticity,
    endings: Sequence[str] = PNG,
) -> Failures:
    """Write convergence (with each of the endings) where there are several levels, and where VTK can draw error.png.

    solutions: coarsest first, of a problem with an exact solution. Where the solver broke down there are no figures.
    """
    from solve import ConvergenceRow

    failures: Failures = {}
    if not all(np.all(np.isfinite(solution.coefficients)) for solution in solutions):
        return failures
    if len(solutions) > 1:
        levels = [ConvergenceRow(solution.report, None, None) for solution in solutions]
        failures |= draw_levels(folder, "convergence", {max(solutions[-1].degrees): levels}, endings)
    if can_draw():
        attempt(failures, folder / "error.png", draw_error, volume, solutions[-1], problem)
    return failures


def draw_levels(folder: Path, name: str, study: Study, endings: Sequence[str] = PNG) -> Failures:
    """Write the errors over the mesh size to NAME with each of the endings."""
    failures: Failures = {}
    for ending in endings:
        attempt(failures, folder / f"{name}{ending}", draw_study, study)
    return failures


def draw_face_names(folder: Path, volume: BSplineVolume) -> Failures:
    """Write named_faces.png, where VTK can draw."""
    failures: Failures = {}
    if can_draw():
        attempt(failures, folder / "named_faces.png", draw_faces, volume)
    return failures
