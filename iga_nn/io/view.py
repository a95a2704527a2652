"""Samples a body, and a solution on it, on linear cells, which ParaView slices, clips and contours rightly.

The nodes of the hexahedra lie on the spline, some a span of the solution and direction, with the values there of `arap`
(distortion at volume 1, of several patches each in its own box), `det J`, and, with a solution, `u`, (the exact
solution being known) `error` = |u - u_h|, and quantities of its law. Displacements are vectors `u`, and their `error`
is a length. Symmetric tensors have six components, in VTK's order. Of a left-handed volume bottom and top of each cell
change places. The cells of several patches are in one grid, a block of cells after the other, with the cell data
`patch`: the number of each cell's patch.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from parameterize.arrays import Array
from parameterize.files import replacing, save_text
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.bspline import divided_spans
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume
from solve.field import FieldOnBody, Points, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity
from solve.quantities import on_grid
from solve.solution import Solution

from ..errors import InputError, one_line
from ..figures.fields import OnGrid, arap_of, error_at, problems_on
from .vtk import bezier_cells, breaks_of, save

if TYPE_CHECKING:
    import pyvista

log = logging.getLogger(__name__)

Quantities = Iterable[str] | Mapping[str, Quantity]
Rows = Sequence[Array]  # of parameters, a direction each

SAMPLES = 3  # cells a span and direction, where they are not too many
MOST_VIEWED = 2**20  # points of a view
MOST_KEPT = 220_000  # points of solution.vtu, each some 70 bytes with a displacement and its stress
TENSOR = {"XX": (0, 0), "YY": (1, 1), "ZZ": (2, 2), "XY": (0, 1), "YZ": (1, 2), "XZ": (0, 2)}  # in the order of VTK


def write_view(
    path: Path,
    body: BodyLike,
    solution: FieldOnBody | None = None,
    problem: BoundaryValueProblem | None = None,
    samples: int | None = None,
    quantities: Quantities | None = None,
) -> None:
    """Write samples of the map, the solution and, where its problem is known, the error and quantities of its law.

    samples: cells a span and direction, chosen by default. Raises InputError for quantities that are not known.
    """
    save(path, _viewed(body, solution, problem, samples, quantities))


def write_solution(path: Path, solution: Solution) -> int:
    """Write a solution and the quantities of its law in single precision, and return how many spans a cell takes a
    direction: more than one where the file would be large.
    """
    parts = _parts(solution.body, solution, solution.problem)
    grids, most = [], 1
    for part in parts:
        rows, spans = _fitting(breaks_of(part.volume, part.solution), MOST_KEPT // len(parts))
        fields = _of(part, rows, None)
        grid = _sampled(part.volume, rows, {name: values.astype(np.float32) for name, values in fields.items()})
        grid.points = grid.points.astype(np.float32)
        grids.append(grid)
        most = max(most, spans)
    save(path, _joined(solution.body, grids))
    return most


def grid(
    body: BodyLike,
    solution: FieldOnBody | None = None,
    problem: BoundaryValueProblem | None = None,
    samples: int | None = None,
    quantities: Quantities | None = None,
) -> pyvista.UnstructuredGrid:
    """Return a body, and a solution on it, as a grid of pyvista: exact cells, or `samples` linear ones a span.

    quantities: names of the law's quantities, or functions by name; by default the names that `_default` returns.
    """
    if samples is None:
        if quantities:
            raise ValueError("quantities need linear cells: give samples, such as 2")
        return bezier_cells(body, solution)
    if samples < 1:
        raise ValueError(f"samples {samples}: must be 1 or larger, or None for exact Bezier cells")
    return _viewed(body, solution, problem, samples, quantities)


def _viewed(
    body: BodyLike,
    solution: FieldOnBody | None,
    problem: BoundaryValueProblem | None,
    samples: int | None,
    quantities: Quantities | None,
) -> pyvista.UnstructuredGrid:
    """Return linear cells, `samples` a span and direction or as many as fit, with the values of map and solution."""
    parts, grids = _parts(body, solution, problem), []
    for part in parts:
        shown = breaks_of(part.volume, part.solution)
        most = MOST_VIEWED // len(parts)
        rows = _fitting(shown, most)[0] if samples is None else [divided_spans(row, samples) for row in shown]
        grids.append(_sampled(part.volume, rows, _of_map(part, rows) | _of(part, rows, quantities)))
    return _joined(body, grids)


def write_series(path: Path, times: Sequence[float], fields: Sequence[FieldOnBody], samples: int | None = None) -> None:
    """Write a field at some times: a .pvd file that names the times, and a .vtu file for each beside it; atomic.

    samples: as in `grid`. Raises ValueError for another ending, and for a field without a volume.
    """
    if path.suffix != ".pvd":
        raise ValueError(f"{path}: a series of ParaView is a file that ends in .pvd")
    entries = []
    for number, (time, field) in enumerate(zip(times, fields, strict=True)):
        target = path.with_name(f"{path.stem}_{number:04d}.vtu")
        with replacing(target) as temporary:
            save(temporary, grid(field.on_body, field, samples=samples))
        entries.append(f'<DataSet timestep="{float(time)!r}" part="0" file="{escape(target.name)}"/>')
    inside = "\n".join(entries)
    save_text(path, f'<VTKFile type="Collection" version="0.1"><Collection>\n{inside}\n</Collection></VTKFile>\n')


@dataclass(frozen=True)
class _Part:
    """Hold a patch of a body, the solution on it, and the problem there, with X, Y, Z measured in the body.

    arap: the function that gives the distortion on a tensor grid.
    """

    volume: BSplineVolume
    arap: OnGrid
    solution: SplineField | None
    problem: BoundaryValueProblem | None


def _parts(body: BodyLike, solution: FieldOnBody | None, problem: BoundaryValueProblem | None) -> list[_Part]:
    volumes = as_body(body).patches
    fields = [None] * len(volumes) if solution is None else solution.patches
    problems = [None] * len(volumes) if problem is None else problems_on(problem, body)
    return [_Part(*part) for part in zip(volumes, arap_of(body), fields, problems, strict=True)]


def _joined(body: BodyLike, grids: Sequence[pyvista.UnstructuredGrid]) -> pyvista.UnstructuredGrid:
    """Return the grids of all patches as one, with the number of each cell's patch."""
    if as_body(body).is_single:
        return grids[0]
    import pyvista

    for number, grid in enumerate(grids):
        grid.cell_data["patch"] = np.full(grid.n_cells, number)
    return pyvista.merge(grids, merge_points=False) if len(grids) > 1 else grids[0]


