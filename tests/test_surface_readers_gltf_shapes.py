"""Morph targets and skins of glTF: volumes and places of a box of 1 x 2 x 4, by hand."""

import numpy as np
import pytest
from gltf_files import BOX, Gltf, check, read

from parameterize.surface.surface import MeshError

TALLER, WIDER = BOX * [0, 0, 1], BOX * [1, 0, 0]  # displacements that double a length


def test_the_weights_of_the_mesh_are_the_default(tmp_path):
    check(read(tmp_path, Gltf().morph(TALLER, mesh=[1.0])), 16, (0, 0, 0), (1, 2, 8))
    check(read(tmp_path, Gltf().morph(TALLER, mesh=[-0.5])), 4, (0, 0, 0), (1, 2, 2))
    check(read(tmp_path, Gltf().morph(TALLER)), 8, (0, 0, 0), (1, 2, 4))


def test_the_weights_of_a_node_override_those_of_the_mesh(tmp_path):
    check(read(tmp_path, Gltf().morph(TALLER, mesh=[1.0], node=[0.0])), 8, (0, 0, 0), (1, 2, 4))
    check(read(tmp_path, Gltf().morph(TALLER, node=[0.5])), 12, (0, 0, 0), (1, 2, 6))


def test_targets_add_up_before_the_place_of_the_node_is_applied(tmp_path):
    gltf = Gltf().morph(TALLER, WIDER, mesh=[0.5, 2.0])
    gltf.node |= {"translation": [0, 0, 10], "scale": [-1, 1, 1]}
    check(read(tmp_path, gltf), 8 * 1.5 * 3, (-3, 0, 10), (0, 2, 16))


def test_two_nodes_have_the_same_mesh_with_weights_of_their_own(tmp_path):
    gltf = Gltf().morph(TALLER, mesh=[1.0])
    gltf.document["nodes"].append({"mesh": 0, "weights": [0.25], "translation": [5, 0, 0]})
    gltf.document["scenes"][0]["nodes"] = [0, 1]
    assert read(tmp_path, gltf, component=0).volume + read(tmp_path, gltf, component=1).volume == pytest.approx(26)


def test_a_target_may_be_sparse_quantized_or_without_positions(tmp_path):
    gltf = Gltf().morph(mesh=[1.0, 0.5, 7.0])
    top = gltf.sparse(8, [4, 5, 6, 7], [[0, 0, 4]] * 4)
    eighth = gltf.array(np.round(WIDER * 127), "i1", normalized=True)
    gltf.primitive["targets"] = [{"POSITION": top}, {"POSITION": eighth}, {}]
    check(read(tmp_path, gltf), 1.5 * 2 * 8, (0, 0, 0), (1.5, 2, 8))


@pytest.mark.parametrize(
    ("mesh", "node", "said"),
    [([1.0, 1.0], None, "2 weights for 1 morph targets"), ([1.0], [], "0 weights for 1 morph"), (None, [1, 0], "2 w")],
)
def test_a_wrong_number_of_weights_is_refused(mesh, node, said, tmp_path):
    with pytest.raises(MeshError, match=said):
        read(tmp_path, Gltf().morph(TALLER, mesh=mesh, node=node))


def test_weights_without_targets_and_targets_of_other_vertices_are_refused(tmp_path):
    with pytest.raises(MeshError, match="1 weights for 0 morph targets of the glTF: export it again"):
        read(tmp_path, Gltf().morph(mesh=[1.0]))
    with pytest.raises(MeshError, match="a morph target of the glTF has 7 elements, expected 8"):
        read(tmp_path, Gltf().morph(TALLER[:7], mesh=[1.0]))


def test_a_skin_puts_its_mesh_where_the_joint_is_and_not_where_the_node_is(tmp_path):
    gltf = Gltf().skin({"scale": [2, 2, 2], "translation": [0, 0, 7]})
    gltf.node |= {"scale": [100, 100, -100], "translation": [5, 5, 5], "name": "part"}
    surface = read(tmp_path, gltf)
    check(surface, 64, (0, 0, 7), (2, 4, 15))
    assert list(surface.groups) == ["part"]


def test_a_joint_has_the_place_of_the_nodes_above_it(tmp_path):
    gltf = Gltf().skin({"scale": [1, 1, 3]})
    gltf.document["nodes"].append({"children": [1], "translation": [1, 1, 1]})
    gltf.document["scenes"][0]["nodes"] = [0, 2]
    check(read(tmp_path, gltf), 24, (1, 1, 1), (2, 3, 13))


def test_inverse_bind_matrices_come_before_the_joints(tmp_path):
    halved = np.diag([0.5, 0.5, 0.5, 1.0])
    halved[0, 3] = 1.0
    gltf = Gltf().skin({"scale": [4, 1, 1]}, inverse=[halved, np.full((4, 4), np.nan)])  # one more than joints
    check(read(tmp_path, gltf), 4, (4, 0, 0), (6, 1, 2))


