"""Arrays of glTF: sparse ones, types of numbers, buffers that are compressed or not there. The box is 1 x 2 x 4."""

import numpy as np
import pytest
from gltf_files import BOX, Gltf, check, read
from mesh_files import CUBE, TRIANGLES
from scene_files import glb

from parameterize.surface.surface import MeshError, load_surface

BODY = ((0, 0, 0), (1, 2, 4))
TALLER = ((0, 0, 0), (1, 2, 6))  # the four corners at the top, 4 to 7, moved
TOP = BOX[4:] + [0, 0, 2]


def positions(gltf):
    return gltf.document["accessors"][gltf.primitive["attributes"]["POSITION"]]


def entries(gltf, places, values, kind="u1"):
    return {
        "count": len(places),
        "indices": {"bufferView": gltf.view(places, kind), "componentType": {"u1": 5121, "u2": 5123, "u4": 5125}[kind]},
        "values": {"bufferView": gltf.view(values, "f4")},
    }


@pytest.mark.parametrize("kind", ["u1", "u2", "u4"])
def test_sparse_entries_replace_those_of_the_buffer_view(kind, tmp_path):
    gltf = Gltf()
    positions(gltf)["sparse"] = entries(gltf, [4, 5, 6, 7], TOP, kind)
    check(read(tmp_path, gltf), 12, *TALLER)


def test_without_a_buffer_view_all_others_are_zero(tmp_path):
    gltf = Gltf()
    gltf.primitive["attributes"]["POSITION"] = gltf.sparse(8, range(1, 8), BOX[1:])
    check(read(tmp_path, gltf), 8, *BODY)


def test_sparse_entries_of_vertices_that_no_face_uses_move_no_others(tmp_path):
    """Vertices 2 and 9 are used by no face; both, and the four at the top, have sparse entries."""
    faces = np.where(TRIANGLES >= 2, TRIANGLES + 1, TRIANGLES)
    gltf = Gltf(vertices=np.insert(BOX, [2, 8], [7.0, 7, 7], axis=0), faces=faces)
    positions(gltf)["sparse"] = entries(gltf, [2, 5, 6, 7, 8, 9], [[9.0, 9, 9], *TOP, [9, 9, 9]])
    check(read(tmp_path, gltf), 12, *TALLER)


def test_indices_may_be_sparse_and_vertices_unused(tmp_path):
    """The first triangle, which the base repeats, is put right; vertex 8 is used by no face."""
    gltf = Gltf(vertices=np.vstack([BOX, [9, 9, 9]]), faces=[TRIANGLES[0], *TRIANGLES[:1], *TRIANGLES[2:]])
    values = gltf.view(TRIANGLES[1], "u2")
    gltf.document["accessors"][gltf.primitive["indices"]]["sparse"] = {
        "count": 3,
        "indices": {"bufferView": gltf.view([3, 4, 5], "u1"), "componentType": 5121},
        "values": {"bufferView": values},
    }
    check(read(tmp_path, gltf), 8, *BODY)


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ([4, 6, 5, 7], "must increase and stay below 8"),
        ([4, 5, 5, 7], "must increase and stay below 8"),
        ([4, 5, 6, 8], "must increase and stay below 8"),
        ([], "0 sparse entries of a glTF accessor of 8 elements"),
        (range(9), "9 sparse entries of a glTF accessor of 8 elements"),
    ],
)
def test_sparse_entries_at_no_place_are_refused(places, said, tmp_path):
    gltf = Gltf()
    positions(gltf)["sparse"] = entries(gltf, places, np.ones((len(places), 3)))
    with pytest.raises(MeshError, match=said):
        read(tmp_path, gltf)


def test_sparse_entries_beyond_their_bytes_or_of_other_numbers_are_refused(tmp_path):
    gltf = Gltf()
    positions(gltf)["sparse"] = entries(gltf, [4, 5], TOP[:1])
    positions(gltf)["sparse"]["values"]["byteOffset"] = 10**6
    with pytest.raises(MeshError, match="reaches beyond its"):
        read(tmp_path, gltf)
    positions(gltf)["sparse"] = entries(gltf, [4, 5], TOP[:2], "u4")
    positions(gltf)["sparse"]["indices"]["componentType"] = 5126
    with pytest.raises(MeshError, match="indices of a sparse glTF accessor are no whole numbers"):
        read(tmp_path, gltf)


@pytest.mark.parametrize(
    ("kind", "scale", "normalized"),
    [
        ("i1", 127, True),
        ("u1", 255, True),
        ("i2", 32767, True),
        ("u2", 65535, True),
        ("i1", 1, False),
        ("u2", 1, False),
    ],
)
def test_positions_may_be_quantized(kind, scale, normalized, tmp_path):
    gltf = Gltf(position=kind, vertices=CUBE * scale, extensionsRequired=["KHR_mesh_quantization"])
    positions(gltf)["normalized"] = normalized
    gltf.node["scale"] = [1, 2, 4]
    check(read(tmp_path, gltf), 8, *BODY)


def test_the_least_signed_integer_is_no_less_than_minus_one(tmp_path):
    gltf = Gltf(position="i1", vertices=np.where(CUBE > 0, 127, -128))
    positions(gltf)["normalized"] = True
    check(read(tmp_path, gltf), 8, (-1, -1, -1), (1, 1, 1))


def test_positions_may_have_double_precision(tmp_path):
    gltf = Gltf(position="f8", vertices=BOX + 1e9, extensionsRequired=["KHR_accessor_float64"])
    lowest, highest = read(tmp_path, gltf).bbox
    assert np.array_equal(highest - lowest, [1, 2, 4])


