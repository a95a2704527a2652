"""The figures of an output folder. All values are those of the spline itself, sampled here: VTK only draws them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from parameterize.bspline import Array
from parameterize.files import replacing
from parameterize.injective import Meeting
from parameterize.volume import BSplineVolume

from .octant import best_cut, face_patches, octant_label, section_patches, without_octant
from .rendering import Patch, View, can_draw, draw, widest_view
from .sampling import (
    FACE_COLORS,
    MAP,
    SECTIONS,
    all_grids,
    distortion_on,
    error_norm,
    face_grid,
    face_labels,
    face_window,
    points_on,
    sampled_error,
    section_grid,
    solution_on,
)
from .studies import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solve import Elasticity, Poisson, Solution

    Problem = Poisson | Elasticity

SAMPLES = 141  # a direction and patch
EVERY = 14  # samples between two parameter lines: a tenth of the cube
DISTORTION = "tanh(√ARAP / 2), scale as given"
TERMS = {  # of the loss, as parameterize names them
    "arap": "ARAP distortion",
    "bij": "folds",
    "cor": "distance at corners",
    "dist": "distance to the target",
    "edge": "distance along edges",
    "fair": "curvature",
    "norm": "normals",
    "star": "faces seen from inside",
    "surface": "spline's boundary",
}
STAGES = {"S(2)": "round cuboid S(2)", "S(1)": "sharper one S(1)"}  # the others speak for themselves
PANEL = (900, 700)  # pixels of one view
PNG = (".png",)
WINDOW = 0.15  # of the cube, to every side of a meeting place
MEETING_COLORS = ("#4477aa", "#ee6677")


def draw_solution(
    folder: Path,
    volume: BSplineVolume,
    solutions: Sequence[Solution],
    problem: Problem,
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
    """Write faces.png, where VTK can draw."""
    if can_draw():
        draw_faces(folder / "faces.png", volume)


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


def draw_folds(path: Path, volume: BSplineVolume, places: Array) -> None:
    """The boundary as of glass, with black balls at places (k, 3) inside: the spans where det J > 0 is not proved."""
    figure, (panels,) = _panels(1, 2)
    _show_around(panels, _glass(volume), places)
    figure.suptitle(f"det J > 0 is not proved on {len(places)} spans: black balls", fontsize=14)
    _save(figure, path)


def draw_meeting(path: Path, volume: BSplineVolume, meeting: Meeting) -> None:
    """The place where the boundary meets itself: in the whole, and the two parts that meet there, from two sides."""
    from matplotlib.colors import to_rgb

    mark = np.array([meeting.point])
    parts = []
    for parameter, color in zip(meeting.parameters, MEETING_COLORS, strict=True):
        points = points_on(volume, face_window(parameter, WINDOW, SAMPLES))
        parts.append(Patch(points, np.broadcast_to(to_rgb(color), points.shape), opacity=0.7))
    figure, (panels,) = _panels(1, 3)
    glass = _glass(volume)
    panels[0].imshow(draw(glass, _view_of(glass), PANEL, mark))
    panels[0].set_title("the whole", fontsize=13)
    _show_around(panels[1:], parts, mark)
    figure.suptitle("The boundary meets itself: black ball; the two parts near it", fontsize=14)
    _save(figure, path)


def _glass(volume: BSplineVolume) -> list[Patch]:
    """The six faces, seen through."""
    points = [points_on(volume, face_grid(face, SAMPLES)) for face in range(6)]
    return [Patch(p, np.full(p.shape, 0.6), opacity=0.25) for p in points]


def draw_faces(path: Path, volume: BSplineVolume, marks: Array | None = None) -> None:
    """The images of the six faces of the cube, each in its colour, from the front and from behind.

    marks: points (k, 3) shown as black balls, such as the corners that were given (the paper's Fig. 13).
    """
    figure, (panels,) = _panels(1, 2)
    _show_around(panels, face_patches(volume, SAMPLES), marks)
    _name_faces(figure)
    figure.suptitle("Images of the six faces of the unit cube", fontsize=14)
    _save(figure, path)


def draw_lines(path: Path, volume: BSplineVolume) -> None:
    """Lines of constant parameters, a tenth apart, on the images of the six faces, from the front and from behind."""
    figure, (panels,) = _panels(1, 2)
    _show_around(panels, face_patches(volume, SAMPLES, EVERY))
    _name_faces(figure)
    figure.suptitle("Lines of constant u, v, w, a tenth apart", fontsize=14)
    _save(figure, path)


def draw_cut(path: Path, volume: BSplineVolume) -> None:
    """The volume without an eighth of the cube (the paper's Fig. 9): parameter lines inside, and the distortion there.

    The eighth and the side it is seen from are those that show most of the cut.
    """
    from matplotlib.colors import Normalize

    norm = Normalize(0.0, 1.0)
    faces = face_patches(volume, SAMPLES, EVERY)
    octant, view = best_cut([patch.points for patch in faces])
    named = faces + section_patches(volume, SAMPLES, EVERY)
    distorted = [
        replace(patch, colors=_colors(distortion_on(volume, grid), norm))
        for patch, grid in zip(named, all_grids(SAMPLES), strict=True)
    ]
    figure, (panels,) = _panels(1, 2)
    for panel, patches in zip(panels, (named, distorted), strict=True):
        panel.imshow(draw(without_octant(patches, octant), view, PANEL))
    _name_faces(figure)
    _color_bar(figure, panels, norm, DISTORTION)
    figure.suptitle(f"Cut open: the part {octant_label(octant)} is left out", fontsize=14)
    _save(figure, path)


def draw_distortion(path: Path, volume: BSplineVolume) -> None:
    """tanh(sqrt(ARAP) / 2), as the paper colours it, on the images of u = 1/2, v = 1/2 and w = 1/2; units as given."""
    from matplotlib.colors import Normalize

    norm = Normalize(0.0, 1.0)
    figure, (panels,) = _panels(1, 3)
    for axis, panel in enumerate(panels):
        grid = section_grid(axis, SAMPLES)
        points = points_on(volume, grid)
        patch = Patch(points, _colors(distortion_on(volume, grid), norm), lit=False)
        panel.imshow(draw([patch], widest_view(points.reshape(-1, 3)), PANEL))
        panel.set_title(SECTIONS[axis], fontsize=13)
    _color_bar(figure, panels, norm, DISTORTION)
    figure.suptitle("Distortion on the mid-sections", fontsize=14)
    _save(figure, path)


def draw_error(path: Path, volume: BSplineVolume, solution: Solution, problem: Problem) -> None:
    """|u - u_h| on the boundary and on the three mid-sections, logarithmic colours; the error norms beside it."""
    points, errors = sampled_error(volume, solution, problem, SAMPLES)
    norm = error_norm([errors])
    figure, rows = _panels(2, 3)
    boundary = [Patch(p, _colors(e, norm)) for p, e in zip(points[:6], errors[:6], strict=True)]
    _show_around(rows[0][:2], boundary)
    _write_numbers(rows[0][2], solution)
    for axis, panel in enumerate(rows[1]):
        patch = Patch(points[6 + axis], _colors(errors[6 + axis], norm), lit=False)
        panel.imshow(draw([patch], widest_view(patch.points.reshape(-1, 3)), PANEL))
        panel.set_title(SECTIONS[axis], fontsize=13)
    _color_bar(figure, rows, norm, r"$|u - u_h|$")
    figure.suptitle("Error on the boundary and on the mid-sections", fontsize=14)
    _save(figure, path)


def draw_values(
    path: Path, volume: BSplineVolume, solution: Solution, title: str, *, exaggerate: float | None = None
) -> None:
    """u_h on the boundary, of vectors the length, from the front and from behind.

    exaggerate: draw the body displaced by that many times u_h, a vector.
    """
    from matplotlib.colors import Normalize

    grids = all_grids(SAMPLES)[:6]
    values = [solution_on(solution, grid) for grid in grids]
    points = [points_on(volume, grid) for grid in grids]
    if exaggerate is not None:
        moved = [solution.grid(*grid).reshape(SAMPLES, SAMPLES, 3) for grid in grids]
        points = [where + exaggerate * by for where, by in zip(points, moved, strict=True)]
    norm = Normalize(float(np.min(values)), float(np.max(values)))
    figure, (panels,) = _panels(1, 2)
    _show_around(panels, [Patch(p, _colors(v, norm)) for p, v in zip(points, values, strict=True)])
    _color_bar(figure, panels, norm, title)
    _save(figure, path)


def draw_errors(path: Path, volume: BSplineVolume, solutions: Sequence[Solution], problem: Problem) -> None:
    """|u - u_h| of several meshes in one range of colours, a row a mesh: the boundary and the three mid-sections.

    The layout of the paper's Fig. 14, with the L2 error marked.
    """
    samples = [sampled_error(volume, solution, problem, SAMPLES) for solution in solutions]
    norm = error_norm([errors for _, errors in samples])
    figure, rows = _panels(len(solutions), 4)
    for row, (points, errors), solution in zip(rows, samples, solutions, strict=True):
        for panel, title, shown in zip(row, ("boundary", *SECTIONS), (slice(6), *range(6, 9)), strict=True):
            lit = isinstance(shown, slice)
            chosen = range(6) if isinstance(shown, slice) else (shown,)
            patches = [Patch(points[i], _colors(errors[i], norm), lit=lit) for i in chosen]
            cloud = np.concatenate([patch.points.reshape(-1, 3) for patch in patches])
            panel.imshow(draw(patches, widest_view(cloud, tilt=0.45 if lit else 0.0), PANEL))
            panel.set_title(title, fontsize=13)
        label = f"{solution.report.dofs} unknowns, L2 error {solution.report.l2:.3e}"
        row[0].text(0.0, 0.0, label, transform=row[0].transAxes, fontsize=14)
    _color_bar(figure, rows, norm, r"$|u - u_h|$")
    _save(figure, path)


def draw_study(path: Path, study: Study) -> None:
    """L2 and H1 errors over the mesh size, a curve a degree, with the slopes that smooth solutions have."""
    figure, panels = _blank(1, 2, (11, 5))
    for panel, (title, name, lost) in zip(panels, (("L2", "l2", 0), ("H1 seminorm", "h1_seminorm", 1)), strict=True):
        for (degree, levels), color in zip(study.items(), FACE_COLORS * 2, strict=False):
            sizes = np.array([level.report.elements for level in levels]) ** (-1.0 / 3.0)
            errors = _positive(np.array([getattr(level.report, name) for level in levels]))
            panel.loglog(sizes, errors, "o-", color=color, label=f"degree {degree}")
            order = degree + 1 - lost
            reference = 0.6 * errors[-1] * (sizes / sizes[-1]) ** order
            panel.loglog(sizes, reference, "--", color=color, linewidth=0.8)
            label = {"textcoords": "offset points", "ha": "center", "color": color, "fontsize": 9}
            panel.annotate(f"slope {order}", (sizes[-1], reference[-1]), (0, -12), **label)
        counts = sorted({round(level.report.elements ** (1.0 / 3.0)) for levels in study.values() for level in levels})
        panel.set_xticks([1.0 / count for count in counts], [f"1/{count}" for count in counts])
        panel.minorticks_off()
        panel.set_xlabel("h, the edge of an element in the unit cube")
        panel.set_title(f"{title} error")
        panel.grid(alpha=0.3)
        panel.margins(x=0.12, y=0.08)
    panels[0].legend(frameon=False)
    _save(figure, path)


def draw_history(path: Path, history: dict[str, NDArray[Any]]) -> None:
    """Loss and its unweighted terms over the steps, folded samples below; the stages marked."""
    terms = [name for name in history if name not in ("stage", "step", "loss", "folded")]
    steps = np.arange(len(history["loss"]))
    figure, (upper, lower) = _blank(2, 1, (11, 6), sharex=True, height_ratios=(4, 1))
    for name in terms:
        upper.plot(steps, _positive(history[name]), linewidth=0.8, alpha=0.8, label=TERMS.get(name, name))
    upper.plot(steps, _positive(history["loss"]), color="black", linewidth=1.4, label="loss")
    upper.set_yscale("log")
    upper.set_ylim(bottom=max(upper.get_ylim()[0], 1e-8 * float(np.nanmax(history["loss"]))))  # terms start at zero
    upper.set_ylabel("loss, and its terms without their weights")
    upper.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    lower.plot(steps, history["folded"], color="firebrick", linewidth=1.0)
    lower.set_yscale("symlog", linthresh=1.0)
    lower.set_ylim(bottom=0.0)
    lower.set_ylabel("folded")
    lower.set_xlabel("step")
    stages = history["stage"]
    for start in np.flatnonzero(np.r_[True, stages[1:] != stages[:-1]]):
        for axes in (upper, lower):
            axes.axvline(start, color="grey", linewidth=0.7, linestyle=":")
        label = {"textcoords": "offset points", "rotation": 35, "fontsize": 9}  # slanted: short stages lie close
        name = str(stages[start])
        upper.annotate(STAGES.get(name, name), (start, 1.0), (0, 3), xycoords=upper.get_xaxis_transform(), **label)
    _save(figure, path)


def _colors(values: Array, norm: Any) -> Array:
    """Red, green, blue (m, n, 3) of values (m, n)."""
    from matplotlib import colormaps

    return np.asarray(colormaps[MAP](norm(values)))[..., :3]


def _positive(values: NDArray[Any]) -> Array:
    """What a logarithmic axis can show; the rest is left out."""
    numbers = np.asarray(values, dtype=np.float64)
    return np.where(numbers > 0.0, numbers, np.nan)


def _blank(rows: int, columns: int, inches: tuple[float, float], **grid: Any) -> tuple[Figure, Any]:
    """A figure of its own, outside pyplot: nothing to close, no window system asked."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=inches, dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    height_ratios = grid.pop("height_ratios", None)
    return figure, figure.subplots(rows, columns, height_ratios=height_ratios, **grid)


def _panels(rows: int, columns: int) -> tuple[Figure, Any]:
    """A figure of empty panels for rendered views, axes (rows, columns)."""
    figure, axes = _blank(rows, columns, (4.6 * columns, 3.8 * rows + 0.8), squeeze=False)
    for panel in axes.flat:
        panel.set_axis_off()
    return figure, axes


def _name_faces(figure: Figure) -> None:
    """The six colours below the panels."""
    from matplotlib.patches import Patch as Swatch

    swatches = [Swatch(color=color, label=label) for label, color in zip(face_labels(), FACE_COLORS, strict=True)]
    figure.legend(
        handles=swatches,
        loc="outside lower center",
        ncols=6,
        frameon=False,
        fontsize=12,
        columnspacing=1.2,
        handlelength=1.4,
    )


def _show_around(panels: Any, patches: list[Patch], marks: Array | None = None) -> None:
    """The same patches from the front and from behind."""
    view = _view_of(patches)
    for panel, title, direction in zip(panels, ("front", "back"), (view, view.turned()), strict=True):
        panel.imshow(draw(patches, direction, PANEL, marks))
        panel.set_title(title, fontsize=13)


def _view_of(patches: list[Patch]) -> View:
    return widest_view(np.concatenate([patch.points.reshape(-1, 3) for patch in patches]), tilt=0.45)


def _write_numbers(panel: Any, solution: Solution) -> None:
    report = solution.report
    norms = [("L2 error", report.l2), ("relative", report.l2_relative), ("H1 seminorm", report.h1_seminorm)]
    lines = [f"{report.dofs:,} unknowns"]
    lines += [f"{name} {value:.3e}" for name, value in norms if value is not None]
    if not report.converged:
        lines.append("NOT CONVERGED")
    panel.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", fontsize=14, linespacing=1.8)


def _color_bar(figure: Figure, panels: Any, norm: Any, title: str) -> None:
    from matplotlib.cm import ScalarMappable

    bar = figure.colorbar(ScalarMappable(norm, MAP), ax=panels, shrink=0.85, aspect=28)
    bar.set_label(title, fontsize=13)


def _save(figure: Figure, path: Path) -> None:
    """Write it, PNG or PDF by the ending, under a temporary name, then rename it."""
    with replacing(path) as temporary:
        figure.savefig(temporary)
