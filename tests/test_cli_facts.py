"""`check` of volume meshes: verdicts, the worst element, and exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import meshio
import numpy as np
import pytest
from known_meshes import HEX8, HEX27, KNOWN, TET10, bent, grid, one_inverted
from written_meshes import as_vtk, write_inp, write_msh

from iga_nn.cli.commands import main


def test_a_good_mesh_is_certified(in_folder, capsys):
    write_msh(Path("good.msh"), grid(HEX27, (2, 2, 2), bent))
    assert main(["check", "good.msh"]) == 0
    said = capsys.readouterr().out
    assert "det J > 0:       certified" in said and "overlap:         none, proved" in said
    assert "8 hexahedron27" in said and "worst:           element 107" in said
    assert main(["check", "good.msh", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["one_to_one"] == "yes" and facts["worst"]["number"] == 107


def test_a_bad_element_is_named(in_folder, capsys):
    write_inp(Path("bad.inp"), one_inverted(TET10))
    assert main(["check", "bad.inp"]) == 3
    assert "1 element inverted, det J of the other sign all over: 103" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "says", "code"),
    [
        ("a ring, wound twice", "YES", 3),
        ("cubes touching, not glued", "4 pairs of faces", 0),
        ("left-handed hexahedron8", "det J < 0:       certified", 0),
    ],
)
def test_overlaps_and_orientation_are_told(in_folder, capsys, name, says, code):
    mesh = KNOWN[name].mesh()
    if len(mesh.blocks) > 1:
        mesh = type(mesh)(mesh.points, (type(mesh.blocks[0])(HEX8, *_joined(mesh)),))
    as_vtk(mesh).save("a.vtu")
    assert main(["check", "a.vtu"]) == code
    assert says in capsys.readouterr().out


def _joined(mesh):
    return np.concatenate([b.nodes for b in mesh.blocks]), np.concatenate([b.numbers for b in mesh.blocks])


def test_surfaces_in_such_files_are_surfaces(in_folder, capsys):
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    triangles = [("triangle", np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))]
    meshio.write("surface.msh", meshio.Mesh(points, triangles), file_format="gmsh")
    meshio.write("surface.vtu", meshio.Mesh(points, triangles))
    meshio.write("both.vtu", meshio.Mesh(points, [*triangles, ("tetra", np.array([[0, 1, 2, 3]]))]))
    for name in ("surface.msh", "surface.vtu"):
        assert main(["check", name]) == 0
        assert capsys.readouterr().out.startswith("accepted")
    assert main(["check", "both.vtu"]) == 0
    assert "1 tetra4" in capsys.readouterr().out
    assert main(["check", "both.vtu", "--strict"]) == 0  # an option of surfaces asks for that of the file
    assert capsys.readouterr().out.startswith("accepted")


def test_bad_files_are_one_line(in_folder, capsys):
    Path("a.inp").write_text("*NODE\n1, 0, 0, 0\n")
    for name, says in (("a.inp", "no solid|format"), ("none.inp", "no such file|No such file")):
        assert main(["check", name]) == 2
        error = capsys.readouterr().err
        assert error.startswith("iga-nn: ") and error.count("\n") == 1
        assert any(part in error for part in says.split("|")), error
