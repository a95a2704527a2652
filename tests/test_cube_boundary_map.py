"""The boundary map: faces of the cube, orientation seen from its centre, the file."""

import numpy as np
import pytest
from shapes import CORNERS

from parameterize.cube.boundary_map import BoundaryMap, read_part
from parameterize.spline.volume import FACE_NAMES


def cube_map():
    """The cube itself: two triangles a face, outward, in the order u0, u1, v0, v1, w0, w1."""
    faces = [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5],
        [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
        [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]  # fmt: skip
    return BoundaryMap(10.0 * CORNERS - 3.0, CORNERS, np.array(faces))


def test_cube_faces_and_orientation_of_the_cube():
    mapping = cube_map()
    assert mapping.cube_faces.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    assert mapping.flipped().size == 0
    for k, name in enumerate(FACE_NAMES):
        places = mapping.parameters[mapping.faces[mapping.cube_faces == k]]
        assert np.all(places[..., "uvw".index(name[0])] == float(name[1]))


def test_turned_triangles_are_flipped():
    mapping = cube_map()
    faces = mapping.faces.copy()
    faces[[3, 8]] = faces[[3, 8], ::-1]
    assert BoundaryMap(mapping.vertices, CORNERS, faces).flipped().tolist() == [3, 8]
    assert len(BoundaryMap(mapping.vertices, CORNERS, mapping.faces[:, ::-1]).flipped()) == 12


def test_vertices_of_several_blocks_say_on_which_they_lie(tmp_path):
    cube, patches = cube_map(), np.arange(8) % 3
    assert cube.patches.tolist() == [0] * 8
    several = BoundaryMap(cube.vertices, CORNERS, cube.faces, cube.faces, {"top": np.array([3])}, patches)
    several.save(tmp_path / "boundary.npz")
    again = BoundaryMap.load(tmp_path / "boundary.npz")
    assert again.patches.tolist() == patches.tolist() and again.part.group("top").tolist() == [3]
    for ask in (lambda: several.cube_faces, several.flipped):
        with pytest.raises(ValueError, match="lies on 3 blocks, and is not cut along their edges"):
            ask()
    for wrong in (patches[:7], patches - 1, patches / 2.0):
        with pytest.raises(ValueError, match="patches must have a whole number from 0 on for each of the 8 vertices"):
            BoundaryMap(cube.vertices, CORNERS, cube.faces, patches=wrong)


def test_a_file_without_blocks_lies_on_one(tmp_path):
    cube = cube_map()
    arrays = {"vertices": cube.vertices, "parameters": CORNERS, "faces": cube.faces}
    np.savez(tmp_path / "old.npz", **arrays)
    assert BoundaryMap.load(tmp_path / "old.npz").patches.tolist() == [0] * 8
    np.savez(tmp_path / "bad.npz", **arrays, patches=np.zeros(3, dtype=int))
    with pytest.raises(ValueError, match=r"bad.npz: patches must have"):
        BoundaryMap.load(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    "triangle",
    [
        [[0, 0, 0], [0, 0, 1], [0, 0, 1]],  # two corners coincide
        [[0, 0, 0], [0, 0, 0.3], [0, 0, 1]],  # on an edge of the cube
        [[1, 0.1, 0.1], [1, 0.2, 0.2], [1, 0.7, 0.7]],  # on a line inside a face
        [[1, 0.1, 0.3], [1, 0.2, 0.6], [1, 0.3, 0.9]],  # the same, but for rounding
    ],
)
def test_triangles_without_area_are_flipped(triangle):
    for order in ([0, 1, 2], [2, 1, 0]):
        assert BoundaryMap(np.zeros((3, 3)), np.array(triangle, dtype=float), np.array([order])).flipped().tolist() == [
            0
        ]


def test_thin_triangle_keeps_its_sign():
    places = np.array([[1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [1.0, 0.5, 0.5 + 1e-12]])
    assert BoundaryMap(places, places, np.array([[0, 1, 2]])).flipped().size == 0
    assert BoundaryMap(places, places, np.array([[1, 0, 2]])).flipped().tolist() == [0]


def test_triangle_across_an_edge_has_no_face():
    places = np.array([[0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.0, 0.0, 0.6]])
    with pytest.raises(ValueError, match="do not lie on one face of the cube, the first is 0"):
        _ = BoundaryMap(places, places, np.array([[0, 1, 2]])).cube_faces


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": CORNERS[:7]}, "one row for each of the 8 vertices"),
        ({"parameters": 0.5 * CORNERS + 0.25}, "8 do not, the first is vertex 0"),
        ({"parameters": 1.5 * CORNERS}, "first is vertex 1"),
        ({"parameters": CORNERS[:, :2]}, "parameters must have shape"),
        ({"vertices": np.full((8, 3), np.nan)}, "vertices must be finite"),
        ({"faces": np.array([[0, 1, 8]])}, "0 to 7, got 0 to 8"),
        ({"faces": np.array([[0, -1, 2]])}, "0 to 7, got -1 to 2"),
        ({"faces": np.array([[0.0, 1.0, 2.0]])}, "whole numbers"),
        ({"part_faces": np.array([[0, 1, 8]])}, "part_faces must number vertices 0 to 7, got 0 to 8"),
        ({"groups": {"lid": np.array([12])}}, "group 'lid' must hold face numbers from 0 to 11"),
    ],
)
def test_parts_that_do_not_fit(change, message):
    mapping = cube_map()
    parts = {"vertices": mapping.vertices, "parameters": mapping.parameters, "faces": mapping.faces} | change
    with pytest.raises(ValueError, match=message):
        BoundaryMap(**parts)


