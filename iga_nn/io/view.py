"""Samples a body, and a solution on it, on linear cells, which ParaView slices, clips and contours rightly.

The nodes of the hexahedra lie on the spline, some a span of the solution and direction, with the values there of `arap`
(distortion at volume 1, of several patches each in its own box), `det J`, and, with a solution, `u`, (the exact
solution being known) `error` = |u - u_h|, and quantities of its law. Displacements are vectors `u`, and their `error`
is a length. Symmetric tensors have six components, in VTK's order. Of a left-handed volume bottom and top of each cell
change places. The cells of several patches are in one grid, a block of cells after the other, with the cell data
`patch`, the number of each cell's patch, and `solid`, that of its solid where there are several.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.files import replacing, save_text
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.bspline import divided_spans
from parameterize.spline.orientation import orientations
from parameterize.spline.spline_stack import SplineStack
from parameterize.surface.part import PartSurface
from solve.field import FieldOnBody
from solve.field_groups import FieldGroup, groups_of
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Form, Quantity
from solve.quantities import group_values, quantity_of
from solve.solution import Solution

from ..errors import InputError, one_line
from ..figures.fields import OnGrid, arap_of, error_at, known_groups, problems_on
from .cell_regions import enter_regions
from .elements import Cuts
from .vtk import bezier_cells, enter, enter_owners, hexahedra, save

if TYPE_CHECKING:
    import pyvista

log = logging.getLogger(__name__)

Quantities = Iterable[str] | Mapping[str, Quantity]
Rows = Sequence[Array]  # of parameters, a direction each

SAMPLES = 3  # cells a span and direction, where they are not too many
MOST_VIEWED = 2**20  # points of a view
MOST_KEPT = 220_000  # points of solution.vtu, each some 70 bytes with a displacement and its stress
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))  # as VTK counts
BACKWARDS = (4, 5, 6, 7, 0, 1, 2, 3)  # bottom and top change places
TENSOR = {"XX": (0, 0), "YY": (1, 1), "ZZ": (2, 2), "XY": (0, 1), "YZ": (1, 2), "XZ": (0, 2)}  # in the order of VTK


def write_view(
    path: Path,
    body: BodyLike,
    solution: FieldOnBody | None = None,
    problem: BoundaryValueProblem | None = None,
    samples: int | None = None,
    quantities: Quantities | None = None,
    part: PartSurface | None = None,
) -> None:
    """Write samples of the map, the solution and, where its problem is known, the error and quantities of its law.

    samples: cells a span and direction, chosen by default. The regions of the problem and the groups of a part are cell
    data, as in `io.vtk`. Raises InputError for quantities that are not known.
    """
    seen, cuts = _viewed(body, solution, problem, samples, quantities)
    enter_regions(seen, as_body(body), list(cuts), [cuts[number] for number in sorted(cuts)], problem, part)
    save(path, seen)


def write_solution(path: Path, solution: Solution) -> int:
    """Write a solution and the quantities of its law in single precision, and return how many spans a cell takes a
    direction: more than one where the file would be large.
    """
    parts = _parts(solution.body, solution, solution.problem)
    fitted = [_fitting(part.breaks, MOST_KEPT // len(solution.body)) for part in parts]
    lattices = [_sampled(part, rows, _of(part, rows, None)) for part, (rows, _) in zip(parts, fitted, strict=True)]
    save(path, _joined(solution.body, lattices, np.float32))
    return max(spans for _, spans in fitted)


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
    return _viewed(body, solution, problem, samples, quantities)[0]


def _viewed(
    body: BodyLike,
    solution: FieldOnBody | None,
    problem: BoundaryValueProblem | None,
    samples: int | None,
    quantities: Quantities | None,
) -> tuple[pyvista.UnstructuredGrid, dict[int, Cuts]]:
    """Return linear cells, `samples` a span and direction or as many as fit, with the values of map and solution.

    With them come the ends of the cells of each patch, in the order of the cells.
    """
    cuts: dict[int, Cuts] = {}
    lattices, most = [], MOST_VIEWED // len(as_body(body))
    for part in _parts(body, solution, problem):
        rows = (
            _fitting(part.breaks, most)[0] if samples is None else [divided_spans(row, samples) for row in part.breaks]
        )
        u, v, w = rows
        cuts |= dict.fromkeys(part.numbers.tolist(), (u, v, w))
        lattices.append(_sampled(part, rows, _of_map(part, rows) | _of(part, rows, quantities)))
    import pyvista

    return pyvista.wrap(_joined(body, lattices)), cuts


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


@dataclass(frozen=True, eq=False)
class _Part:
    """Hold k patches of a body that have equal degrees and knots, the solution on them, and the problem there.

    hands: (k,), the orientations. arap: the function that gives the distortion of patches of a map's group on a tensor
    grid. rows: (k,), the places of the patches in that group. functions: None without a solution; the problem has X, Y,
    Z measured in the body.
    """

    numbers: IntArray
    maps: SplineStack
    hands: IntArray
    arap: OnGrid
    rows: IntArray
    functions: FieldGroup | None = None

    @property
    def breaks(self) -> list[Array]:
        """Return the ends of the spans of the solution and the map, in each direction."""
        shown = [self.maps.knots] if self.functions is None else [self.maps.knots, self.functions.values.knots]
        return [np.unique(np.concatenate(rows)) for rows in zip(*shown, strict=True)]


def _parts(body: BodyLike, solution: FieldOnBody | None, problem: BoundaryValueProblem | None) -> list[_Part]:
    glued = as_body(body)
    known = list(zip(glued.groups, arap_of(glued), strict=True))
    parts = [
        _Part(group.numbers, group.stack, orientations(group), arap, np.arange(len(group)))
        for group, (_, arap) in known
    ]
    if solution is None:
        return parts
    is_known = isinstance(solution, Solution)  # it knows the problem on each patch
    problems = () if problem is None or is_known else problems_on(problem, glued)
    return [
        _with_functions(next(part for part in parts if own.numbers[0] in part.numbers), own)
        for own in (known_groups(solution) if is_known else groups_of(solution, glued, problems))
    ]


def _with_functions(part: _Part, functions: FieldGroup) -> _Part:
    """Return the patches of a part that have these functions."""
    rows = np.searchsorted(part.numbers, functions.numbers)
    return replace(
        part, numbers=functions.numbers, maps=functions.maps, hands=part.hands[rows], rows=rows, functions=functions
    )


@dataclass(frozen=True, eq=False)
class _Lattice:
    """Hold samples of k patches: points (k, n_u, n_v, n_w, 3), fields (k, n_u, n_v, n_w, ...) by name."""

    part: _Part
    points: Array
    fields: Mapping[str, Array]

    @property
    def cells(self) -> IntArray:
        """Return the numbers (k, cells, 8) of the corners of all hexahedra; cells count u fastest."""
        shape = self.points.shape[3:0:-1]  # of the points, which count u fastest, too
        numbers = np.arange(math.prod(shape)).reshape(shape)
        corners = [numbers[_ends(c), _ends(b), _ends(a)].ravel() for a, b, c in CORNERS]
        first = numbers.size * np.arange(len(self.points))
        cells = first[:, None, None] + np.stack(corners, axis=1)
        cells[self.part.hands < 0] = cells[self.part.hands < 0][..., BACKWARDS]
        return cells


def _ends(side: int) -> slice:
    return slice(1, None) if side else slice(None, -1)


def _joined(body: BodyLike, lattices: Sequence[_Lattice], kind: type[np.floating[Any]] = np.float64) -> Any:
    """Return the samples of all patches as one grid of VTK, with the numbers of each cell's patch and solid."""
    cells, owners, start = [], [], 0
    for lattice in lattices:
        own = lattice.cells
        cells.append(start + own.reshape(-1, 8))
        owners.append(np.repeat(lattice.part.numbers, own.shape[1]))
        start += lattice.points.size // 3
    points = np.concatenate([_flat(lattice.points) for lattice in lattices]).astype(kind)
    grid = hexahedra(points, np.concatenate(cells))
    enter_owners(grid, as_body(body), np.concatenate(owners))
    for name in lattices[0].fields:
        columns, components = _as_columns(np.concatenate([_flat(lattice.fields[name]) for lattice in lattices]))
        entered = enter(grid.GetPointData(), name, columns.astype(kind))
        for number, component in enumerate(components):
            entered.SetComponentName(number, component)
    return grid


