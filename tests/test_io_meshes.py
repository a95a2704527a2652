"""Meshes of other programs are read with their nodes in the right places: known cubes through a known polynomial."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista
from known_meshes import HEX8, HEX20, HEX27, HEX64, TET4, TET10, TET20, bent, grid
from scipy.io import netcdf_file
from vtkmodules.vtkIOExodus import vtkExodusIIReader

import iga_nn
from iga_nn.io.abaqus_mesh import C3D27
from iga_nn.io.exodus_mesh import ORDERS
from iga_nn.io.gmsh_mesh import order_of
from parameterize.meshes.certify import certify_mesh
from parameterize.meshes.kinds import hexahedron

GMSH = {HEX8: 5, HEX20: 17, HEX27: 12, HEX64: 92, TET4: 4, TET10: 11, TET20: 29}
VTK = {HEX8: 12, HEX20: 25, HEX27: 29, HEX64: 72, TET4: 10, TET10: 24, TET20: 71}
ABAQUS = {HEX8: "C3D8R", HEX20: "C3D20", HEX27: "C3D27", TET4: "C3D4", TET10: "DC3D10"}
BENT_VOLUME = certify_mesh(grid(HEX27, (2, 2, 2), bent)).volume  # that of all kinds of degree 2, and more


def write_msh(path: Path, mesh, version="2.2"):
    """Write text of Gmsh, version 2.2, or 4.1 with every element in volume 1, physical group 5 "steel"."""
    (block,) = mesh.blocks
    nodes = np.empty_like(block.nodes)
    nodes[:, order_of(block.kind)] = block.nodes
    kind, n, m = GMSH[block.kind], len(mesh.points), len(nodes)
    rows = [f"$MeshFormat\n{version} 0 8\n$EndMeshFormat", '$PhysicalNames\n1\n3 5 "steel"\n$EndPhysicalNames']
    places = [" ".join(map(repr, point)) for point in mesh.points.tolist()]
    cells = [" ".join(str(10 + x) for x in row) for row in nodes.tolist()]
    if version == "2.2":
        rows += ["$Nodes", str(n), *(f"{10 + k} {place}" for k, place in enumerate(places)), "$EndNodes", "$Elements"]
        rows += [str(m + 1), "1 15 2 0 1 10", *(f"{100 + k} {kind} 2 5 1 {cell}" for k, cell in enumerate(cells))]
    else:
        rows += ["$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 5 0\n$EndEntities", f"$Nodes\n1 {n} 10 {9 + n}\n3 1 0 {n}"]
        rows += [*(str(10 + k) for k in range(n)), *places, "$EndNodes", f"$Elements\n1 {m} 100 {99 + m}"]
        rows += [f"3 1 {kind} {m}", *(f"{100 + k} {cell}" for k, cell in enumerate(cells))]
    path.write_text("\n".join([*rows, "$EndElements", ""]))


def write_inp(path: Path, mesh):
    (block,) = mesh.blocks
    nodes = block.nodes if block.kind != HEX27 else block.nodes[:, np.argsort(C3D27)]
    rows = ["*HEADING", "a part", "** a comment", "*NODE, NSET=all"]
    rows += [f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist())]
    rows += [f"*ELEMENT, TYPE={ABAQUS[block.kind]},", " ELSET=steel"]
    for k, row in enumerate((nodes + 1).tolist()):
        words = [str(100 + k), *map(str, row)]
        lines = [words[at : at + 16] for at in range(0, len(words), 16)]
        rows += [", ".join(line) + ("," if line is not lines[-1] else "") for line in lines]
    path.write_text("\n".join([*rows, "*ELSET, ELSET=some, GENERATE", "100, 102, 1", "*STEP", "*END STEP", ""]))


def as_vtk(mesh, cell=None):
    (block,) = mesh.blocks
    cells = np.insert(block.nodes, 0, block.nodes.shape[1], axis=1).ravel()
    return pyvista.UnstructuredGrid(cells, np.full(len(block.nodes), cell or VTK[block.kind]), mesh.points)


def write_exodus(path: Path, mesh):
    (block,) = mesh.blocks
    nodes = np.empty_like(block.nodes)
    nodes[:, ORDERS.get(f"hexahedron{nodes.shape[1]}", slice(None))] = block.nodes
    name = {HEX8: "HEX8", HEX20: "HEX20", HEX27: "HEX27", TET4: "TETRA4", TET10: "TETRA10"}[block.kind]
    with netcdf_file(path, "w") as file:
        file.api_version = file.version = np.float32(5.0)
        file.floating_point_word_size = np.int32(8)
        file.file_size = np.int32(1)
        file.title = b"a part"
        sizes = {"len_string": 33, "len_line": 81, "four": 4, "num_dim": 3, "num_nodes": len(mesh.points)}
        sizes |= {
            "num_elem": len(nodes),
            "num_el_blk": 1,
            "num_el_in_blk1": len(nodes),
            "num_nod_per_el1": nodes.shape[1],
        }
        file.createDimension("time_step", None)
        for dimension, size in sizes.items():
            file.createDimension(dimension, size)
        file.createVariable("time_whole", "d", ("time_step",))
        file.createVariable("eb_status", "i", ("num_el_blk",))[:] = 1
        numbers = file.createVariable("eb_prop1", "i", ("num_el_blk",))
        numbers[:] = 1
        numbers.name = b"ID"
        for axis, coordinate in enumerate(["coordx", "coordy", "coordz"]):
            file.createVariable(coordinate, "d", ("num_nodes",))[:] = mesh.points[:, axis]
        connect = file.createVariable("connect1", "i", ("num_el_in_blk1", "num_nod_per_el1"))
        connect[:] = nodes + 1
        connect.elem_type = name.encode()


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
