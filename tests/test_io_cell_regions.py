"""Regions of conditions and groups of a part as cell data of the files for VTK, as pyvista reads them."""

import numpy as np
import pytest
import pyvista
from test_io_calculix import bar

import iga_nn
from iga_nn.io.view import write_view
from iga_nn.io.vtk import write_bezier

PROBLEM = iga_nn.Elasticity(fix="nx < -0.9", load={"nx > 0.9": (0, 0, 1)}, pressure={"nz > 0.9 and x < 1.3": 2})


class Ends:
    """Stand for the surface of a part: its left end is triangle 0, all else is triangle 1."""

    groups = {"patch": np.array([0]), "skin": np.array([0, 1])}

    def nearest(self, points, normals):
        return np.where(points[:, 0] < 1e-9, 0, 1)


def written(path, kind):
    if kind == "vtk":
        write_bezier(path, bar(), None, PROBLEM, Ends())
    else:
        write_view(path, bar(), None, PROBLEM, 2, None, Ends())
    return pyvista.read(path)


@pytest.mark.parametrize("kind", ["vtk", "view"])
def test_cells_with_a_face_in_a_region_are_marked(tmp_path, kind):
    grid = written(tmp_path / "bar.vtu", kind)
    box = np.array([grid.get_cell(number).bounds for number in range(grid.n_cells)])
    marks = {
        "fix_1": box[:, 0] < 1e-9,
        "load_2": box[:, 1] > 4 - 1e-9,
        "pressure_3": (box[:, 5] > 1 - 1e-9) & (box[:, :2].mean(axis=1) < 1.3),
        "group patch": (box[:, 0] < 1e-9),
    }
    for name, expected in marks.items():
        assert np.array_equal(grid.cell_data[name], expected), name
    assert np.array_equal(np.unique(grid.cell_data["patch"]), [0, 1])
    assert grid.cell_data["skin"].sum() < grid.n_cells  # cells inside have no face on the boundary
    assert grid.threshold(0.5, scalars="load_2").bounds[0] == pytest.approx(4 - (2 / 3 if kind == "vtk" else 1 / 3))