def test_vertices_follow_the_mean_of_their_joints(tmp_path):
    places = np.tile([0, 1, 0, 0], (8, 1))
    weights = np.where(BOX[:, 2:] > 0, [0.25, 0.75, 0, 0], [1.0, 0, 0, 0])  # the top by both, the bottom by the first
    gltf = Gltf().skin({}, {"translation": [0, 0, 8]}, places=places, weights=weights)
    check(read(tmp_path, gltf), 20, (0, 0, 0), (1, 2, 10))


@pytest.mark.parametrize(("kind", "most"), [("u1", 255), ("u2", 65535)])
def test_weights_may_be_normalized_integers_and_joints_of_two_bytes(kind, most, tmp_path):
    low, top = [most, 0, 0, 0], [most // 5, most - most // 5, 0, 0]  # a fifth exactly
    weights = np.where(BOX[:, 2:] > 0, top, low)
    gltf = Gltf().skin(
        {}, {"translation": [0, 0, 10]}, places=[[0, 1, 0, 0]] * 8, weights=weights, kinds=("u2", kind), normalized=True
    )
    check(read(tmp_path, gltf), 24, (0, 0, 0), (1, 2, 12))


def test_a_second_set_of_joints_counts(tmp_path):
    gltf = Gltf().skin({}, {"translation": [0, 6, 0]}, weights=np.tile([0.5, 0, 0, 0], (8, 1)))
    gltf.primitive["attributes"] |= {
        "JOINTS_1": gltf.array([[1, 0, 0, 0]] * 8, "u1"),
        "WEIGHTS_1": gltf.array([[0.5, 0, 0, 0]] * 8),
    }
    check(read(tmp_path, gltf), 8, (0, 3, 0), (1, 5, 4))


def test_a_mirrored_joint_leaves_the_body_the_right_way_out(tmp_path):
    check(read(tmp_path, Gltf().skin({"scale": [1, 1, -1]})), 8, (0, 0, -4), (1, 2, 0))


def test_weights_that_are_rounded_make_the_body_no_smaller(tmp_path):
    gltf = Gltf().skin({"translation": [50, 0, 0]}, weights=np.tile([0.995, 0, 0, 0], (8, 1)))
    check(read(tmp_path, gltf), 8, (50, 0, 0), (51, 2, 4))


def test_a_target_is_added_before_a_skin(tmp_path):
    check(read(tmp_path, Gltf().morph(TALLER, mesh=[1.0]).skin({"scale": [1, 1, 2]})), 32, (0, 0, 0), (1, 2, 16))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"weights": np.tile([0.5, 0, 0, 0], (8, 1))}, "weights of vertex 0 of a skin sum to 0.5, expected 1"),
        ({"weights": np.zeros((8, 4))}, "sum to 0, expected 1"),
        ({"weights": np.full((8, 4), np.nan)}, "sum to nan, expected 1"),
        ({"weights": np.tile([1.5, -0.5, 0, 0], (8, 1))}, "WEIGHTS_0 of the glTF has negative weights"),
        ({"places": np.tile([0, 1, 0, 0], (8, 1))}, "JOINTS_0 of the glTF names joint 1, its skin has 1"),
        ({"places": np.zeros((8, 4)), "kinds": ("f4", "f4")}, "joints of the glTF are no unsigned whole numbers"),
        ({"inverse": np.empty((0, 4, 4))}, "an array of the glTF has no elements"),
        ({"inverse": [np.eye(4) + np.eye(4, k=-3)]}, r"the last row \(1, 0, 0, 1\), expected \(0, 0, 0, 1\)"),
    ],
)
def test_a_skin_that_puts_vertices_nowhere_is_refused(more, said, tmp_path):
    with pytest.raises(MeshError, match=said):
        read(tmp_path, Gltf().skin({}, **more))


def test_a_skin_needs_its_arrays_and_its_joints(tmp_path):
    gltf = Gltf().skin({}, {}, inverse=[np.eye(4)])
    with pytest.raises(MeshError, match="a skin of the glTF has 1 matrices for 2 joints"):
        read(tmp_path, gltf)
    gltf = Gltf().skin({})
    gltf.document["skins"][0]["joints"] = [9]
    with pytest.raises(MeshError, match="names node 9, it has 2"):
        read(tmp_path, gltf)
    gltf = Gltf().skin({})
    del gltf.primitive["attributes"]["WEIGHTS_0"]
    with pytest.raises(MeshError, match="needs JOINTS_0 and WEIGHTS_0"):
        read(tmp_path, gltf)
    gltf = Gltf().skin({})
    gltf.primitive["attributes"]["WEIGHTS_0"] = gltf.array(np.ones((7, 4)))
    with pytest.raises(MeshError, match="WEIGHTS_0 of the glTF has 7 elements, expected 8"):
        read(tmp_path, gltf)


def test_joints_of_a_mesh_without_a_skin_do_nothing(tmp_path):
    gltf = Gltf().skin({"scale": [2, 2, 2]})
    del gltf.node["skin"]
    check(read(tmp_path, gltf), 8, (0, 0, 0), (1, 2, 4))
