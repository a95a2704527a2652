"""Exact Bezier cells of rational volumes: VTK evaluates them with their weights."""

from dataclasses import replace

import pytest
from rational_shapes import bent_bar, octant, quarter_ring
from test_io_formats import POINTS, cell_values, largest, read_vtu

from iga_nn.io.vtk import write_bezier
from parameterize.spline.body import Body
from parameterize.spline.orientation import mirrored
from solve import Elasticity, Poisson, solve_problem


@pytest.mark.parametrize("volume", [quarter_ring(), octant(), bent_bar(), quarter_ring().refined()])
def test_vtk_reads_rational_cells(volume, tmp_path):
    write_bezier(tmp_path / "volume.vtu", volume)
    grid = read_vtu(tmp_path / "volume.vtu")
    assert grid.GetCellData().GetHigherOrderDegrees().GetTuple(0) == volume.degrees
    assert largest(cell_values(grid, volume, POINTS) - volume(POINTS)) < 1e-12


@pytest.mark.parametrize("problem", [Poisson(exact="x*y+z"), Elasticity(exact=("x*y", "z", "y*y"))])
@pytest.mark.parametrize("degree", [2, 3])
def test_vtk_reads_a_solution_on_rational_cells(problem, degree, tmp_path):
    solution = solve_problem(quarter_ring(), problem, refine=1, degree=degree)
    write_bezier(tmp_path / "volume.vtu", quarter_ring(), solution.field)
    grid = read_vtu(tmp_path / "volume.vtu")
    finer = quarter_ring().refined()
    assert largest(cell_values(grid, finer, POINTS) - finer(POINTS)) < 1e-12
    found = cell_values(grid, finer, POINTS, "u")
    assert largest(found - solution(POINTS).reshape(found.shape)) < 1e-12


@pytest.mark.parametrize(("factor", "points"), [(1.0, 2 * 12 - 6), (3.0, 2 * 12)])
def test_patches_share_points_of_the_same_weight(factor, points, tmp_path):
    from vtkmodules.vtkCommonCore import reference

    outer = quarter_ring(2.0, 3.0)
    body = Body.from_patches([quarter_ring(), replace(outer, weights=factor * outer.weights)])
    write_bezier(tmp_path / "body.vtu", body)
    grid = read_vtu(tmp_path / "body.vtu")
    assert grid.GetNumberOfPoints() == points
    for number, patch in enumerate(body):
        cell = grid.GetCell(number)
        place, shape = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
        cell.EvaluateLocation(reference(0), [0.3, 0.6, 0.2], place, shape)
        assert largest(place - patch([[0.3, 0.6, 0.2]])[0]) < 1e-12


def test_a_left_handed_ring_is_written_right_handed(tmp_path):
    write_bezier(tmp_path / "volume.vtu", mirrored(quarter_ring()))
    grid = read_vtu(tmp_path / "volume.vtu")
    turned = POINTS * [1.0, 1.0, -1.0] + [0.0, 0.0, 1.0]
    assert largest(cell_values(grid, quarter_ring(), turned) - mirrored(quarter_ring())(POINTS)) < 1e-12
