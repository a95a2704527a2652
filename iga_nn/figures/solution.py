"""Draws a solution and its error: on the boundary, inside where the volume is cut open, and on the mid-sections."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body
from solve import Solution
from solve.field import FieldOnBody
from solve.forms.boundary_value_problem import BoundaryValueProblem

from ..level_table import EXACT_ERRORS, TITLES
from ..options import NO_UNITS, Units
from .cutaway import cut_of, visible
from .evaluate import outer_faces
from .fields import STRESS, Field, Samples, diagonal_of, error_of, fields_of, points_of, solution_of, vectors_of
from .inside import show_inside
from .ranges import with_unit
from .render import Patch, check_drawable, draw
from .style import PANEL, color_bar, colors, panels_of, save, show_around
from .warp import in_words, warp_of


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
    patches = _colored(points.patches, field)
    show_around(rows[0][:2], [patches[k] for k in outer_faces(body)])
    _write_numbers(rows[0][2], solution)
    show_inside(rows[1], body, points, patches)
    color_bar(figure, rows, field.limits, with_unit(r"$|u - u_h|$", units.displacement))
    where = "on the mid-sections" if as_body(body).is_single else "inside"
    return save(figure, path, f"Error on the boundary and {where}")


def draw_solution(path: str | Path | None, body: BodyLike, solution: FieldOnBody, units: Units = NO_UNITS) -> Figure:
    """Draw u_h on the boundary, in the body cut open and inside (`show_inside`); of an elastic body, the stress.

    An elastic body is drawn as its displacements deform it, enlarged by a factor that the title states.
    """
    field, points = fields_of(solution)[0], points_of(body)
    label = with_unit(field.title, units.stress if field.name == STRESS else units.displacement)
    if not (factor := warp_of(solution, diagonal_of(points))):
        return _draw_values(path, body, points.patches, field, label)
    largest = max(float(values.max()) for values in solution_of(solution).everywhere)
    most = with_unit(f"at most {largest:.3g}", units.displacement)
    title = f"The deformed body: displacements, {most}, are drawn {in_words(factor)} times as large"
    moved = moved_by(points, solution, factor)
    return _draw_values(path, body, moved, field, label, title)


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
    moved = points.patches if exaggerate is None else moved_by(points, solution, exaggerate)
    return _draw_values(path, body, moved, solution_of(solution), title)


def moved_by(points: Samples, solution: FieldOnBody, factor: float) -> list[Array]:
    """Return the patches of points, displaced by a factor times the solution."""
    return [where + factor * by for where, by in zip(points.patches, vectors_of(solution).patches, strict=True)]


def _draw_values(
    path: str | Path | None, body: BodyLike, points: Sequence[Array], field: Field, label: str, heading: str = ""
) -> Figure:
    """Draw a field on the faces and sections of all patches at points (m, m, 3).

    label: of the colour bar. heading: of the figure.
    """
    patches, at_rest = _colored(points, field), points_of(body)
    figure, rows = panels_of(2, 3)
    faces = [patches[k] for k in outer_faces(body)]
    show_around(rows[0][:2], faces)
    left_out, view = cut_of(body, faces, at_rest)
    halved = [replace(patch, every=len(patch.points) // 2) for patch in patches]  # lines along the cut, too
    rows[0][2].imshow(draw(visible(body, halved, left_out), view, PANEL))
    rows[0][2].set_title("cut open", fontsize=13)
    show_inside(rows[1], body, at_rest, patches)
    color_bar(figure, rows, field.limits, label)
    return save(figure, path, heading)


def _colored(points: Sequence[Array], field: Field) -> list[Patch]:
    """Return the patches at points (m, m, 3) in the colours of a field, without shading: they match its bar.

    Lines along the borders show their shape.
    """
    return [
        Patch(where, colors(values, field.limits), lit=False, every=len(where) - 1)
        for where, values in zip(points, field.patches, strict=True)
    ]


def plot_solution(solution: Solution, what: str, file: str | Path | None) -> Figure:
    """Return the values of a solution, or its error, on the boundary and inside."""
    check_drawable(what, ("values", "error"))
    if what == "error":
        if solution.problem.exact is None:
            raise ValueError("the error is not known: the problem has no exact solution; plot 'values'")
        return draw_error(file, solution.body, solution, solution.problem)
    return draw_solution(file, solution.body, solution)


def _write_numbers(panel: Any, solution: Solution) -> None:
    report = solution.report
    errors = [(TITLES[key], getattr(report, key)) for key in EXACT_ERRORS]
    lines = [f"{report.dofs:,} unknowns"]
    lines += [f"{title} {value:.3e}" for title, value in errors if value is not None]
    if not report.converged:
        lines.append("NOT CONVERGED")
    panel.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", fontsize=14, linespacing=1.8)
