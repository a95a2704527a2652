"""Lists every file of an output folder: its content, the part of a run that writes it, the function of a figure.

The output folder, the report page, the live page and the table of docs/output.md are made from this table. A new figure
needs a function in `iga_nn.figures` and a row here; `make docs` writes the table of docs/output.md anew.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from ..options import PROBLEMS

Part = Literal["report", "map", "solution", "study", "modes"]

REPORT, PAGE, REGIONS = "report.json", "report.html", "regions.png"
SOLVED = {name: kind.title for name, kind in PROBLEMS.items()} | {"study": "convergence study"}  # section -> title
SECTIONS: dict[str, Part] = {"config": "map", **dict.fromkeys(PROBLEMS, "solution"), "study": "study", "modes": "modes"}


@dataclass(frozen=True)
class Artifact:
    """Describe one file of an output folder.

    part: the part of a run that writes it. shows: the content of the file or the heading of the figure. draw: module
    and function of `iga_nn.figures` that draw the figure from `takes`, the names of the values that it needs; the
    figure is left out where one of these values is unknown. arrays: names in an archive.
    """

    file: str
    part: Part
    shows: str
    draw: str = ""
    takes: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()

    @property
    def is_curve(self) -> bool:
        """Return whether the figure is drawn without VTK, and may also be written as PDF."""
        return self.draw.startswith("line_plots.")

    def draw_to(self, path: Path, known: Mapping[str, Any]) -> None:
        """Draw the figure from the known values, and write it."""
        module, function = self.draw.split(".")
        getattr(import_module(f"iga_nn.figures.{module}"), function)(path, *(known[name] for name in self.takes))


_KNOTS = ("degrees", "knots_u", "knots_v", "knots_w")
_BOUNDARY = ("vertices", "parameters", "faces", "patches")
_VALUES = ("volume", "solution", "units")
_ERROR = ("volume", "solution", "problem", "units")


ARTIFACTS = (  # in the order of the pages
    Artifact("volume.npz", "map", "the spline volume", arrays=(*_KNOTS, "control_points")),
    Artifact("solution.npz", "solution", "the solution on the finest mesh", arrays=(*_KNOTS, "coefficients")),
    Artifact(
        "solution.vtu", "solution", "the solution with stress, or gradient and flux, on linear cells for ParaView"
    ),
    Artifact(
        "boundary.npz", "map", "the map from the surface to the faces of the cube, or of blocks", arrays=_BOUNDARY
    ),
    Artifact(PAGE, "report", "the report to read: verdict, figures, tables and an interactive view, in one file"),
    Artifact(REPORT, "report", "the report for programs: input, configuration, versions, certificate, errors, seconds"),
    Artifact("history.npz", "map", "the loss, its terms and the number of folded samples at every training step"),
    Artifact("modes.npz", "modes", "the lowest vibrations", arrays=(*_KNOTS, "coefficients", "frequencies")),
    Artifact("study.csv", "study", "the errors and their rates in a convergence study"),
    Artifact("solution.png", "solution", "the solution on the boundary and inside", "solution.draw_solution", _VALUES),
    Artifact("meeting.png", "map", "where the boundary meets itself", "map.draw_meeting", ("faulty", "meeting")),
    Artifact("folds.png", "map", "where det J > 0 is not proved", "map.draw_folds", ("faulty", "places")),
    Artifact("faces.png", "map", "images of the faces", "map.draw_faces", ("volume", "marks")),
    Artifact("blocks.png", "map", "the blocks drawn apart, and their interfaces", "map.draw_blocks", ("blocks",)),
    Artifact("lines.png", "map", "parameter lines on the faces", "map.draw_lines", ("volume",)),
    Artifact("cut.png", "map", "the volume cut open, with the distortion inside", "map.draw_cut", ("volume",)),
    Artifact("distortion.png", "map", "distortion on three sections", "map.draw_distortion", ("volume",)),
    Artifact("history.png", "map", "loss over the training steps", "line_plots.draw_history", ("history",)),
    Artifact(REGIONS, "solution", "where data are given", "regions.draw_conditions", ("volume", "conditions")),
    Artifact("named_faces.png", "solution", "the volume's faces by name", "map.draw_faces", ("named_volume",)),
    Artifact("convergence.png", "solution", "errors over the mesh size", "line_plots.draw_study", ("levels",)),
    Artifact("load.png", "solution", "load over displacement", "line_plots.draw_load_steps", ("load_steps", "units")),
    Artifact("error.png", "solution", "error on the boundary and on three sections", "solution.draw_error", _ERROR),
    Artifact("modes.png", "modes", "the first modes, by frequency", "solution.draw_modes", ("volume", "modes")),
    Artifact(
        "study.png", "study", "errors of the convergence study over the mesh size", "line_plots.draw_study", ("study",)
    ),
)


def files_of(*parts: Part) -> list[str]:
    """Return the names of all files that these parts of a run may write."""
    chosen = [artifact for artifact in ARTIFACTS if artifact.part in parts]
    return [each.file for each in chosen] + [each.file.replace(".png", ".pdf") for each in chosen if each.is_curve]


def figures_of(report: Mapping[str, Any]) -> list[Artifact]:
    """Return the figures that belong to the sections a report has."""
    parts = {part for section, part in SECTIONS.items() if section in report}
    return [artifact for artifact in ARTIFACTS if artifact.draw and artifact.part in parts]