def test_save_and_load(tmp_path):
    mapping = cube_map()
    mapping.save(tmp_path / "boundary.npz")
    loaded = BoundaryMap.load(tmp_path / "boundary.npz")
    for name in ("vertices", "parameters", "faces"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(mapping, name))
    assert loaded.faces.dtype == np.int64


def test_the_surface_before_the_cuts_and_its_groups_are_saved(tmp_path):
    """The first face is cut by a vertex in the middle of its edge 0-3."""
    mapping, path = cube_map(), tmp_path / "boundary.npz"
    cut = np.concatenate([[[0, 1, 8], [8, 1, 3], [0, 8, 2], [8, 3, 2]], mapping.faces[2:]])
    vertices, parameters = (np.vstack([rows, (rows[0] + rows[3]) / 2]) for rows in (mapping.vertices, CORNERS))
    groups = {"inlet": np.array([0, 1]), "hot wall": np.array([1, 5])}
    BoundaryMap(vertices, parameters, cut, mapping.faces, groups).save(path)
    part = read_part(path)
    np.testing.assert_array_equal(part.vertices, mapping.vertices)
    np.testing.assert_array_equal(part.faces, mapping.faces)
    assert {name: numbers.tolist() for name, numbers in part.groups.items()} == {"inlet": [0, 1], "hot wall": [1, 5]}
    np.testing.assert_array_equal(BoundaryMap.load(path).faces, cut)
    with np.load(path, allow_pickle=False) as archive:
        arrays = dict(archive)
    np.savez(path, **{**arrays, "group_sizes": np.array([1, 3]), "group_faces": np.array([0, 1, 1, 99])})
    with pytest.raises(ValueError, match=r"boundary\.npz: group 'hot wall' must hold face numbers from 0 to 11"):
        read_part(path)


def test_a_file_of_an_earlier_version_gives_the_surface_as_it_was_cut(tmp_path):
    mapping, path = cube_map(), tmp_path / "boundary.npz"
    np.savez(path, vertices=mapping.vertices, parameters=mapping.parameters, faces=mapping.faces)
    part = read_part(path)
    assert part.groups == {} and part.flood(0).tolist() == [0, 1]
    np.testing.assert_array_equal(part.faces, mapping.faces)


def test_load_names_the_file_and_the_fault(tmp_path):
    path = tmp_path / "boundary.npz"
    with pytest.raises(FileNotFoundError, match=r"boundary\.npz"):
        BoundaryMap.load(path)
    np.savez(path, vertices=CORNERS, parameters=0.5 + 0.0 * CORNERS, faces=np.array([[0, 1, 2]]))
    with pytest.raises(ValueError, match=r"boundary\.npz: parameters must lie on the faces"):
        BoundaryMap.load(path)
    np.savez(path, vertices=CORNERS, parameters=np.array(["a"] * 8), faces=np.array([[0, 1, 2]]))
    with pytest.raises(ValueError, match=r"boundary\.npz"):
        BoundaryMap.load(path)
