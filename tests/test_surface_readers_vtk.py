"""VTK's .vtp and legacy .vtk, by its own writers, against volumes known by hand."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista
from mesh_files import CUBE, QUADS
from reader_files import grid
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter, vtkUnstructuredGridWriter

from parameterize.surface.surface import MeshError, load_surface

STRIPS = [[1, 0, 3, 2], [4, 5, 6, 7], [0, 1, 4, 5], [3, 2, 7, 6], [0, 4, 2, 6], [1, 3, 5, 7]]
FIRST = "# vtk DataFile Version 3.0\na cube\nASCII\nDATASET POLYDATA\n"


def cube(values=(7, 7, 8, 8, 9, 9)):
    mesh = pyvista.PolyData.from_regular_faces(CUBE, np.array(QUADS))
    mesh.cell_data["part"] = np.array(values)
    mesh.point_data["heat"] = np.linspace(0.0, 1.0, 8)
    mesh.cell_data["load"] = np.linspace(0.0, 1.0, 6)
    return mesh


@pytest.mark.parametrize("suffix", [".vtp", ".vtk"])
@pytest.mark.parametrize("binary", [False, True])
def test_polygons_with_groups(suffix, binary, tmp_path):
    cube().save(tmp_path / f"cube{suffix}", binary=binary)
    surface = load_surface(tmp_path / f"cube{suffix}")
    assert surface.volume == pytest.approx(1.0)
    assert {name: len(faces) for name, faces in surface.groups.items()} == {"part=7": 4, "part=8": 4, "part=9": 4}
    quads = surface.faces[surface.groups["part=9"]]
    assert np.allclose(np.ptp(surface.vertices[quads.ravel()], axis=0), 1.0)  # the sides x = 0 and x = 1


@pytest.mark.parametrize("suffix", [".vtp", ".vtk"])
def test_strips_and_lines_beside_them(suffix, tmp_path):
    mesh = pyvista.PolyData(CUBE, strips=np.ravel([[4, *row] for row in STRIPS]), lines=[2, 0, 1])
    mesh.save(tmp_path / f"cube{suffix}")
    surface = load_surface(tmp_path / f"cube{suffix}")
    assert surface.volume == pytest.approx(1.0)
    assert any("left out cells without area: 1 poly_line" in line for line in surface.notices)


@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("form", [1, 2])
def test_legacy_files_of_both_versions(version, form, tmp_path):
    solid = grid([(12, [0, 1, 3, 2, 4, 5, 7, 6]), (3, [0, 1]), *((9, quad) for quad in QUADS)])
    solid.cell_data["part"] = np.array([5, 5, 1, 1, 2, 2, 3, 3])
    for number, (kind, mesh) in enumerate(((vtkPolyDataWriter, cube()), (vtkUnstructuredGridWriter, solid))):
        writer = kind()
        writer.SetInputData(mesh)
        writer.SetFileVersion(version)
        writer.SetFileType(form)
        writer.SetFileName(str(tmp_path / f"{number}.vtk"))
        writer.Write()
        surface = load_surface(tmp_path / f"{number}.vtk")
        assert surface.volume == pytest.approx(1.0)
        assert [len(faces) for faces in surface.groups.values()] == [4, 4, 4]


def test_a_file_by_hand_with_numbers_on_any_line(tmp_path):
    path = tmp_path / "cube.vtk"
    places = " ".join(f"{x:g}" for x in CUBE.ravel())
    rows = "\n".join("4 " + " ".join(map(str, quad)) for quad in QUADS)
    fields = "CELL_DATA 6\nSCALARS part int 1\nLOOKUP_TABLE default\n1 1 2\n2 3 3\n"
    path.write_text(f"{FIRST}POINTS 8 double\n{places}\n\nPOLYGONS 6 30\n{rows}\n{fields}")
    assert list(load_surface(path).groups) == ["part=1", "part=2", "part=3"]
    path.write_text(f"{FIRST}POINTS 8 double\n{places}\n\nPOLYGONS 6 30\n{rows[:-2]}\n")
    with pytest.raises(MeshError, match="promises 30 numbers, 29 follow"):
        load_surface(path)