def _flat(values: Array) -> Array:
    """Return values (k, n_u, n_v, n_w, ...) as (points, ...): VTK counts the first index fastest."""
    return values.transpose(0, 3, 2, 1, *range(4, values.ndim)).reshape(-1, *values.shape[4:])


def _fitting(breaks: Rows, most: int) -> tuple[Rows, int]:
    """Return the ends of cells that have not more than `most` points, and how many spans each takes a direction.

    A span has up to SAMPLES cells; only where one is too many does a cell take several spans.
    """
    for samples in range(SAMPLES, 0, -1):
        if np.prod([samples * (len(row) - 1) + 1.0 for row in breaks]) <= most:
            return [divided_spans(row, samples) for row in breaks], 1
    spans, rows = 1, breaks
    while np.prod([float(len(row)) for row in rows]) > most and max(map(len, rows)) > 2:
        spans += 1
        rows = [np.append(row[:-1:spans], row[-1]) for row in breaks]
    return rows, spans


def _sampled(part: _Part, rows: Rows, fields: Mapping[str, Array]) -> _Lattice:
    """Return the samples at parameters, with fields (k, n_u, n_v, n_w, ...)."""
    u, v, w = rows
    return _Lattice(part, part.maps.grid(u, v, w), fields)


def _of_map(part: _Part, rows: Rows) -> dict[str, Array]:
    u, v, w = rows
    return {"arap": part.arap(part.rows, u, v, w), "det J": np.linalg.det(part.maps.grid_slopes(u, v, w))}


