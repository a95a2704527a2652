"""Every file of an output folder: what it holds, which part of a run writes it, how a figure is drawn.

The output folder, the report page, the live page and README's table of files are made from this table. A new figure
needs a function in `iga_nn.figures` and a row here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

Part = Literal["report", "map", "solution", "study"]

REPORT, PAGE = "report.json", "report.html"
SECTIONS: dict[str, Part] = {"config": "map", "poisson": "solution", "elasticity": "solution", "study": "study"}


@dataclass(frozen=True)
class Artifact:
    """One file of an output folder.

    part: what writes it. holds: for a reader who looks for a file. arrays: of an archive.
    title: heading of a figure on the report page. draw: function of `iga_nn.figures` that draws it from `takes`, the
    names of what must be known; a figure is left out where one of them is not.
    is_curve: drawn without VTK, and as PDF, too, where that is wanted.
    """

    file: str
    part: Part
    holds: str
    arrays: tuple[str, ...] = ()
    title: str = ""
    draw: str = ""
    takes: tuple[str, ...] = ()
    is_curve: bool = False

    @property
    def files(self) -> tuple[str, ...]:
        """All names the file may be written under."""
        return (self.file, self.file.replace(".png", ".pdf")) if self.is_curve else (self.file,)


_KNOTS = ("degrees", "knots_u", "knots_v", "knots_w")

ARTIFACTS = (  # in the order of the pages
    Artifact("volume.npz", "map", "the spline volume", (*_KNOTS, "control_points")),
    Artifact("solution.npz", "solution", "the solution on the finest mesh", (*_KNOTS, "coefficients")),
    Artifact(
        "boundary.npz", "map", "the map from the surface to the cube's faces", ("vertices", "parameters", "faces")
    ),
    Artifact(PAGE, "report", "the report to read: verdict, figures, tables and an interactive view, in one file"),
    Artifact(REPORT, "report", "the report for programs: input, configuration, versions, certificate, errors, seconds"),
    Artifact("history.npz", "map", "loss, its terms and folded samples of every training step"),
    Artifact("study.csv", "study", "errors and their rates of a convergence study"),
    Artifact(
        "meeting.png",
        "map",
        "where the boundary meets itself; only where it does",
        title="Where the boundary meets itself",
        draw="draw_meeting",
        takes=("volume", "meeting"),
    ),
    Artifact(
        "folds.png",
        "map",
        "where det J > 0 is not proved; only where it is not",
        title="Where det J > 0 is not proved",
        draw="draw_folds",
        takes=("volume", "places"),
    ),
    Artifact(
        "faces.png",
        "map",
        "the cube's faces in colours",
        title="Images of the cube's faces",
        draw="draw_faces",
        takes=("volume", "marks"),
    ),
    Artifact(
        "lines.png",
        "map",
        "the cube's faces with parameter lines",
        title="Parameter lines",
        draw="draw_lines",
        takes=("volume",),
    ),
    Artifact(
        "cut.png",
        "map",
        "the volume cut open, with the distortion inside",
        title="Cut open",
        draw="draw_cut",
        takes=("volume",),
    ),
    Artifact(
        "distortion.png",
        "map",
        "distortion on three sections",
        title="Distortion",
        draw="draw_distortion",
        takes=("volume",),
    ),
    Artifact(
        "history.png",
        "map",
        "loss over the training steps",
        title="Loss history",
        draw="draw_history",
        takes=("history",),
        is_curve=True,
    ),
    Artifact(
        "named_faces.png",
        "solution",
        "the volume's faces by name; of a solve whose boundary conditions name some",
        title="The faces by their names",
        draw="draw_faces",
        takes=("named_volume",),
    ),
    Artifact(
        "convergence.png",
        "solution",
        "errors over the mesh size",
        title="Errors over the mesh size",
        draw="draw_study",
        takes=("levels",),
        is_curve=True,
    ),
    Artifact(
        "error.png",
        "solution",
        "error on the boundary and on three sections",
        title="Error",
        draw="draw_error",
        takes=("volume", "solution", "problem"),
    ),
    Artifact(
        "study.png",
        "study",
        "errors of a convergence study over the mesh size",
        title="Errors over the mesh size",
        draw="draw_study",
        takes=("study",),
        is_curve=True,
    ),
)


def files_of(*parts: Part) -> list[str]:
    """Return the names of all files that these parts of a run may write."""
    return [name for artifact in ARTIFACTS if artifact.part in parts for name in artifact.files]


def figures_of(report: Mapping[str, Any]) -> list[Artifact]:
    """Return the figures that belong to the sections a report has."""
    parts = {part for section, part in SECTIONS.items() if section in report}
    return [artifact for artifact in ARTIFACTS if artifact.title and artifact.part in parts]


def as_markdown() -> str:
    """Return the table of files as README shows it."""
    rows = ["| file | content |", "| --- | --- |"]
    for artifact in ARTIFACTS:
        arrays = ": " + ", ".join(f"`{name}`" for name in artifact.arrays) if artifact.arrays else ""
        rows.append(f"| `{artifact.file}` | {artifact.holds}{arrays} |")
    return "\n".join(rows)
