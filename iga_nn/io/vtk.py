"""Writes a volume for ParaView and VTK as exact Bezier cells.

Exact (`_bezier.vtu`): every knot span is a VTK_BEZIER_HEXAHEDRON (cell type 79) that holds the Bernstein coefficients
of F; neighbours share the points between them. A cell's points are in the order of `vtkHigherOrderHexahedron`: corners,
edges, faces, inside. The cells count u fastest. The degrees of each cell (HigherOrderDegrees) and the weights of the
points (RationalWeights, 1 but on a rational volume) are active attributes: readers take them for the shape functions.
Point data are Bernstein coefficients, too. Where a solution has a higher degree or more knots than the map, both are
written in the higher degree on all spans, exactly. On a rational volume the shape functions of the solution are
rational, too: u = (u W) / W, of the sum of the degrees. VTK's cells are right-handed: of a left-handed volume each has
w reversed.

The patches of a body are in one grid, not a block each: neighbours share the points of an interface where they have the
same weights there, so that the surface is the body's and fields run on through it. The cell data `patch` is the number
of a cell's patch, and `solid`, of a body of several solids, that of its solid: ParaView selects (Threshold) or colours
by them. So it does by the regions of conditions, such as `fix_1`, and by the groups of the part: 1 for cells with a
face there, else 0.

VTK's slices, clips and contours take the Bernstein coefficients of such cells for values and are wrong; surfaces and
tessellations are right. For slicing and clipping there are the samples of `io.view`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from parameterize.arrays import Array, IntArray
from parameterize.spline.bernstein import elevation, extraction
from parameterize.spline.body import Body, BodyLike, as_body, shared_numbers
from parameterize.spline.bspline import (
    apply_along,
    evaluate_grid,
    greville,
    insert_knots,
    interpolate_grid,
    sparse_rows,
)
from parameterize.spline.interface import WEIGHT_TOLERANCE, Interface, face_layer
from parameterize.spline.orientation import hands_of
from parameterize.spline.rational import projected
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.part import PartSurface
from solve.field import FieldOnBody, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem

from .cell_regions import enter_regions
from .elements import Cuts

if TYPE_CHECKING:
    import pyvista

BEZIER_HEXAHEDRON = 79


def write_bezier(
    path: Path,
    body: BodyLike,
    solution: FieldOnBody | None = None,
    problem: BoundaryValueProblem | None = None,
    part: PartSurface | None = None,
) -> None:
    """Write the exact cells; a solution becomes the point data `u`, the regions of a problem cell data."""
    whole = as_body(body)
    grid = bezier_cells(whole, solution)
    fields = (None,) * len(whole) if solution is None else solution.patches
    cuts = [breaks_of(*one) for one in zip(whole, fields, strict=True)]
    enter_regions(grid, whole, range(len(whole)), cuts, problem, part)
    save(path, grid)


@dataclass(frozen=True)
class _Exact:
    """Hold the cells of a patch, rows of its points (s, nodes), their degrees, and the Bernstein coefficients.

    points: (m_u, m_v, m_w, 3). weights: (m_u, m_v, m_w). values: of a solution, (m_u, m_v, m_w) or with components.
    """

    cells: IntArray
    degrees: Sequence[int]
    points: Array
    weights: Array
    values: Array | None


def bezier_cells(body: BodyLike, solution: FieldOnBody | None) -> pyvista.UnstructuredGrid:
    """Return the cells of all patches, with the numbers that `enter_owners` enters.

    Neighbours share the points of their interface where these have the same weights, so that the surface of the grid is
    that of the body. Where the weights of two faces differ by a factor, each patch keeps points of its own.
    """
    import pyvista

    body = as_body(body)
    fields = (None,) * len(body) if solution is None else solution.patches
    are_left = hands_of(body.groups) < 0
    parts = [_exact(*part) for part in zip(body, fields, are_left.tolist(), strict=True)]
    weights = [part.weights for part in parts]
    glued = [interface for interface in body.interfaces if _are_alike(weights, interface)]
    labels, count = shared_numbers([row.shape for row in weights], glued)
    rows = [label.ravel()[part.cells] for label, part in zip(labels, parts, strict=True)]
    counted = np.concatenate([np.insert(row, 0, row.shape[1], axis=1).ravel() for row in rows])
    degrees = np.concatenate([np.tile(part.degrees, (len(part.cells), 1)) for part in parts]).astype(np.float64)
    points = _entered([part.points for part in parts], labels, count)
    grid = pyvista.UnstructuredGrid(counted, np.full(len(degrees), BEZIER_HEXAHEDRON), points)
    grid.cell_data.set_array(degrees, "HigherOrderDegrees")
    grid.point_data.set_array(_entered(weights, labels, count), "RationalWeights")
    grid.GetCellData().SetActiveHigherOrderDegrees("HigherOrderDegrees")
    grid.GetPointData().SetActiveRationalWeights("RationalWeights")
    enter_owners(grid, body, np.repeat(np.arange(len(parts)), list(map(len, rows))))
    if solution is not None:
        values = [part.values for part in parts if part.values is not None]
        grid.point_data["u"] = _entered(values, labels, count)
    return grid


def hexahedra(points: Array, cells: IntArray) -> Any:
    """Return linear hexahedra (k, 8) on points (n, 3) as a grid of VTK itself: pyvista takes longer to load."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, vtkCellArray, vtkUnstructuredGrid

    places, rows, grid = vtkPoints(), vtkCellArray(), vtkUnstructuredGrid()
    places.SetData(numpy_to_vtk(points, deep=True))
    rows.SetData(cells.shape[1], numpy_to_vtk(cells.ravel(), deep=True))
    grid.SetPoints(places)
    grid.SetCells(VTK_HEXAHEDRON, rows)
    return grid


