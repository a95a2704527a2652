"""Lists every file of an output folder: what it shows, which part of a run writes it, how a figure is drawn.

The output folder, the report page and the live page are made from this table; a test compares that of docs/output.md
with it. A new figure needs a function in `iga_nn.figures` and a row here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from ..options import PROBLEMS

Part = Literal["report", "map", "solution", "study"]

REPORT, PAGE = "report.json", "report.html"
SOLVED = {name: kind.title for name, kind in PROBLEMS.items()} | {"study": "convergence study"}  # section -> title
SECTIONS: dict[str, Part] = {"config": "map", **dict.fromkeys(PROBLEMS, "solution"), "study": "study"}


@dataclass(frozen=True)
class Artifact:
    """Describe one file of an output folder.

    part: the part of a run that writes it. shows: what the file holds or the figure shows; the heading of a figure.
    arrays: names in an archive. draw: the function of `iga_nn.figures` that draws the figure from `takes`, the names of
    what must be known; the figure is left out where one of them is not.
    is_curve: drawn without VTK, and written as PDF, too, where that is wanted.
    """

    file: str
    part: Part
    shows: str
    arrays: tuple[str, ...] = ()
    draw: str = ""
    takes: tuple[str, ...] = ()
    is_curve: bool = False


_KNOTS = ("degrees", "knots_u", "knots_v", "knots_w")
_BOUNDARY = ("vertices", "parameters", "faces")
_ERROR = ("volume", "solution", "problem")


def _figure(file: str, part: Part, shows: str, draw: str, *takes: str, is_curve: bool = False) -> Artifact:
    return Artifact(file, part, shows, draw=draw, takes=takes, is_curve=is_curve)


_curve = partial(_figure, is_curve=True)


ARTIFACTS = (  # in the order of the pages
    Artifact("volume.npz", "map", "the spline volume", (*_KNOTS, "control_points")),
    Artifact("solution.npz", "solution", "the solution on the finest mesh", (*_KNOTS, "coefficients")),
    Artifact("boundary.npz", "map", "the map from the surface to the cube's faces", _BOUNDARY),
    Artifact(PAGE, "report", "the report to read: verdict, figures, tables and an interactive view, in one file"),
    Artifact(REPORT, "report", "the report for programs: input, configuration, versions, certificate, errors, seconds"),
    Artifact("history.npz", "map", "the loss, its terms and the number of folded samples at every training step"),
    Artifact("study.csv", "study", "the errors and their rates in a convergence study"),
    _figure("meeting.png", "map", "where the boundary meets itself", "draw_meeting", "volume", "meeting"),
    _figure("folds.png", "map", "where det J > 0 is not proved", "draw_folds", "volume", "places"),
    _figure("faces.png", "map", "images of the cube's faces", "draw_faces", "volume", "marks"),
    _figure("lines.png", "map", "parameter lines on the cube's faces", "draw_lines", "volume"),
    _figure("cut.png", "map", "the volume cut open, with the distortion inside", "draw_cut", "volume"),
    _figure("distortion.png", "map", "distortion on three sections", "draw_distortion", "volume"),
    _curve("history.png", "map", "loss over the training steps", "draw_history", "history"),
    _figure("named_faces.png", "solution", "the volume's faces by name", "draw_faces", "named_volume"),
    _curve("convergence.png", "solution", "errors over the mesh size", "draw_study", "levels"),
    _figure("error.png", "solution", "error on the boundary and on three sections", "draw_error", *_ERROR),
    _curve("study.png", "study", "errors of the convergence study over the mesh size", "draw_study", "study"),
)


def files_of(*parts: Part) -> list[str]:
    """Return the names of all files that these parts of a run may write."""
    chosen = [artifact for artifact in ARTIFACTS if artifact.part in parts]
    return [each.file for each in chosen] + [each.file.replace(".png", ".pdf") for each in chosen if each.is_curve]


def figures_of(report: Mapping[str, Any]) -> list[Artifact]:
    """Return the figures that belong to the sections a report has."""
    parts = {part for section, part in SECTIONS.items() if section in report}
    return [artifact for artifact in ARTIFACTS if artifact.draw and artifact.part in parts]
