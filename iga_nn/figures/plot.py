"""Draws what `volume.plot` and `solution.plot` name."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from parameterize.spline.volume import BSplineVolume

from .map import draw_cut, draw_distortion, draw_faces, draw_lines
from .render import CANNOT_DRAW, can_draw
from .solution import draw_error, draw_values

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solve import Solution

MAPS = {"faces": draw_faces, "lines": draw_lines, "cut": draw_cut, "distortion": draw_distortion}
SOLUTIONS = ("values", "error")


def plot_volume(volume: BSplineVolume, what: str, file: str | Path | None) -> Figure:
    """Return one of the figures MAPS of a volume, written to `file`, too, where one is named."""
    _check(what, MAPS)
    return MAPS[what](_path(file), volume)


def plot_solution(solution: Solution, what: str, file: str | Path | None) -> Figure:
    """Return the values of a solution, or its error, on the boundary; the error on the mid-sections, too."""
    _check(what, SOLUTIONS)
    if what == "error":
        if solution.problem.exact is None:
            raise ValueError("the error is not known: the problem has no exact solution; plot 'values'")
        return draw_error(_path(file), solution.geometry, solution, solution.problem)
    title = "u" if solution.coefficients.ndim == 3 else "|u|"
    return draw_values(_path(file), solution.geometry, solution, title)


def _check(what: str, known: Collection[str]) -> None:
    if what not in known:
        raise ValueError(f"no figure {what!r}: choose one of {', '.join(known)}")
    if not can_draw():
        raise RuntimeError(CANNOT_DRAW)


def _path(file: str | Path | None) -> Path | None:
    return None if file is None else Path(file)