def _fitting(breaks: Rows, most: int) -> tuple[Rows, int]:
    """Return the ends of cells that have not more than `most` points, and how many spans each takes a direction.

    A span has up to SAMPLES cells; only where one is too many does a cell take several spans.
    """
    for samples in range(SAMPLES, 0, -1):
        if np.prod([samples * (len(row) - 1) + 1.0 for row in breaks]) <= most:
            return [divided_spans(row, samples) for row in breaks], 1
    spans, rows = 1, breaks
    while np.prod([float(len(row)) for row in rows]) > most:
        spans += 1
        rows = [np.append(row[:-1:spans], row[-1]) for row in breaks]
    return rows, spans


def _sampled(volume: BSplineVolume, rows: Rows, fields: Mapping[str, Array]) -> pyvista.UnstructuredGrid:
    """Return the linear cells between parameters, with fields (n_u, n_v, n_w, ...) as their point data."""
    import pyvista

    u, v, w = rows
    grid = pyvista.StructuredGrid(*np.moveaxis(volume.grid(u, v, w), -1, 0)).cast_to_unstructured_grid()
    if orientation(volume) < 0:  # bottom and top of each cell change places
        grid.cells = grid.cells.reshape(-1, 9)[:, [0, 5, 6, 7, 8, 1, 2, 3, 4]].ravel()
    for name, values in fields.items():
        columns, components = _as_columns(values)
        grid.point_data[name] = columns
        for number, component in enumerate(components):
            grid.GetPointData().GetArray(name).SetComponentName(number, component)
    return grid


def _of_map(part: _Part, rows: Rows) -> dict[str, Array]:
    u, v, w = rows
    return {"arap": part.arap(u, v, w), "det J": np.linalg.det(part.volume.grid_jacobian(u, v, w))}


def _of(part: _Part, rows: Rows, quantities: Quantities | None) -> dict[str, Array]:
    """Return a solution on a grid of a patch, its error where the exact solution is known, and quantities of its law.

    Raises InputError for quantities without a law, and for names that it does not give.
    """
    volume, solution, problem = part.volume, part.solution, part.problem
    if (solution is None or problem is None) and quantities:
        raise InputError("quantities need a solution whose law is known, by the report.json beside it")
    if solution is None:
        return {}
    u, v, w = rows
    fields = {"u": solution.grid(u, v, w)}
    if problem is None:
        return fields
    if problem.exact is not None:
        fields["error"] = error_at(fields["u"], problem, Points.on(volume, u, v, w))
    chosen = _default(problem.form.quantities) if quantities is None else quantities
    asked = chosen if isinstance(chosen, Mapping) else {name: name for name in chosen}
    field = replace(solution, geometry=volume)
    try:
        return fields | {name: on_grid(field, problem.form, what, u, v, w) for name, what in asked.items()}
    except ValueError as error:
        if quantities is not None:
            raise InputError(one_line(error)) from None
        log.warning("%s left out: %s", " and ".join(asked), one_line(error))  # det J is zero somewhere
        return fields


def _default(given: Mapping[str, Quantity]) -> tuple[str, ...]:
    """Return the quantities in a file of a law with these quantities."""
    return ("stress", "von_mises") if "stress" in given else ("gradient", "flux")


def _as_columns(values: Array) -> tuple[Array, Sequence[str]]:
    """Return values (n_u, n_v, n_w, ...) as numbers (points,), vectors or tensors (points, k), and names of the latter.

    A symmetric tensor has the six components of TENSOR, another one its nine, row by row.
    """
    flat = values.reshape((-1, *values.shape[3:]), order="F")  # VTK counts the first index fastest
    if flat.shape[1:] == (3, 3) and np.allclose(flat, np.swapaxes(flat, 1, 2), rtol=0.0, atol=1e-12 * np.ptp(flat)):
        return np.stack([flat[:, i, j] for i, j in TENSOR.values()], axis=1), tuple(TENSOR)
    columns = flat.reshape(len(flat), -1)
    return columns[:, 0] if columns.shape[1] == 1 else columns, ()
