"""Nodes of glTF: scenes, what is hidden in them, places, and instances. The box is 1 x 2 x 4."""

import numpy as np
import pytest
from gltf_files import INSTANCES, Gltf, check, read

from parameterize.surface.surface import MeshError

HALF = np.sqrt(0.5)


def with_nodes(*nodes, **document):
    """A box at the first of these nodes; all of them are roots of the scene."""
    gltf = Gltf()
    gltf.document |= {"nodes": [{"mesh": 0} | nodes[0], *nodes[1:]], "scenes": [{"nodes": list(range(len(nodes)))}]}
    gltf.document |= document
    return gltf


BODY = ((0, 0, 0), (1, 2, 4))
APART = {"mesh": 0, "translation": [50, 0, 0]}
OUTSIDE = "left out 1 node with a mesh, outside the scene"


@pytest.mark.parametrize(
    ("scenes", "x"),
    [({"scenes": [{"nodes": [0]}, {"nodes": [1]}]}, 0), ({"scene": 1, "scenes": [{}, {"nodes": [1]}]}, 50)],
)
def test_the_chosen_scene_is_read_or_the_first(scenes, x, tmp_path):
    check(read(tmp_path, with_nodes({}, APART, **scenes)), 8, (x, 0, 0), (x + 1, 2, 4), OUTSIDE)


def test_without_scenes_all_nodes_are_read(tmp_path):
    for scenes in ({"scenes": []}, {"scenes": [], "scene": 0}):
        gltf = with_nodes({}, {"children": [2]}, APART, **scenes)
        assert [read(tmp_path, gltf, component=n).volume for n in (0, 1)] == pytest.approx([8, 8])
    assert len(read(tmp_path, gltf).solids) == 2


def test_a_node_in_several_scenes_is_read_once(tmp_path):
    check(read(tmp_path, with_nodes({}, scenes=[{"nodes": [0]}, {"nodes": [0]}])), 8, *BODY)


@pytest.mark.parametrize(
    ("nodes", "more", "said"),
    [
        ([{}], {"scene": 1}, "names scene 1, it has 1"),
        ([{}], {"scene": [0, 0]}, "must be whole and not negative"),
        ([{}], {"scenes": [{"nodes": [4]}]}, "names node 4, it has 1"),
        ([{}], {"scenes": [{"nodes": [0, 0]}]}, "are no tree"),
        ([{"children": [1]}, {}], {}, "are no tree"),  # a root that has a node above it
        ([{"children": [1]}, {"children": [0]}], {"scenes": [{"nodes": [0]}]}, "are no tree"),
        ([{"children": [2]}, {"children": [2]}, {}], {"scenes": [{"nodes": [0, 1]}]}, "are no tree"),
        ([{"children": [k + 1]} for k in range(102)] + [{}], {"scenes": [{"nodes": [0]}]}, "nested more than 100 deep"),
        ([{"mesh": 1}], {}, "names mesh 1, it has 1"),
        ([{"matrix": np.diag([1.0, 1, 1, 1])[::-1].ravel().tolist()}], {}, r"the last row \(1, 0, 0, 0\)"),
        ([{"matrix": [1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1]}], {}, r"the last row \(5, 6, 7, 1\)"),
        ([{"matrix": np.eye(4).ravel().tolist(), "scale": [2, 2, 2]}], {}, "a matrix and another translation"),
        ([{"rotation": [1, 1, 1, 1]}], {}, "a quaternion of length 2, expected 1"),
        ([{"rotation": [0, 0, 0, 0]}], {}, "a quaternion of length 0, expected 1"),
    ],
)
def test_nodes_without_a_place_are_refused(nodes, more, said, tmp_path):
    with pytest.raises(MeshError, match=said):
        read(tmp_path, with_nodes(*nodes, **more))


