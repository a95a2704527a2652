"""Meshes of trimesh, pyvista and meshio in memory are taken and refused as their files are."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
import pyvista
import trimesh
from mesh_files import CUBE, MIXED, QUADS, TETRAHEDRON, TRIANGLES

import iga_nn
from parameterize.surface.readers.objects import class_of
from parameterize.surface.surface import MeshError, load_surface, surface_from_arrays


def polydata(vertices=CUBE, faces=TRIANGLES):
    return pyvista.PolyData(np.array(vertices), np.concatenate([[len(face), *face] for face in faces]))


def of_trimesh(faces):
    return trimesh.Trimesh(CUBE, faces, process=False)


def of_meshio(faces):
    return meshio.Mesh(CUBE, [("triangle", np.array(faces))])


MAKERS = {"trimesh.Trimesh": of_trimesh, "pyvista.PolyData": lambda faces: polydata(CUBE, faces)}
MAKERS |= {"meshio.Mesh": of_meshio}
WRITERS = {
    "trimesh.Trimesh": lambda mesh, path: mesh.export(path),
    "pyvista.PolyData": lambda mesh, path: mesh.save(path),
    "meshio.Mesh": lambda mesh, path: mesh.write(path),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_an_object_gives_the_surface_of_its_file_and_of_its_arrays(kind, tmp_path):
    mesh = MAKERS[kind](TRIANGLES)
    WRITERS[kind](mesh, tmp_path / "cube.ply")
    found, read = load_surface(mesh), load_surface(tmp_path / "cube.ply")
    assert np.array_equal(found.vertices, read.vertices) and np.array_equal(found.faces, read.faces)
    assert found.notices == read.notices == ()
    assert found.volume == pytest.approx(1.0) and (found.name, found.source) == ("surface", "")
    assert found.sha256 == surface_from_arrays(CUBE, TRIANGLES).sha256
    assert class_of(mesh) == kind


@pytest.mark.parametrize("kind", MAKERS)
def test_an_object_is_refused_in_the_words_of_its_file(kind, tmp_path):
    mesh = MAKERS[kind](TRIANGLES[:-1])
    WRITERS[kind](mesh, tmp_path / "open.ply")
    refusals = []
    for given, source in ((mesh, kind), (tmp_path / "open.ply", str(tmp_path / "open.ply"))):
        with pytest.raises(MeshError) as caught:
            load_surface(given)
        assert str(caught.value).startswith(f"{source}: open surface: 1 boundary loop (3 edges)")
        refusals.append(str(caught.value).removeprefix(source))
    assert refusals[0] == refusals[1]
    with pytest.raises(MeshError, match=f"^{kind}: 12 faces, more than max_faces=11"):
        load_surface(MAKERS[kind](TRIANGLES), max_faces=11)


def test_polygons_are_cut_and_tetrahedra_give_their_boundary():
    quads = load_surface(polydata(faces=QUADS))
    assert quads.notices == ("6 polygons cut into 12 triangles",) and quads.volume == pytest.approx(1.0)
    assert load_surface(polydata(faces=MIXED)).notices == ("9 polygons cut into 12 triangles",)
    strips = load_surface(polydata().strip())
    assert strips.volume == pytest.approx(1.0) and len(strips.faces) == 12
    marked = polydata()
    marked.verts, marked.lines = [1, 0], [2, 0, 1]
    assert load_surface(marked).notices == ("left out cells without area: 1 vertex, 1 line",)
    hexahedron = load_surface(meshio.Mesh(CUBE, [("hexahedron", np.array([[0, 1, 3, 2, 4, 5, 7, 6]]))]))
    assert hexahedron.volume == pytest.approx(1.0)
    solid = load_surface(meshio.Mesh(TETRAHEDRON[0], [("tetra", np.array([[0, 1, 2, 3]]))]))
    assert len(solid.faces) == 4 and solid.volume == pytest.approx(1.0 / 6.0)


def test_the_component_is_chosen_as_in_a_file():
    apart = trimesh.util.concatenate([of_trimesh(TRIANGLES), of_trimesh(TRIANGLES).apply_translation([3, 0, 0])])
    assert len(load_surface(apart).solids) == 2
    assert load_surface(apart, component=1).volume == pytest.approx(1.0)


NAN = np.where(np.arange(24).reshape(8, 3) == 4, np.nan, CUBE)


@pytest.mark.parametrize(
    ("mesh", "defect"),
    [
        (trimesh.Trimesh(NAN, TRIANGLES, process=False), "NaN or infinite coordinates, the first is vertex 1"),
        (trimesh.Trimesh(), "has no faces"),
        (polydata(NAN), "NaN or infinite"),
        (pyvista.PolyData(CUBE), "has no faces"),
        (meshio.Mesh(CUBE, [("triangle", np.array([[0, 1, 99]]))]), "vertex numbers out of range, the first is 99"),
        (meshio.Mesh(np.eye(6, 3), [("triangle6", np.arange(6)[None])]), "1 cells of type triangle6: save linear"),
        (meshio.Mesh(CUBE[:, :2], [("triangle", np.array(TRIANGLES))]), "points must have shape"),
        (meshio.Mesh(CUBE, [("triangle", np.array([["a", "b", "c"]]))]), "invalid literal"),
    ],
)
def test_broken_objects_are_refused_in_one_line(mesh, defect):
    with pytest.raises(MeshError, match=defect) as caught:
        load_surface(mesh)
    assert str(caught.value).startswith(f"{class_of(mesh)}: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize("mesh", [3, None, CUBE, pyvista.UnstructuredGrid()])
def test_any_other_object_is_a_type_error_that_names_what_is_taken(mesh):
    with pytest.raises(TypeError, match="path or one of trimesh.Trimesh, pyvista.PolyData, meshio.Mesh"):
        iga_nn.load_surface(mesh)
