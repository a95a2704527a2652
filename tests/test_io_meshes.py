"""Meshes of other programs are read with their nodes in the right places: known cubes through a known polynomial."""

from __future__ import annotations

import locale
import re

import numpy as np
import pytest
import pyvista
from known_meshes import HEX8, HEX20, HEX27, HEX64, TET4, TET10, bent, grid
from vtkmodules.vtkIOExodus import vtkExodusIIReader
from written_meshes import ABAQUS, GMSH, VTK, as_vtk, write_exodus, write_inp, write_msh

import iga_nn
from iga_nn.io.abaqus_mesh import C3D27
from parameterize.meshes.certify import certify_mesh
from parameterize.meshes.kinds import hexahedron

BENT_VOLUME = certify_mesh(grid(HEX27, (2, 2, 2), bent)).volume  # that of all kinds of degree 2, and more


def expect_bent(found, kind, first):
    """Expect the bent cube: its volume is known, det J >= 0.7, and with another order of nodes it would fold."""
    certificate = certify_mesh(found)
    assert certificate.is_proved
    assert [block.kind for block in found.blocks] == [kind]
    assert found.numbers.min() == first and len(found) in (8, 48)
    if kind.degrees[0] > 1:
        assert certificate.volume == pytest.approx(BENT_VOLUME, rel=1e-9)


@pytest.mark.parametrize("kind", GMSH, ids=str)
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_gmsh(tmp_path, kind, version):
    write_msh(tmp_path / "a.msh", grid(kind, (2, 2, 2), bent), version)
    found = iga_nn.load_mesh(tmp_path / "a.msh")
    expect_bent(found, kind, 100)
    assert len(found.groups["steel"]) == len(found)


@pytest.mark.parametrize("kind", ABAQUS, ids=str)
def test_abaqus(tmp_path, kind):
    write_inp(tmp_path / "a.inp", grid(kind, (2, 2, 2), bent))
    found = iga_nn.load_mesh(tmp_path / "a.inp")
    expect_bent(found, kind, 100)
    assert len(found.groups["steel"]) == len(found) and found.groups["some"].tolist() == [0, 1, 2]


def test_c3d27_with_its_inner_node_last_is_refused(tmp_path):
    mesh = grid(HEX27, (1, 1, 1))
    mesh.blocks[0].nodes[:] = mesh.blocks[0].nodes[:, C3D27]
    write_inp(tmp_path / "a.inp", mesh)
    with pytest.raises(iga_nn.InputError, match="order of Abaqus"):
        iga_nn.load_mesh(tmp_path / "a.inp")


@pytest.mark.parametrize("kind", VTK, ids=str)
@pytest.mark.parametrize("ending", [".vtu", ".vtk"])
def test_vtk(tmp_path, kind, ending):
    as_vtk(grid(kind, (2, 2, 2), bent)).save(tmp_path / f"a{ending}")
    expect_bent(iga_nn.load_mesh(tmp_path / f"a{ending}"), kind, 0)


def test_reading_leaves_the_locale(tmp_path):
    before = locale.setlocale(locale.LC_ALL)
    as_vtk(grid(HEX8, (1, 1, 1), bent)).save(tmp_path / "a.vtk")
    locale.setlocale(locale.LC_ALL, before)
    iga_nn.load_mesh(tmp_path / "a.vtk")
    assert locale.setlocale(locale.LC_ALL) == before


def test_vtu_before_version_2_1_has_two_edges_of_hexahedra_exchanged(tmp_path):
    """VTK's own reader says the same of the nodes of these files."""
    as_vtk(grid(HEX64, (1, 1, 1), bent)).save(tmp_path / "new.vtu", binary=False)
    text = (tmp_path / "new.vtu").read_text()
    (tmp_path / "old.vtu").write_text(re.sub(r'(<VTKFile[^>]*version=")[\d.]+', r"\g<1>1.0", text))
    seen = pyvista.read(tmp_path / "old.vtu")
    found = iga_nn.load_mesh(tmp_path / "old.vtu").blocks[0].nodes[0]
    assert (
        found.tolist() == seen.cells[1:].tolist() != iga_nn.load_mesh(tmp_path / "new.vtu").blocks[0].nodes[0].tolist()
    )


