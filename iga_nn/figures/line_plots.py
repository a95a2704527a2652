"""Draws curves: the loss over the steps, the errors over the mesh size."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from solve.solution import LoadStep

from ..level_table import Study
from ..options import NO_UNITS, Units
from .colors import FACE_COLORS, with_unit
from .panels import DPI, Picture
from .style import positive, save
from .ticks import in_powers, show_powers

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
TERM_COLORS = tuple(colormaps["tab10"](range(10)))  # a term keeps its colour where another is left out
LOWEST = 1e-8  # value that is drawn, over the largest loss
SAME_NORM = 1e-3  # relative: norms of one solution on meshes of different sizes agree better
LEFT, RIGHT, BELOW, ABOVE = 0.85, 0.95, 0.6, 0.4  # inches beside the axes: of the ticks, their labels and a title
LEGEND, SLANTED = 2.3, 0.9  # inches: of the terms on the right, of the stages' names above
STAGES = {"S(2)": "round cuboid S(2)", "S(1)": "sharper cuboid S(1)"}  # the other names need no explanation


def draw_history(path: Path | None, history: dict[str, NDArray[Any]]) -> Figure:
    """Draw the loss and its unweighted terms over the steps, the folded samples below, and mark the stages."""
    terms = [name for name in history if name not in ("stage", "step", "loss", "folded")]
    steps = np.arange(len(history["loss"]))
    ratios = {"sharex": True, "height_ratios": (4, 1)}
    figure, (upper, lower) = _blank(2, 1, (11, 6), right=LEGEND, above=SLANTED, between=0.2, **ratios)
    lowest = LOWEST * float(np.nanmax(history["loss"]))
    for name, color in zip(terms, TERM_COLORS * len(terms), strict=False):
        values = positive(history[name])
        if not np.any(values >= lowest):
            continue  # zero, or too small to be seen, at every step
        style = {"color": color, "linewidth": 0.8, "marker": ".", "markersize": 2.0}  # a dot shows a single step
        upper.plot(steps, values, alpha=0.8, label=TERMS.get(name, name), **style)
    upper.plot(steps, positive(history["loss"]), color="black", linewidth=1.4, label="loss")
    upper.set_yscale("log")
    show_powers(upper.yaxis)
    upper.set_ylim(bottom=max(upper.get_ylim()[0], lowest))  # terms start at zero
    upper.set_ylabel("loss, and its terms without their weights")
    upper.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    lower.plot(steps, history["folded"], color="firebrick", linewidth=1.0)
    lower.set_yscale("symlog", linthresh=1.0)
    lower.yaxis.set_major_formatter(in_powers)
    lower.set_ylim(bottom=0.0)
    lower.set_ylabel("folded samples")
    lower.set_xlabel("step")
    stages = history["stage"]
    for start in np.flatnonzero(np.r_[True, stages[1:] != stages[:-1]]):
        for axes in (upper, lower):
            axes.axvline(start, color="grey", linewidth=0.7, linestyle=":")
        label = {"textcoords": "offset points", "rotation": 35, "fontsize": 9}  # slanted: short stages lie close
        name = str(stages[start])
        upper.annotate(STAGES.get(name, name), (start, 1.0), (0, 3), xycoords=upper.get_xaxis_transform(), **label)
    return save(figure, path)


def draw_study(path: Path | None, study: Study) -> Figure:
    """Draw L2 and H1 errors over the mesh size, a curve per degree, with the slopes of smooth solutions.

    Relative errors are drawn where they are known, with an axis of the absolute ones on the right.
    """
    figure, panels = _blank(1, 2, (11, 5), between=LEFT + RIGHT)
    norms = (("L2", "l2", "l2_relative", 0), ("H1 seminorm", "h1_seminorm", "h1_relative", 1))
    for panel, (title, absolute, relative, lost) in zip(panels, norms, strict=True):
        reports = [level.report for levels in study.values() for level in levels]
        is_relative = all(getattr(report, relative) is not None for report in reports)
        for (degree, levels), color in zip(study.items(), FACE_COLORS * 2, strict=False):
            sizes = np.array([level.report.elements for level in levels]) ** (-1.0 / 3.0)
            name = relative if is_relative else absolute
            errors = positive(np.array([getattr(level.report, name) for level in levels]))
            panel.loglog(sizes, errors, "o-", color=color, label=f"degree {degree}")
            order = degree + 1 - lost
            reference = 0.6 * errors[-1] * (sizes / sizes[-1]) ** order
            panel.loglog(sizes, reference, "--", color=color, linewidth=0.8)
            label = {"textcoords": "offset points", "ha": "center", "color": color, "fontsize": 9}
            panel.annotate(f"slope {order}", (sizes[-1], reference[-1]), (0, -12), **label)
        counts = sorted({round(level.report.elements ** (1.0 / 3.0)) for levels in study.values() for level in levels})
        panel.set_xticks([1.0 / count for count in counts], [f"1/{count}" for count in counts])
        panel.xaxis.set_minor_locator(NullLocator())
        show_powers(panel.yaxis)
        panel.set_xlabel("h, the edge of an element in the unit cube")
        panel.set_title(f"{title} error", y=1.0)
        panel.set_ylabel("relative" if is_relative else "absolute")
        if is_relative:
            _add_absolute_axis(panel, [(getattr(r, absolute), getattr(r, relative)) for r in reports])
        panel.grid(alpha=0.3)
        panel.margins(x=0.12, y=0.08)
    panels[0].legend(frameon=False)
    return save(figure, path)


def draw_load_steps(path: Path | None, steps: Sequence[LoadStep], units: Units = NO_UNITS) -> Figure:
    """Draw the share of the load over the largest displacement, a point for each load step, from rest on."""
    figure, axes = _blank(1, 1, (7, 5), right=0.2)
    moved, shares = ([0.0, *(getattr(step, name) for step in steps)] for name in ("displacement", "factor"))
    axes.plot(moved, shares, "o-", color=FACE_COLORS[0], markersize=4.0)
    axes.axhline(1.0, color="grey", linewidth=0.7, linestyle=":")
    axes.set_xlabel(with_unit("largest displacement", units.displacement))
    axes.set_ylabel("share of the load")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    return save(figure, path)


def _blank(
    rows: int,
    columns: int,
    inches: tuple[float, float],
    *,
    right: float = RIGHT,
    above: float = ABOVE,
    between: float = 0.0,
    **ratios: Any,
) -> tuple[Figure, Any]:
    """Return an empty figure and its axes. right, above, between: inches that the axes leave free, for texts."""
    width, height = inches
    across, down = (width - LEFT - right + between) / columns - between, (height - BELOW - above + between) / rows
    place = {"left": LEFT / width, "right": 1.0 - right / width, "bottom": BELOW / height, "top": 1.0 - above / height}
    figure = Picture(figsize=inches, dpi=DPI)
    space = {"wspace": between / across, "hspace": between / (down - between)}
    return figure, figure.subplots(rows, columns, gridspec_kw=place | space, **ratios)


def _add_absolute_axis(panel: Any, errors: Sequence[tuple[float, float]]) -> None:
    """Draw the absolute errors' axis on the right, where all relative errors are over the same norm of the solution.

    errors: each absolute and relative; studies of several volumes have several norms, and no such axis.
    """
    norms = [absolute / relative for absolute, relative in errors if relative > 0.0]
    if norms and max(norms) <= (1.0 + SAME_NORM) * min(norms):
        norm = norms[-1]
        axis = panel.secondary_yaxis("right", functions=(lambda y: norm * y, lambda y: y / norm))
        show_powers(axis.yaxis)
        axis.set_ylabel("absolute")