def test_joints_in_a_circle_are_refused(tmp_path):
    gltf = Gltf().skin({"children": [2]}, {"children": [1]})
    gltf.document["scenes"][0]["nodes"] = [0]
    with pytest.raises(MeshError, match="are no tree"):
        read(tmp_path, gltf)


def test_negative_scales_and_a_matrix_beside_the_same_scale(tmp_path):
    check(read(tmp_path, with_nodes({"scale": [1, -1, 1]})), 8, (0, -2, 0), (1, 0, 4))
    check(read(tmp_path, with_nodes({"scale": [-1, -1, 1]})), 8, (-1, -2, 0), (0, 0, 4))
    both = {"scale": [-2, 1, 1], "matrix": np.diag([-2.0, 1, 1, 1]).ravel().tolist()}
    check(read(tmp_path, with_nodes(both)), 16, (-2, 0, 0), (0, 2, 4))


def test_the_rounding_of_a_rotation_is_taken_out(tmp_path):
    """A quarter turn about x, of 8 bits, whose length is 1.003: y goes to z, z to -y."""
    check(read(tmp_path, with_nodes({"rotation": [90 / 127, 0, 0, 90 / 127]})), 8, (0, -4, 0), (1, 0, 2))


def test_nodes_that_are_not_visible_are_left_out_with_those_below(tmp_path):
    unseen = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    below = {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": True}}}
    gltf = with_nodes({}, {**APART, **unseen, "children": [2]}, below, scenes=[{"nodes": [0, 1]}])
    gltf.document["extensionsRequired"] = ["KHR_node_visibility"]
    said = "left out 2 nodes with a mesh, not visible (KHR_node_visibility)"
    check(read(tmp_path, gltf), 8, *BODY, said)


def test_a_scene_where_all_is_hidden_says_so(tmp_path):
    unseen = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    with pytest.raises(MeshError, match="has no triangles; left out 1 node with a mesh, not visible"):
        read(tmp_path, with_nodes(unseen))
    with pytest.raises(MeshError, match=f"has no triangles; {OUTSIDE}: export the surface"):
        read(tmp_path, with_nodes({}, scenes=[{"nodes": []}]))


def test_a_joint_that_is_not_visible_still_moves(tmp_path):
    gltf = Gltf().skin({"scale": [2, 2, 2], "extensions": {"KHR_node_visibility": {"visible": False}}})
    check(read(tmp_path, gltf), 64, (0, 0, 0), (2, 4, 8))


@pytest.mark.parametrize(
    ("scenes", "said"),
    [([], "a coarser level of detail (MSFT_lod)"), ([{"nodes": [0]}], "outside the scene")],
)
def test_the_finest_level_is_read(scenes, said, tmp_path):
    gltf = with_nodes({"extensions": {"MSFT_lod": {"ids": [1]}}}, APART, scenes=scenes, extensionsUsed=["MSFT_lod"])
    check(read(tmp_path, gltf), 8, *BODY, f"left out 1 node with a mesh, {said}")


@pytest.mark.parametrize("listed", [{}, {"extensionsUsed": [INSTANCES]}, {"extensionsRequired": [INSTANCES]}])
def test_an_instance_is_scaled_turned_and_moved_before_its_node(listed, tmp_path):
    """A quarter turn about z: the box of 2 x 2 x 4 at x from 10 to 12 comes to x from 98 to 100, y from 10 to 12."""
    gltf = Gltf(**listed)
    gltf.node |= {"rotation": [0, 0, HALF, HALF], "translation": [100, 0, 0], "name": "part"}
    gltf.instances(TRANSLATION=gltf.array([[10.0, 0, 0]]), SCALE=gltf.array([[2.0, 1, 1]]))
    surface = read(tmp_path, gltf)
    check(surface, 16, (98, 10, 0), (100, 12, 4))
    assert len(surface.groups["part"]) == 12


@pytest.mark.parametrize(("kind", "most"), [("i1", 127), ("i2", 32767)])
def test_rotations_of_instances_may_be_normalized_integers(kind, most, tmp_path):
    gltf = Gltf()
    half = round(most * HALF)
    gltf.instances(ROTATION=gltf.array([[0, 0, half, half]], kind, normalized=True))
    check(read(tmp_path, gltf), 8, (-2, 0, 0), (0, 1, 4))


def test_there_are_as_many_bodies_as_instances_and_none_without(tmp_path):
    """Instances scaled by 1, 2 and -3 in x, each in its place; the mesh itself is not there."""
    gltf = Gltf()
    gltf.node["name"] = "part"
    gltf.instances(
        TRANSLATION=gltf.array([[10.0, 0, 0], [20, 0, 0], [40, 0, 0]]),
        SCALE=gltf.array([[1.0, 1, 1], [2, 1, 1], [-3, 1, 1]]),
        _ID=gltf.array([1, 2, 3], "u2"),
    )
    bodies = [read(tmp_path, gltf, component=n) for n in range(3)]
    assert sorted(body.bbox[0][0] for body in bodies) == pytest.approx([10, 20, 37])
    assert sum(body.volume for body in bodies) == pytest.approx(48)
    assert all(len(body.groups["part"]) == 12 for body in bodies)
    assert not any("flipped" in notice for body in bodies for notice in body.notices)


def test_a_target_is_added_to_each_instance_and_a_mirrored_one_is_the_right_way_out(tmp_path):
    gltf = Gltf().morph(np.tile([0.0, 0, 1], (8, 1)), mesh=[2.0])
    check(read(tmp_path, gltf.instances(SCALE=gltf.array([[1.0, 1, -1]]))), 8, (0, 0, -6), (1, 2, -2))


def test_instances_without_a_mesh_do_not_pass_in_silence(tmp_path):
    gltf = with_nodes({}, {"extensions": {INSTANCES: {"attributes": {}}}})
    check(read(tmp_path, gltf), 8, *BODY, "left out 1 set of instances without a mesh")


def test_instances_that_contradict_themselves_are_refused(tmp_path):
    gltf = Gltf()
    three, two = gltf.array(np.zeros((3, 3))), gltf.array(np.ones((2, 3)))
    with pytest.raises(MeshError, match=rf"the arrays of instances \({INSTANCES}\) have \[2, 3\] elements"):
        read(tmp_path, gltf.instances(TRANSLATION=three, SCALE=two))
    with pytest.raises(MeshError, match=r"have \[\] elements"):
        read(tmp_path, gltf.instances())
    with pytest.raises(MeshError, match="instances have the attribute 'SHEAR', which is not read"):
        read(tmp_path, gltf.instances(SHEAR=three))
    with pytest.raises(MeshError, match="expected VEC4"):
        read(tmp_path, gltf.instances(ROTATION=three))


def test_instances_of_a_skinned_mesh_are_refused_by_name(tmp_path):
    """Neither text says how they go together: the skin leaves out the node's place, which instances multiply."""
    gltf = Gltf().skin({})
    with pytest.raises(MeshError, match=rf"instances \({INSTANCES}\) of a skinned mesh have no meaning"):
        read(tmp_path, gltf.instances(TRANSLATION=gltf.array([[1.0, 0, 0]])))


def test_the_limit_of_faces_holds_for_all_instances_before_they_take_memory(tmp_path):
    """A million places that the file need not hold: an array of zeros but for one entry."""
    gltf = Gltf()
    places = gltf.sparse(10**6, [0], [[0, 0, 0]])
    with pytest.raises(MeshError, match="12000000 faces, more than max_faces"):
        read(tmp_path, gltf.instances(TRANSLATION=places))
    with pytest.raises(MeshError, match="24 faces, more than max_faces=12: raise --max-faces"):
        read(tmp_path, gltf.instances(TRANSLATION=gltf.array([[0.0, 0, 0], [9, 0, 0]])), max_faces=12)
