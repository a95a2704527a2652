"""Exact cells of several patches in one grid."""

import sys

import numpy as np
import pytest
from bodies import ring, row_of
from glued import POINTS
from volumes import spans_at

import iga_nn
from iga_nn.io.vtk import bezier_cells

WAYS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((1, 0, 2), (False, False, False))]
CORNER = row_of([(0, 0, 0), (1, 0, 0), (1, 1, 0)], WAYS)  # the third patch is left-handed


def test_the_cells_of_a_file_are_those_of_its_patches(in_folder):
    """VTK evaluates each at the place of points of its patch."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    CORNER.save("corner.npz")
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(iga_nn.export("corner.npz", "vtk")))
    reader.Update()
    grid, start = reader.GetOutput(), 0
    owners = np.array(grid.GetCellData().GetArray("patch"))
    for number, patch in enumerate(CORNER):
        count = int(np.prod([len(np.unique(row)) - 1 for row in patch.knots]))
        assert np.all(owners[start : start + count] == number)
        for cell, local, place in zip(*spans_at(patch, POINTS), patch(POINTS), strict=True):
            found, weights = [0.0] * 3, [0.0] * grid.GetCell(int(start + cell)).GetNumberOfPoints()
            local = local * [1, 1, -1] + [0, 0, 1] if number == 2 else local
            index = sys.modules["vtkmodules.vtkCommonCore"].reference(0)
            grid.GetCell(int(start + cell)).EvaluateLocation(index, local.tolist(), found, weights)
            assert np.abs(np.array(found) - place).max() < 1e-12
        start += count


@pytest.mark.parametrize("body", [CORNER, ring(1), ring(3)], ids=["corner", "ring", "three"])
def test_the_surface_of_the_grid_is_that_of_the_body(body):
    """Interfaces are no part of it: the cells of outer faces, each a face of one cell, are left."""
    spans = [[len(np.unique(row)) - 1 for row in patch.knots] for patch in body]
    outer = sum(
        np.prod([n for axis, n in enumerate(spans[number]) if axis != "uvw".index(name[0])])
        for number, faces in enumerate(body.outer)
        for name in faces
    )
    grid = bezier_cells(body, None)
    faces = {}
    for cell in range(grid.n_cells):
        for face in grid.get_cell(cell).faces:
            key = frozenset(face.point_ids)
            faces[key] = faces.get(key, 0) + 1
    assert sum(count == 1 for count in faces.values()) == outer