def test_exodus_on_hdf5_names_the_package(tmp_path):
    (tmp_path / "a.exo").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(iga_nn.InputError, match="netCDF4|damaged"):
        iga_nn.load_mesh(tmp_path / "a.exo")


@pytest.mark.parametrize("kind", [HEX8, HEX20, HEX27, TET4, TET10], ids=str)
def test_exodus(tmp_path, kind):
    """VTK, too, finds the nodes where we do; its reader rounds them to single precision."""
    write_exodus(tmp_path / "a.exo", grid(kind, (2, 2, 2), bent))
    found = iga_nn.load_mesh(tmp_path / "a.exo")
    expect_bent(found, kind, 1)
    reader = vtkExodusIIReader()
    reader.SetFileName(str(tmp_path / "a.exo"))
    reader.Update()
    (seen,) = (pyvista.wrap(part) for part in pyvista.wrap(reader.GetOutput()).recursive_iterator())
    nodes = seen.cells.reshape(len(found), -1)[:, 1:]
    assert np.allclose(seen.points[nodes], found.points[found.blocks[0].nodes], atol=1e-6)


def test_our_own_bezier_cells(tmp_path):
    from solve import benchmark_volume

    benchmark_volume(3).save(tmp_path / "volume.npz")
    iga_nn.export(tmp_path / "volume.npz", "vtk", tmp_path / "b.vtu")
    found = iga_nn.load_mesh(tmp_path / "b.vtu")
    assert [block.kind for block in found.blocks] == [hexahedron(3, is_bezier=True)]
    assert certify_mesh(found).is_proved


@pytest.mark.parametrize("name", ["a.msh", "a.inp", "a.vtu", "a.vtk", "a.exo", "a.cgns"])
@pytest.mark.parametrize("content", [b"", b"\0\xff junk\n", b"*NODE\n1, 2, x\n*ELEMENT, TYPE=C3D4\n1, 1, 1, 1\n"])
def test_bad_files_are_one_line(tmp_path, name, content, capfd):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(iga_nn.InputError) as error:
        iga_nn.load_mesh(tmp_path / name)
    assert name in str(error.value) and "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", [".msh", ".inp", ".vtu", ".exo"])
def test_truncated_files_are_one_line(tmp_path, ending):
    mesh, path = grid(TET10, (1, 1, 1)), tmp_path / f"a{ending}"
    if ending == ".vtu":
        as_vtk(mesh).save(path)
    else:
        {".msh": write_msh, ".inp": write_inp, ".exo": write_exodus}[ending](path, mesh)
    whole = path.read_bytes()
    for share in (0.3, 0.6, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(iga_nn.InputError):
            iga_nn.load_mesh(path)


def test_wedges_are_counted(tmp_path):
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (0, 0, -1)], dtype=float)
    cells = {13: np.array([[0, 1, 2, 3, 4, 5]]), 10: np.array([[0, 2, 1, 6]])}
    pyvista.UnstructuredGrid(cells, points).save(tmp_path / "a.vtu")
    found = iga_nn.load_mesh(tmp_path / "a.vtu")
    assert dict(found.unchecked) == {"wedge": 1} and len(found) == 1


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("*INCLUDE, INPUT=other.inp", "names another file"),
        ("*NGEN\n1, 2", "generates nodes"),
        ("*INSTANCE, NAME=a, PART=p\n1., 0., 0.", "moves or repeats"),
        ("*ELEMENT, TYPE=C3D4\n7, 1, 2, 3, 9", "node 9"),
        ("*ELEMENT, TYPE=C3D4\n7, 1, 2, 3", "not 4 nodes"),
        ("*ELEMENT, TYPE=S4\n7, 1, 2, 3, 4", "no solid"),
    ],
)
def test_inp_that_is_not_read_says_why(tmp_path, line, says):
    (tmp_path / "a.inp").write_text(f"*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n{line}\n")
    with pytest.raises(iga_nn.InputError, match=says):
        iga_nn.load_mesh(tmp_path / "a.inp")