def _of(part: _Part, rows: Rows, quantities: Quantities | None) -> dict[str, Array]:
    """Return a solution on a grid of patches, its error where the exact solution is known, and quantities of its law.

    Raises InputError for quantities without a law, and for names that it does not give.
    """
    functions = part.functions
    if (functions is None or functions.problem is None) and quantities:
        raise InputError("quantities need a solution whose law is known, by the report.json beside it")
    if functions is None:
        return {}
    u, v, w = rows
    values = functions.function_on(u, v, w)
    fields = {"u": values[..., 0] if values.shape[-1] == 1 else values}
    if (problem := functions.problem) is None:
        return fields
    if problem.exact is not None:
        fields["error"] = error_at(fields["u"], problem, functions.points_on(u, v, w))
    chosen = _default(problem.form.quantities) if quantities is None else quantities
    asked = chosen if isinstance(chosen, Mapping) else {name: name for name in chosen}
    try:
        return fields | {name: _quantity(functions, problem.form, what, rows) for name, what in asked.items()}
    except ValueError as error:
        if quantities is not None:
            raise InputError(one_line(error)) from None
        log.warning("%s left out: %s", " and ".join(asked), one_line(error))  # det J is zero somewhere
        return fields


def _quantity(functions: FieldGroup, form: Form, what: str | Quantity, rows: Rows) -> Array:
    """Return a quantity (k, n_u, n_v, n_w, ...) on a grid of patches."""
    u, v, w = rows
    return np.moveaxis(group_values(functions, quantity_of(form, what), u, v, w), (-4, -3, -2, -1), (0, 1, 2, 3))


def _default(given: Mapping[str, Quantity]) -> tuple[str, ...]:
    """Return the quantities in a file of a law with these quantities."""
    more = (name for name in ("plastic_strain", "volume_ratio") if name in given)
    return ("stress", "von_mises", *more) if "stress" in given else ("gradient", "flux")


def _as_columns(flat: Array) -> tuple[Array, Sequence[str]]:
    """Return values (points, ...) as numbers (points,), vectors or tensors (points, k), and names of the latter.

    A symmetric tensor has the six components of TENSOR, another one its nine, row by row.
    """
    if flat.shape[1:] == (3, 3) and np.allclose(flat, np.swapaxes(flat, 1, 2), rtol=0.0, atol=1e-12 * np.ptp(flat)):
        return np.stack([flat[:, i, j] for i, j in TENSOR.values()], axis=1), tuple(TENSOR)
    columns = flat.reshape(len(flat), -1)
    return columns[:, 0] if columns.shape[1] == 1 else columns, ()
