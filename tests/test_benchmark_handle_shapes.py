from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh
from example_files import load

from parameterize.surface.surface import MeshError
from parameterize.surface.topology import crossing_faces

catalogue = load("benchmarks/handle_shapes")
Rods = load("benchmarks/random_bodies").Rods

QUICK = {"trefoil"} ^ {*catalogue.HANDLES, "wrench", "chain_link", "pipe_elbow", "chair", "ladder", "table", "hinge"}
QUICK |= {"ribbed_bracket", "fence", "spoked_wheel", "gear", "flange"}
NAMES = [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in catalogue.SHAPES]
MADE = {}


def solid(name):
    if name not in MADE:
        MADE[name] = trimesh.Trimesh(*catalogue.SHAPES[name].make(), process=False)
    return MADE[name]


@pytest.mark.parametrize("name", NAMES)
def test_each_surface_is_closed_in_one_piece_and_of_its_genus(name):
    mesh = solid(name)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0.0
    assert mesh.body_count == 1 and mesh.euler_number == 2 - 2 * catalogue.SHAPES[name].genus
    assert np.all(igl.is_vertex_manifold(mesh.faces)) and mesh.referenced_vertices.all()
    assert mesh.area_faces.min() > 0.0
    assert len(crossing_faces(mesh.vertices.copy(), mesh.faces.copy())) == 0


def test_the_lists_are_as_long_and_as_varied_as_they_are_to_be():
    everyday = [shape.genus for shape in catalogue.EVERYDAY.values()]
    assert len(everyday) >= 20 and min(everyday) == 1 and max(everyday) == 12
    assert len(catalogue.LIMBS) == 9
    lists = (catalogue.HANDLES, catalogue.KNOTTED, catalogue.EVERYDAY, catalogue.LIMBS)
    assert len(catalogue.SHAPES) == sum(map(len, lists))


def test_volumes_are_those_of_the_formulas():
    polygon = 12.0 * np.sin(np.pi / 12.0) * 0.45**2  # a 24-gon in a circle of radius .45
    assert solid("plate_1").volume == pytest.approx((24.0 - polygon) * 0.8, rel=1e-6)
    assert solid("plate_4").volume == pytest.approx((24.0 - 4.0 * polygon) * 0.8, rel=1e-6)
    bore = 1.3**2
    assert solid("frame").volume == pytest.approx(8.0 - 3.0 * 2.0 * bore + 2.0 * 1.3**3, rel=1e-6)
    assert solid("torus").volume == pytest.approx(2.0 * np.pi**2 * 0.35**2, rel=0.01)
    assert solid("thin_torus").volume == pytest.approx(2.0 * np.pi**2 * 0.12**2, rel=0.04)


def test_a_surface_is_written_with_every_digit(tmp_path):
    catalogue.write("frame", catalogue.SHAPES["frame"], tmp_path / "frame.obj")
    lines = (tmp_path / "frame.obj").read_text().splitlines()
    vertices, faces = catalogue.SHAPES["frame"].triangles()
    assert lines[0] == "# frame: 40 vertices, 96 faces, genus 5"
    read = [line.split()[1:] for line in lines]
    np.testing.assert_array_equal(np.array(read[1:41], dtype=float), vertices)
    np.testing.assert_array_equal(np.array(read[41:], dtype=int) - 1, faces)


def test_a_surface_that_is_not_as_it_should_be_is_refused():
    def opened():
        vertices, faces = catalogue.machined.plate_4()
        return vertices, faces[2:]

    def spindle():
        return catalogue.smooth.ring(1.3, 40, 16)  # thicker than its ring

    with pytest.raises(MeshError, match="plate_4: is no closed surface of genus 3"):
        catalogue.Shape(catalogue.machined.plate_4, 3).triangles()
    with pytest.raises(MeshError, match="opened: is no closed surface of genus 4"):
        catalogue.Shape(opened, 4).triangles()
    with pytest.raises(MeshError, match="spindle: intersects itself"):
        catalogue.Shape(spindle, 1).triangles()


def test_rods_keep_clear_of_one_another():
    rods = Rods()
    for place in ([0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0.1, 0], [1, 1, 0], [0.5, -1, 0.45], [0.5, 1, 0.45]):
        rods.add(np.array(place, dtype=float), 0.1)
    assert rods.join(0, 1) and rods.join(0, 2)
    assert not rods.join(0, 1) and not rods.join(1, 0)
    assert not rods.join(0, 3)  # at an angle of 6 degrees
    assert rods.join(1, 4) and rods.join(2, 4)  # the loop closes
    assert rods.join(5, 6)  # passes .45 above: more than 1.6 times .2
    assert [rods.degree(node) for node in range(7)] == [2, 2, 2, 0, 2, 1, 1]
    rods.nodes[3] = np.array([0.5, 0.5, 0.3])
    assert not rods.join(2, 3)
