"""Scenes of glTF: extensions, animations, primitives of one mesh. The box is 1 x 2 x 4."""

import numpy as np
import pytest
from gltf_files import BOX, Gltf, check, read
from mesh_files import TRIANGLES

from parameterize.surface.readers.gltf_extensions import COMPRESSED, KNOWN, READ
from parameterize.surface.surface import MeshError

BODY = ((0, 0, 0), (1, 2, 4))


@pytest.mark.parametrize("name", ["EXT_made_up", "AGI_articulations", "KHR_techniques_webgl", "two\nlines"])
def test_an_extension_that_is_not_read_is_refused_where_the_file_requires_it_else_named(name, tmp_path):
    gltf = Gltf(extensionsUsed=["KHR_materials_unlit", name, name], extensionsRequired=["KHR_materials_unlit", name])
    with pytest.raises(MeshError) as error:
        read(tmp_path, gltf)
    assert f"requires the extension {name!r}, which is not read" in str(error.value) and "\n" not in str(error.value)
    del gltf.document["extensionsRequired"]
    said = f"left out the extension {name!r}, which the file uses and does not require"
    check(read(tmp_path, gltf), 8, *BODY, said)


def test_extensions_that_move_nothing_are_accepted(tmp_path):
    assert set(READ) < KNOWN and KNOWN.isdisjoint(COMPRESSED)
    check(read(tmp_path, Gltf(extensionsUsed=sorted(KNOWN), extensionsRequired=sorted(KNOWN))), 8, *BODY)


def test_animations_are_left_out_with_a_notice(tmp_path):
    """They would scale the node by 9, and set the weight of its morph target to 9."""
    gltf = Gltf().morph(BOX, mesh=[0.5])
    times, sizes, weights = gltf.array([0.0]), gltf.array([[9.0, 9, 9]]), gltf.array([9.0])
    gltf.document["animations"] = [
        {
            "samplers": [{"input": times, "output": sizes}, {"input": times, "output": weights}],
            "channels": [
                {"sampler": 0, "target": {"node": 0, "path": "scale"}},
                {"sampler": 1, "target": {"node": 0, "path": "weights"}},
            ],
        }
    ]
    surface = read(tmp_path, gltf)
    check(surface, 27, (0, 0, 0), (1.5, 3, 6), "left out 1 animation: the scene is read at rest")


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("asset", {"version": "1.0"}, "glTF version 1.0 is not supported: save it as 2.0"),
        ("asset", "2.0", "a part of its description is not what the format says"),
        ("meshes", [{}], "its description lacks 'primitives'"),
        ("nodes", [{"mesh": 0, "matrix": "none"}], "a part of its description is not what the format says"),
        ("nodes", [0], "a part of its description is not what the format says"),
    ],
)
def test_a_description_that_is_not_as_the_format_says_is_refused_in_its_words(key, value, said, tmp_path):
    gltf = Gltf()
    gltf.document[key] = value
    with pytest.raises(MeshError, match=said) as error:
        read(tmp_path, gltf)
    assert "Error" not in str(error.value) and "object" not in str(error.value)


def test_two_primitives_share_vertices(tmp_path):
    gltf = Gltf(faces=TRIANGLES[:5])
    rest = gltf.array(TRIANGLES[5:].ravel(), "u1")
    gltf.mesh["primitives"].append({**gltf.primitive, "indices": rest, "material": 1})
    gltf.document["materials"] = [{}, {"name": "steel"}]
    surface = read(tmp_path, gltf)
    assert surface.volume == pytest.approx(8) and len(surface.groups["steel"]) == 7


def test_primitives_without_indices_take_their_vertices_in_order(tmp_path):
    gltf = Gltf(vertices=BOX[TRIANGLES.ravel()])
    del gltf.primitive["indices"]
    assert read(tmp_path, gltf).volume == pytest.approx(8)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"attributes": {}}, "left out 1 primitive without positions"),
        ({"mode": 1}, "left out 1 line"),
        ({"mode": 3, "extensions": {"KHR_draco_mesh_compression": {}}}, "left out 1 line strip"),
    ],
)
def test_primitives_without_triangles_are_left_out(more, said, tmp_path):
    gltf = Gltf()
    gltf.mesh["primitives"].append({**gltf.primitive, **more})
    check(read(tmp_path, gltf), 8, *BODY, said)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"mode": 7}, "make no triangles in mode 7"),
        ({"mode": "4"}, "make no triangles in mode '4'"),
        ({"material": 0}, "names material 0, it has 0"),
        ({"indices": 5}, "names accessor 5, it has 2"),
        ({"indices": -1}, "must be whole and not negative, got -1"),
    ],
)
def test_primitives_that_make_no_sense_are_refused(change, said, tmp_path):
    gltf = Gltf()
    gltf.primitive |= change
    with pytest.raises(MeshError, match=said):
        read(tmp_path, gltf)


def test_a_strip_that_is_mirrored_is_the_right_way_out(tmp_path):
    """Two triangles a quadrangle, as strips of one primitive each; the box is scaled by -1."""
    quads = [[0, 2, 1, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 6, 3, 7], [0, 4, 2, 6], [1, 3, 5, 7]]
    gltf = Gltf()
    gltf.mesh["primitives"] = [{**gltf.primitive, "indices": gltf.array(quad, "u2"), "mode": 5} for quad in quads]
    gltf.node["scale"] = [-1, -1, -1]
    surface = read(tmp_path, gltf)
    assert surface.volume == pytest.approx(8) and np.allclose(surface.bbox[0], [-1, -2, -4])
    assert not any("flipped" in notice for notice in surface.notices)
