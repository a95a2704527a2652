"""glTF and archives: places of nodes, units, groups."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from mesh_files import CUBE, TRIANGLES, obj
from scene_files import glb, gltf, zipped

from parameterize.surface.surface import MeshError, load_surface


def read(folder, name, content, **options):
    path = folder / name
    path.write_bytes(content)
    return load_surface(path, **options)


def test_a_scene_of_trimesh_has_its_bodies_in_their_places(tmp_path):
    ball, box = trimesh.creation.icosphere(), trimesh.creation.box((1.0, 2.0, 3.0))
    turn = trimesh.transformations.euler_matrix(0.3, 1.2, -0.7)
    turn[:3, 3] = (4.0, -1.0, 2.0)
    scene = trimesh.Scene()
    scene.add_geometry(ball, node_name="ball")
    scene.add_geometry(box, transform=turn, node_name="box")
    content = scene.export(file_type="glb")
    surface = read(tmp_path, "scene.glb", content, component=1)
    assert surface.volume == pytest.approx(6.0, rel=1e-6) and surface.unit == "m"
    expected = trimesh.transform_points(box.vertices, turn)
    assert np.allclose(np.sort(surface.vertices, axis=0), np.sort(expected, axis=0), atol=1e-6)
    assert list(surface.groups) == ["box"] and len(surface.groups["box"]) == 12
    assert read(tmp_path, "scene.glb", content, component="largest").volume == pytest.approx(max(ball.volume, 6.0))


def test_nodes_in_nodes_and_materials_are_groups(tmp_path):
    nodes = [
        {"children": [1], "name": "part", "matrix": [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 5, 6, 7, 1]},
        {"mesh": 0, "name": "cube", "scale": [1, 2, 3], "rotation": [0.5, 0.5, 0.5, 0.5]},
    ]
    given = gltf(nodes=nodes, primitive={"material": 0}, materials=[{"name": "steel"}])
    surface = read(tmp_path, "cube.glb", glb(given))
    assert surface.volume == pytest.approx(6.0)
    # (1, 2, 3) turned twice about the diagonal: x to y, y to z, z to x
    assert np.allclose(surface.bbox, [[5, 6, 7], [7, 9, 8]])
    assert list(surface.groups) == ["part", "cube", "steel"]


@pytest.mark.parametrize(("mode", "rows"), [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])])
def test_strips_and_fans(mode, rows, tmp_path):
    """The four corners of a square, as a strip or a fan; with all other faces a cube."""
    others = [face for face in TRIANGLES.tolist() if not set(face) <= {0, 1, 2, 3}]
    text, binary = gltf(faces=[])
    first, second = np.array(rows, "<u2").tobytes(), np.array(others, "<u2").tobytes()
    corners = [
        {"componentType": 5123, "type": "SCALAR", "count": 4},
        {"componentType": 5123, "type": "SCALAR", "count": 30},
    ]
    more = {
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0}, "indices": 1, "mode": mode},
                    {"attributes": {"POSITION": 0}, "indices": 2},
                ]
            }
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            *({"bufferView": k + 1, **corner} for k, corner in enumerate(corners)),
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 8},
            {"buffer": 0, "byteOffset": 104, "byteLength": 60},
        ],
    }
    assert read(tmp_path, "cube.glb", glb((gltf(**more)[0], binary + first + second))).volume == pytest.approx(1.0)


@pytest.mark.parametrize(("named", "stored"), [("a.bin", "a.bin"), ("parts/my%20cube.bin", "parts/my cube.bin")])
def test_arrays_of_a_gltf_may_be_in_a_file_beside_it(named, stored, tmp_path):
    text, binary = gltf(beside=named)
    (tmp_path / stored).parent.mkdir(exist_ok=True)
    (tmp_path / stored).write_bytes(binary)
    assert read(tmp_path, "cube.gltf", text).volume == pytest.approx(1.0)
    packed = zipped({"deep/cube.gltf": text, f"deep/{stored}": binary})
    assert read(tmp_path, "cube.zip", packed).volume == pytest.approx(1.0)


@pytest.mark.parametrize("named", ["../a.bin", "/tmp/a.bin", "http://a.org/a.bin", "a/../../a.bin", "%2E%2E/a.bin", ""])
def test_a_gltf_reads_no_file_outside_its_folder(named, tmp_path):
    (tmp_path / "inner").mkdir()
    text, binary = gltf(beside="a.bin")
    (tmp_path / "a.bin").write_bytes(binary)
    text = text.replace(b'"a.bin"', f'"{named}"'.encode())
    with pytest.raises(MeshError, match="which is no file beside it: save it as .glb"):
        read(tmp_path / "inner", "cube.gltf", text)
    with pytest.raises(MeshError, match="which is no file beside it: save it as .glb"):
        read(tmp_path, "cube.zip", zipped({"inner/cube.gltf": text, "a.bin": binary}))


def test_a_missing_file_of_a_gltf_is_named_and_large_ones_stop_at_the_limit(tmp_path):
    with pytest.raises(MeshError, match=r"'a.bin', which is not beside it: put it there"):
        read(tmp_path, "cube.gltf", gltf(beside="a.bin")[0])
    with (tmp_path / "a.bin").open("wb") as stream:
        stream.truncate(70 << 20)  # sparse: takes no disk
    with pytest.raises(MeshError, match="take more than the limit"):
        read(tmp_path, "cube.gltf", gltf(beside="a.bin")[0], max_faces=12)


def test_an_archive_of_zeros_stops_at_the_limit(tmp_path):
    with pytest.raises(MeshError, match="unpacks to more than the limit"):
        read(tmp_path, "bomb.zip", zipped({"cube.obj": b"v 0 0 0\n" * (9 << 20)}), max_faces=4)


def test_a_packed_surface_is_the_same_surface(tmp_path):
    given = read(tmp_path, "cube.obj", obj(CUBE).encode())
    packed = read(tmp_path, "cube.zip", zipped({"deep/folder/cube.obj": obj(CUBE)}))
    assert np.array_equal(given.vertices, packed.vertices) and packed.name == "cube"
    assert given.unit == packed.unit == ""
