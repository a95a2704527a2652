"""Draws a solution, its error and shapes of vibrations: on the boundary, in the body cut open, and inside."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from parameterize.spline.body import BodyLike, as_body
from solve import Modes, Solution
from solve.field import FieldOnBody
from solve.forms.boundary_value_problem import BoundaryValueProblem

from ..level_table import EXACT_ERRORS, TITLES
from ..options import NO_UNITS, Units
from .colors import ColorRange, with_unit
from .cutaway import Painted, cut_of, visible
from .fields import (
    ColoredField,
    Samples,
    error_of,
    fields_of,
    lines_of,
    maps_of,
    on_planes,
    outer_faces,
    points_of,
    sizes_of,
    solution_of,
    vectors_of,
    vectors_on,
    warp_of,
)
from .first_view import shown_from
from .outline import edge_patch, outline_of
from .panels import panels_of
from .render import TILT, Patch, View, check_drawable, widest_view
from .style import color_bar, save, show, show_around, show_inside

MOST, COLUMNS = 6, 3  # modes
MODE_SAMPLES = 61  # a direction of a face
BORDERED = 150  # patches: the borders of more would cover the colours, and sharp edges are drawn
SWING = 0.15  # of the body's size: the largest displacement of a mode as drawn


def draw_error(
    path: str | Path | None,
    body: BodyLike,
    solution: Solution,
    problem: BoundaryValueProblem,
    units: Units = NO_UNITS,
) -> Figure:
    """Draw |u - u_h| on the boundary and inside (`show_inside`) in logarithmic colours, and write its norms.

    units: texts that stand beside the colour bar, as in all figures here.
    """
    field, points = error_of(body, solution, problem), points_of(body)
    figure, rows = panels_of(2, 3)
    painted = Painted(points, field, lines_of(body, 1))
    show_around(rows[0][:2], painted.at(outer_faces(body)), view=shown_from(body, solution))
    write_numbers(rows[0][2], solution)
    show_inside(rows[1], body, points, painted)
    color_bar(figure, field.limits, with_unit(r"$|u - u_h|$", units.displacement))
    where = "on the mid-sections" if as_body(body).is_single else "inside"
    return save(figure, path, f"Error on the boundary and {where}")


def draw_solution(path: str | Path | None, body: BodyLike, solution: FieldOnBody, units: Units = NO_UNITS) -> Figure:
    """Draw u_h on the boundary, in the body cut open and inside (`show_inside`); of an elastic body, the stress.

    An elastic body is drawn as its displacements deform it, enlarged by a factor that the title states.
    """
    field, points = fields_of(solution)[0], points_of(body)
    if not (factor := warp_of(solution, points.diagonal)):
        return _draw_values(path, body, points, field, units, view=shown_from(body, solution))
    largest = max(float(values.max()) for values in solution_of(solution).everywhere)
    most = with_unit(f"at most {largest:.3g}", units.displacement)
    title = f"The deformed body: displacements, {most}, are drawn {factor_in_words(factor)} times as large"
    moved = moved_by(points, solution, factor)
    return _draw_values(path, body, moved, field, units, title, shown_from(body, solution))


def draw_values(
    path: str | Path | None,
    body: BodyLike,
    solution: FieldOnBody,
    title: str,
    *,
    exaggerate: float | None = None,
) -> Figure:
    """Draw u_h, or the length of a vector u_h, on the boundary, in the body cut open, and inside (`show_inside`).

    The colours range over the whole solid. exaggerate: draw the body displaced by that many times u_h, a vector.
    """
    points = points_of(body)
    moved = points if exaggerate is None else moved_by(points, solution, exaggerate)
    return _draw_values(path, body, moved, replace(solution_of(solution), title=title), NO_UNITS)


def moved_by(points: Samples, solution: FieldOnBody, factor: float) -> Samples:
    """Return points, displaced by a factor times the solution."""
    by = vectors_of(solution)
    return Samples(points.places, points.planes + factor * by.planes, points.lattices + factor * by.lattices)


def _draw_values(
    path: str | Path | None,
    body: BodyLike,
    points: Samples,
    field: ColoredField,
    units: Units,
    heading: str = "",
    view: View | None = None,
) -> Figure:
    """Draw a field on the faces and sections of all patches at points.

    units: those of the colour bar. heading: of the figure. view: from the front; by default the widest one.
    """
    are_few, at_rest = len(as_body(body)) <= BORDERED, points_of(body)
    painted = Painted(points, field, lines_of(body, 1) if are_few else 0)  # lines along the borders
    outside = points.on(outer_faces(body))
    edges = [] if are_few else [edge_patch(outside.reshape(-1, 3), outline_of(body).edges)]
    figure, rows = panels_of(2, 3)
    show_around(rows[0][:2], [*painted.at(outer_faces(body)), *edges], view=view)
    left_out, view = cut_of(body, points, at_rest, view)
    halved = replace(painted, lines=lines_of(body, 2) if are_few else 0)  # lines along the cut, too
    show(rows[0][2], "cut open", visible(body, halved, left_out), view)
    show_inside(rows[1], body, at_rest, painted)
    color_bar(figure, field.limits, field.titled(units), field.said(units))
    return save(figure, path, heading)


def draw_modes(path: str | Path | None, body: BodyLike, modes: Modes) -> Figure:
    """Draw the first modes, displacements, and their frequencies; the size of each is free, and the same in all."""
    shown = list(zip(modes.frequencies, modes.shapes, strict=True))[:MOST]
    figure, axes = panels_of(-(-len(shown) // COLUMNS), min(COLUMNS, len(shown)))
    places, samples = outer_faces(body), min(MODE_SAMPLES, sizes_of(body)[0])
    size, still = as_body(body).size, on_planes(maps_of(body), places, samples)
    view = widest_view(still.reshape(-1, 3), TILT)  # of the body at rest: one for all modes
    for panel, (frequency, shape) in zip(axes.flat, shown, strict=False):
        moved = on_planes(vectors_on(shape), places, samples)
        far = np.linalg.norm(moved, axis=-1)
        limits = ColorRange(0.0, float(far.max()))
        patch = Patch(still + SWING * size / limits.high * moved, limits.colors(far), every=samples - 1)
        show(panel, f"{frequency:.4g} Hz", [patch], view)
    count = len(modes.frequencies)
    which = f"The first {MOST} of {count} modes" if count > MOST else "The lowest modes"
    return save(figure, path, f"{which}, coloured by their displacement")


def factor_in_words(factor: float) -> str:
    """Return a factor as text, such as "300" or "2e+06"."""
    return f"{factor:.6g}" if 1e-3 <= factor < 1e6 else f"{factor:.1e}"


def plot_solution(solution: Solution, what: str, file: str | Path | None) -> Figure:
    """Return the values of a solution, or its error, on the boundary and inside."""
    check_drawable(what, ("values", "error"))
    if what == "error":
        if solution.problem.exact is None:
            raise ValueError("the error is not known: the problem has no exact solution; plot 'values'")
        return draw_error(file, solution.body, solution, solution.problem)
    return draw_solution(file, solution.body, solution)


def write_numbers(panel: Any, solution: Solution) -> None:
    """Write the unknowns and the errors of a solution on a panel."""
    report = solution.report
    errors = [(TITLES[key], getattr(report, key)) for key in EXACT_ERRORS]
    lines = [f"{report.dofs:,} unknowns"]
    lines += [f"{title} {value:.3e}" for title, value in errors if value is not None]
    if not report.converged:
        lines.append("NOT CONVERGED")
    panel.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", fontsize=14, linespacing=1.8)
