"""Meshes of elements become bodies of patches, which are solved on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from known_meshes import HEX8, HEX20, HEX27, HEX64, KNOWN, TET4, TET10, bent, grid, moved, ring
from written_meshes import as_vtk, write_inp, write_msh

import iga_nn
from iga_nn.io.mesh_body import body_of_mesh
from parameterize.certificate.boundary import check_boundary
from parameterize.meshes.certify import certify_mesh
from parameterize.meshes.mesh import Block, VolumeMesh


@pytest.mark.parametrize("kind", [HEX8, HEX20, HEX27, HEX64, TET4, TET10], ids=str)
def test_the_body_is_the_mesh(kind):
    is_cubes = kind.shape == "hexahedron"
    mesh = grid(kind, (2, 2, 1) if is_cubes else (1, 1, 1), bent)
    body = body_of_mesh(mesh)
    certificate = iga_nn.certify(body)
    assert certificate.verdict == "certified" and check_boundary(body).injective
    assert certificate.volume == pytest.approx(certify_mesh(mesh).volume)
    assert len(body) == (4 if is_cubes else 24) and len(body.parts) == 1  # a cube is six tetrahedra, four patches each
    assert len(body.outer_faces) == (16 if is_cubes else 6 * 2 * 3)
    if kind in (HEX20, HEX27, TET10):  # the map is quadratic, and the elements are exactly it
        inside = np.array([[0.3, 0.6, 0.2], [0.9, 0.1, 0.8]])
        assert np.all(body.locate(bent(inside))[0] >= 0)


def test_a_ring_of_hexahedra_is_solved_on(in_folder):
    write_msh(Path("ring.msh"), grid(HEX27, (8, 1, 1), ring(1), wrap=1))
    body = iga_nn.load_volume("ring.msh")
    assert len(body) == 8 and len(body.interfaces) == 8
    found = iga_nn.solve(body, iga_nn.Poisson(exact="x*y + z"), refine=1)
    assert found.report.l2 < 1e-2


def test_tetrahedra_are_solved_on(in_folder):
    write_inp(Path("cube.inp"), grid(TET10, (1, 1, 1)))
    found = iga_nn.solve(iga_nn.load_volume("cube.inp"), iga_nn.Poisson(exact="x + 2*y"))
    assert found.report.l2 < 1e-9


def test_groups_are_solids():
    mesh = grid(HEX8, (2, 1, 1))
    grouped = VolumeMesh(mesh.points, mesh.blocks, {}, {"steel": np.array([0]), "rubber": np.array([1])})
    assert body_of_mesh(grouped).solids.labels == ("steel", "rubber")


def test_left_handed_meshes_are_bodies():
    body = body_of_mesh(moved(grid(HEX20, (2, 1, 1), bent), scale=np.array([1, 1, -1.0])))
    assert {patch.orientation for patch in iga_nn.certify(body).patches} == {"left-handed"}


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("wedge as a hexahedron", "two corners in one place"),
        ("an element given twice", "given twice|same side"),
        ("an element folded back over another", "same side"),
        ("sides with other nodes", "conforming"),
        ("wedges beside hexahedra", "4 wedge"),
    ],
)
def test_meshes_that_are_no_bodies_say_why(name, says):
    with pytest.raises(ValueError, match=says):
        body_of_mesh(KNOWN[name].mesh())


def test_surfaces_are_no_volumes(in_folder):
    mesh = grid(HEX8, (1, 1, 1))
    as_vtk(VolumeMesh(mesh.points, (Block(HEX8, mesh.blocks[0].nodes, np.array([1])),))).extract_surface(
        algorithm="dataset_surface"
    ).save("a.vtp")
    with pytest.raises(iga_nn.InputError, match="not a spline volume"):
        iga_nn.load_volume("a.vtp")