def test_least_and_largest_values_that_a_file_claims_move_nothing(tmp_path):
    gltf = Gltf()
    positions(gltf).update(min=[7, 7, 7], max=[-7, 70, 7])
    check(read(tmp_path, gltf), 8, *BODY)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"componentType": 5124}, "the unknown componentType 5124"),
        ({"type": "VEC2"}, "holds 'VEC2', expected VEC3"),
        ({"count": 0}, "an array of the glTF has no elements"),
        ({"count": 10**15}, "reaches beyond its"),
        ({"bufferView": 9}, "names buffer view 9, it has 2"),
    ],
)
def test_arrays_that_are_not_there_are_refused(change, said, tmp_path):
    gltf = Gltf()
    positions(gltf).update(change)
    with pytest.raises(MeshError, match=said):
        read(tmp_path, gltf)


@pytest.mark.parametrize(("kind", "more"), [("f4", {}), ("i2", {}), ("u2", {"normalized": True})])
def test_corners_that_are_no_unsigned_whole_numbers_are_refused(kind, more, tmp_path):
    gltf = Gltf()
    gltf.primitive["indices"] = gltf.array(TRIANGLES.ravel(), kind, **more)
    with pytest.raises(MeshError, match="vertices or joints of the glTF are no unsigned whole numbers"):
        read(tmp_path, gltf)


def test_the_limit_of_faces_holds_before_corners_take_memory(tmp_path):
    gltf = Gltf()
    corners = {"componentType": 5125, "type": "SCALAR", "count": 3 * 10**12}
    gltf.primitive["indices"] = gltf.accessor(**corners)  # all zero, without a byte in the file
    with pytest.raises(MeshError, match="1000000000000 faces, more than max_faces"):
        read(tmp_path, gltf)


def test_vertices_that_no_face_uses_take_no_memory(tmp_path):
    gltf = Gltf()
    gltf.primitive["attributes"]["POSITION"] = gltf.sparse(10**15, range(1, 8), BOX[1:])
    check(read(tmp_path, gltf), 8, *BODY)


DRACO, MESHOPT = "KHR_draco_mesh_compression", "EXT_meshopt_compression"


def read_beside(name):
    return f"read the plain arrays beside those that {name} compresses"


def draco(gltf):
    gltf.primitive["extensions"] = {DRACO: {"bufferView": gltf.view([0], "u1"), "attributes": {"POSITION": 0}}}
    gltf.document["extensionsUsed"] = [DRACO]
    return gltf


def test_plain_arrays_beside_draco_are_read(tmp_path):
    check(read(tmp_path, draco(Gltf())), 8, *BODY, read_beside(DRACO))


@pytest.mark.parametrize("array", ["POSITION", "indices"])
def test_draco_without_plain_arrays_is_refused(array, tmp_path):
    gltf = draco(Gltf())
    number = gltf.primitive["indices"] if array == "indices" else gltf.primitive["attributes"][array]
    del gltf.document["accessors"][number]["bufferView"]
    with pytest.raises(MeshError, match=f"compressed by {DRACO}, which is not read: save it without compression"):
        read(tmp_path, gltf)


@pytest.mark.parametrize("name", [DRACO, MESHOPT, "KHR_meshopt_compression"])
def test_compression_that_is_required_is_refused(name, tmp_path):
    gltf = draco(Gltf()) if name == DRACO else Gltf()
    gltf.document["extensionsRequired"] = [name]
    with pytest.raises(MeshError, match=f"compressed by {name}, which is not read: save it without compression"):
        read(tmp_path, gltf)


def meshopt(gltf, buffer=0):
    """The positions compressed by meshopt; the plain ones are in that buffer, from its first byte."""
    view = gltf.document["bufferViews"][0]
    view |= {"buffer": buffer, "extensions": {MESHOPT: {"buffer": 0, "byteOffset": 0, "byteLength": 9, "count": 8}}}
    gltf.document["extensionsUsed"] = [MESHOPT]
    return gltf


def test_plain_arrays_beside_meshopt_are_read(tmp_path):
    check(read(tmp_path, meshopt(Gltf())), 8, *BODY, read_beside(MESHOPT))
    (tmp_path / "plain.bin").write_bytes(BOX.astype("<f4").tobytes())
    fallback = {"byteLength": 96, "uri": "plain.bin", "extensions": {MESHOPT: {"fallback": True}}}
    check(read(tmp_path, meshopt(Gltf(buffers=[fallback]), 1)), 8, *BODY, read_beside(MESHOPT))


def test_a_buffer_without_bytes_is_not_taken_for_that_of_a_glb(tmp_path):
    """The chunk of a .glb is the first buffer alone; here it begins with the positions."""
    path = tmp_path / "box.glb"
    path.write_bytes(glb(meshopt(Gltf()).pieces()))
    assert load_surface(path).volume == pytest.approx(8)
    fallback = {"byteLength": 96, "extensions": {MESHOPT: {"fallback": True}}}
    path.write_bytes(glb(meshopt(Gltf(buffers=[fallback]), 1).pieces()))
    with pytest.raises(MeshError, match=f"compressed by {MESHOPT}, which is not read"):
        load_surface(path)
    gltf = Gltf(buffers=[{"byteLength": 96}])
    gltf.document["bufferViews"][0]["buffer"] = 1
    path.write_bytes(glb(gltf.pieces()))
    with pytest.raises(MeshError, match="buffer 1 of the glTF has no bytes"):
        load_surface(path)
