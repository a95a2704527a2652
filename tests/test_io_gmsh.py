"""Tests iga_nn.io.gmsh against meshio, an independent reader, and against the map."""

import meshio
import numpy as np
import pytest
from meshio.gmsh.common import _meshio_to_gmsh_order
from test_io_calculix import bar

import iga_nn
from iga_nn.io.element_shapes import GMSH_SHAPES
from iga_nn.io.gmsh import write_gmsh
from solve import benchmark_volume


@pytest.fixture(scope="module")
def solution():
    """A displacement on a wavy cube, held on the left and pulled on the right."""
    body = benchmark_volume(4, amplitude=0.1)
    return iga_nn.solve(body, iga_nn.Elasticity(fix="u0", load={"u1": (1, 0, 0)}), refine=0)


@pytest.mark.parametrize("shape", GMSH_SHAPES.values(), ids=GMSH_SHAPES)
def test_functions_of_nodes_are_one_at_their_node(shape):
    ends = 2.0 * shape.nodes / shape.degree - 1.0
    assert len(np.unique(shape.nodes, axis=0)) == (shape.degree + 1) ** 3
    assert np.allclose(shape.functions(ends), np.eye(len(ends)), atol=1e-12)


@pytest.mark.parametrize(("element", "kind"), [("hex27", "hexahedron27"), ("hex64", "hexahedron64")])
def test_meshio_reads_elements_values_and_groups(solution, tmp_path, element, kind):
    body = solution.geometry
    path = tmp_path / "wavy.msh"
    elements = write_gmsh(path, body, solution.field, solution.problem, element=element)
    read = meshio.read(path)
    assert set(read.cells_dict) == {kind, {"hex27": "quad9", "hex64": "quad16"}[element]}
    assert {"fix_1", "load_2", "solid1"} <= set(read.field_data)
    _, parameters = elements.place_of_nodes
    assert np.allclose(read.points, body(parameters), atol=1e-13)
    assert np.allclose(read.point_data["u"], solution(parameters), atol=1e-13)
    shape = GMSH_SHAPES[element]
    local = np.random.default_rng(0).uniform(-1, 1, (5, 3))
    places = np.einsum(
        "mk,ekx->emx", shape.functions(local), read.points[_meshio_to_gmsh_order(kind, read.cells_dict[kind])]
    )
    share = 0.5 * (local + 1.0)
    inside = elements.low[:, None] + share * (elements.high - elements.low)[:, None]
    away = np.abs(places.reshape(-1, 3) - body(inside.reshape(-1, 3))).max()
    assert away < (1e-12 if element == "hex64" else 1e-2)


def test_solids_are_groups_and_elements_right_handed(tmp_path):
    write_gmsh(tmp_path / "bar.msh", bar(), element="hex27")
    read = meshio.read(tmp_path / "bar.msh")
    assert set(read.field_data) == {"a", "b", "rest of the boundary"}
    corners = read.points[read.cells_dict["hexahedron27"]]
    u, v, w = (corners[:, place] - corners[:, 0] for place in (1, 3, 4))
    assert (np.einsum("ex,ex->e", np.cross(u, v), w) > 0.0).all()
    quads = read.points[read.cells_dict["quad9"]]
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    assert (np.einsum("ex,ex->e", normals, quads[:, 8] - [2.0, 0.5, 0.5]) > 0.0).all()