def enter(data: Any, name: str, values: NDArray[Any]) -> Any:
    """Enter an array (n,) or (n, k) into the point or cell data of a grid of VTK and return it; the first is shown."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    data.AddArray(array)
    if data.GetScalars() is None:
        data.SetActiveScalars(name)
    return array


def enter_owners(grid: Any, body: Body, owners: IntArray) -> None:
    """Enter the numbers of the cells' patches (cells,) and solids, where the body has several, as cell data."""
    if not body.is_single:
        enter(grid.GetCellData(), "patch", owners)
    if body.solids.are_several:
        enter(grid.GetCellData(), "solid", body.solids.numbers[owners])


def _entered(values: Sequence[Array], labels: Sequence[IntArray], count: int) -> Array:
    """Return values (m_u, m_v, m_w, ...) of each patch as one array (count, ...), by the numbers of their points."""
    entered = np.empty((count, *values[0].shape[3:]))
    for own, label in zip(values, labels, strict=True):
        entered[label] = own
    return entered


def _are_alike(weights: Sequence[Array], interface: Interface) -> bool:
    """Return whether the points of two patches have the same degree and weights (m_u, m_v, m_w) at an interface."""
    first, second = (face_layer(weights[patch], face) for patch, face in (interface.first, interface.second))
    second = interface.turned(second)
    return first.shape == second.shape and np.allclose(first, second, rtol=WEIGHT_TOLERANCE, atol=0.0)


def _exact(volume: BSplineVolume, solution: SplineField | None, is_left: bool) -> _Exact:
    """Return the cells of a volume with the coefficients of a solution on it. is_left: whether it is left-handed."""
    shown: list[BSplineVolume | SplineField] = [volume] if solution is None else [volume, solution]
    breaks, degrees = breaks_of(volume, solution), [max(s.degrees[a] for s in shown) for a in range(3)]
    if volume.weights is not None and solution is not None:
        degrees = [sum(max(s.degrees) for s in shown)] * 3
    net = volume.control_points if volume.weights is None else volume.homogeneous
    net = _bernstein(volume.degrees, volume.knots, net, breaks, degrees)
    points, weights = (net, np.ones(net.shape[:3])) if volume.weights is None else projected(net)
    cells = _cells([len(b) - 1 for b in breaks], degrees, is_left)
    values = None
    if solution is not None and volume.weights is None:
        values = _bernstein(solution.degrees, solution.knots, solution.coefficients, breaks, degrees)
    elif solution is not None:
        values = _weighted(solution, volume, breaks, degrees[0]) / weights[..., None]
        values = values.reshape(*weights.shape, *solution.coefficients.shape[3:])
    return _Exact(cells, degrees, points, weights, values)


def _weighted(solution: SplineField, volume: BSplineVolume, breaks: Sequence[Array], degree: int) -> Array:
    """Return the Bernstein coefficients (s_u q + 1, ..., c) of u W, W the weight of a rational volume, of degree q."""
    knots = [np.repeat(row, [degree + 1, *[degree] * (len(row) - 2), degree + 1]) for row in breaks]
    u, v, w = (greville(row, degree) for row in knots)
    weight = evaluate_grid(volume.degrees, volume.knots, volume.homogeneous[..., 3:], (u, v, w))
    return interpolate_grid(knots, degree, solution.grid(u, v, w).reshape(*weight.shape[:3], -1) * weight)


def breaks_of(volume: BSplineVolume, solution: SplineField | None) -> Cuts:
    """Return the ends of the spans of the solution and its volume, in each direction."""
    shown: list[BSplineVolume | SplineField] = [volume] if solution is None else [volume, solution]
    u, v, w = (np.unique(np.concatenate([spline.knots[a] for spline in shown])) for a in range(3))
    return u, v, w


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


def save(path: Path, grid: Any) -> None:
    """Write the grid through a string: on a full disk VTK's own writing fails with a long log and no reason."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.SetCompressionLevel(1)  # in half of the time of VTK's 5, and the file is 1.5 % larger
    writer.WriteToOutputStringOn()
    writer.Write()
    path.write_text(writer.GetOutputString(), encoding="ascii")
