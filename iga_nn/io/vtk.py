"""Writes a volume for ParaView and VTK, as exact Bezier cells or as samples on linear cells.

Exact (`_bezier.vtu`): every knot span is a VTK_BEZIER_HEXAHEDRON (cell type 79) that holds the Bernstein coefficients
of F; neighbours share the points between them. A cell's points are in the order of `vtkHigherOrderHexahedron`: corners,
edges, faces, inside. The cells count u fastest. The degrees of each cell (HigherOrderDegrees) and the weights of the
points (RationalWeights, all 1) are active attributes: readers take them for the shape functions. Point data are
Bernstein coefficients, too. Where a solution has a higher degree or more knots than the map, both are written in the
higher degree on all spans, exactly. VTK's cells are right-handed: of a left-handed volume each has w reversed.

VTK's slices, clips and contours take the Bernstein coefficients of such cells for values and are wrong; surfaces and
tessellations are right. For slicing and clipping there are the samples (`_view.vtu`): linear hexahedra whose nodes lie
on the spline, SAMPLES a span and direction, with the values there of `arap` (distortion at volume 1), `det J`, and,
with a solution, `u` and (the exact solution being known) `error` = |u - u_h|. Displacements are vectors `u`, and their
`error` is a length.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from parameterize.arrays import Array
from parameterize.files import replacing, save_text
from parameterize.quality.quality import arap_on
from parameterize.spline.bernstein import elevation, extraction
from parameterize.spline.bspline import apply_along, divided_spans, insert_knots, sparse_rows
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume
from solve.field import Points, SplineField
from solve.forms.frame import UnitFrame

from ..figures.evaluate import error_at
from ..options import Equation

if TYPE_CHECKING:
    import pyvista

SAMPLES = 3  # intervals of the view per span and direction
BEZIER_HEXAHEDRON = 79


def write_bezier(path: Path, volume: BSplineVolume, solution: SplineField | None = None, *_: object) -> None:
    """Write the exact cells; a solution becomes the point data `u`."""
    _write(path, _exact(volume, solution))


def write_view(
    path: Path, volume: BSplineVolume, solution: SplineField | None = None, problem: Equation | None = None
) -> None:
    """Write samples of the map, the solution and, where its problem has an exact solution, the error."""
    _write(path, _sampled(volume, solution, problem, SAMPLES))


def write_series(path: Path, times: Sequence[float], fields: Sequence[SplineField], samples: int | None = None) -> None:
    """Write a field at some times: a .pvd file that names the times, and a .vtu file for each beside it; atomic.

    samples: as in `grid`. Raises ValueError for another ending, and for a field without a volume.
    """
    if path.suffix != ".pvd":
        raise ValueError(f"{path}: a series of ParaView is a file that ends in .pvd")
    entries = []
    for number, (time, field) in enumerate(zip(times, fields, strict=True)):
        if field.geometry is None:
            raise ValueError("a series needs the fields' volume: dataclasses.replace(field, geometry=volume)")
        target = path.with_name(f"{path.stem}_{number:04d}.vtu")
        with replacing(target) as temporary:
            _write(temporary, grid(field.geometry, field, samples=samples))
        entries.append(f'<DataSet timestep="{float(time)!r}" part="0" file="{escape(target.name)}"/>')
    inside = "\n".join(entries)
    save_text(path, f'<VTKFile type="Collection" version="0.1"><Collection>\n{inside}\n</Collection></VTKFile>\n')


def grid(
    volume: BSplineVolume,
    solution: SplineField | None = None,
    problem: Equation | None = None,
    samples: int | None = None,
) -> pyvista.UnstructuredGrid:
    """Return a volume, and a solution on it, as a grid of pyvista: exact cells, or `samples` linear ones a span."""
    if samples is None:
        return _exact(volume, solution)
    if samples < 1:
        raise ValueError(f"samples {samples}: must be 1 or larger, or None for exact Bezier cells")
    return _sampled(volume, solution, problem, samples)


def _exact(volume: BSplineVolume, solution: SplineField | None) -> pyvista.UnstructuredGrid:
    import pyvista

    shown: list[BSplineVolume | SplineField] = [volume] if solution is None else [volume, solution]
    breaks = [np.unique(np.concatenate([s.knots[a] for s in shown])) for a in range(3)]
    degrees = [max(s.degrees[a] for s in shown) for a in range(3)]
    points = _bernstein(volume.degrees, volume.knots, volume.control_points, breaks, degrees).reshape(-1, 3)
    cells = _cells([len(b) - 1 for b in breaks], degrees, orientation(volume) < 0)  # (s, nodes of a cell)
    counted = np.column_stack([np.full(len(cells), cells.shape[1]), cells])
    grid = pyvista.UnstructuredGrid(counted.ravel(), np.full(len(cells), BEZIER_HEXAHEDRON), points)
    grid.cell_data.set_array(np.tile(degrees, (len(cells), 1)).astype(np.float64), "HigherOrderDegrees")
    grid.point_data.set_array(np.ones(len(points)), "RationalWeights")
    grid.GetCellData().SetActiveHigherOrderDegrees("HigherOrderDegrees")
    grid.GetPointData().SetActiveRationalWeights("RationalWeights")
    if solution is not None:
        values = _bernstein(solution.degrees, solution.knots, solution.coefficients, breaks, degrees)
        grid.point_data["u"] = values.reshape(-1, *values.shape[3:])
    return grid


def _sampled(
    volume: BSplineVolume, solution: SplineField | None, problem: Equation | None, samples: int
) -> pyvista.UnstructuredGrid:
    import pyvista

    u, v, w = (divided_spans(knots, samples) for knots in volume.knots)
    points = Points.on(volume, u, v, w)  # (3, m_u, m_v, m_w)
    distortion = arap_on(volume, u, v, w, 1.0 / UnitFrame.of(volume).length)
    fields = {"arap": distortion, "det J": np.linalg.det(volume.grid_jacobian(u, v, w))}
    if solution is not None:
        fields["u"] = solution.grid(u, v, w)
        if problem is not None and problem.exact is not None:
            fields["error"] = error_at(fields["u"], problem.on(volume), points)
    grid = pyvista.StructuredGrid(*np.asarray(points)).cast_to_unstructured_grid()
    if orientation(volume) < 0:  # bottom and top of each cell change places
        grid.cells = grid.cells.reshape(-1, 9)[:, [0, 5, 6, 7, 8, 1, 2, 3, 4]].ravel()
    for name, values in fields.items():
        grid.point_data[name] = values.reshape((-1, *values.shape[3:]), order="F")  # VTK counts the first index fastest
    return grid


def _bernstein(
    degrees: Sequence[int], knots: Sequence[Array], field: Array, breaks: Sequence[Array], raised: Sequence[int]
) -> Array:
    """Return Bernstein coefficients (s_u q_u + 1, s_v q_v + 1, ...) of degrees `raised` on the spans of `breaks`."""
    for axis in range(3):
        missing = np.setdiff1d(breaks[axis], knots[axis])
        finer, insertion = insert_knots(knots[axis], degrees[axis], missing)
        matrix = _span_matrix(finer, degrees[axis], raised[axis]) @ insertion
        field = apply_along(csr_array(matrix), field, axis)
    return field


def _span_matrix(knots: Array, degree: int, raised: int) -> csr_array:
    """Return the matrix (s q + 1, n) from B-spline to Bernstein coefficients of degree q; neighbours share one."""
    first, weights = extraction(knots, degree)
    blocks = elevation(degree, raised) @ weights  # (s, q + 1, degree + 1)
    owned = np.ones(blocks.shape[:2], dtype=bool)
    owned[1:, 0] = False
    columns = np.broadcast_to((first[:, None] + np.arange(degree + 1))[:, None, :], blocks.shape)
    return sparse_rows(blocks[owned], columns[owned], len(knots) - degree - 1)


def _cells(spans: Sequence[int], degrees: Sequence[int], left_handed: bool) -> NDArray[np.int64]:
    """Return the numbers (s, nodes) of the points of every Bezier cell in VTK's order; cells count u fastest.

    left_handed: whether the cells of a right-handed volume would be inside out: then each has w reversed.
    """
    from vtkmodules.vtkCommonDataModel import vtkHigherOrderHexahedron

    shape = [s * q + 1 for s, q in zip(spans, degrees, strict=True)]
    lattice = np.arange(np.prod(shape)).reshape(shape)
    local = np.stack(np.unravel_index(np.arange(np.prod(np.add(degrees, 1))), np.add(degrees, 1)), axis=1)
    order = [vtkHigherOrderHexahedron.PointIndexFromIJK(i, j, k, degrees) for i, j, k in local.tolist()]
    corners = np.stack(np.unravel_index(np.arange(np.prod(spans)), spans, order="F"), axis=1) * degrees  # (s, 3)
    if left_handed:
        local[:, 2] = degrees[2] - local[:, 2]
    nodes = corners[:, None, :] + local[np.argsort(order)]
    return lattice[tuple(np.moveaxis(nodes, -1, 0))]


def _write(path: Path, grid: Any) -> None:
    """Write the grid through a string: on a full disk VTK's own writing fails with a long log and no reason."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    writer.Write()
    path.write_text(writer.GetOutputString(), encoding="ascii")
