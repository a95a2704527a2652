from __future__ import annotations

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES, ball, joined

from parameterize.surface.errors import MeshError
from parameterize.surface.surface import surface_from_arrays


def cubes(*places):
    """Cubes whose vertices in the same place are one."""
    vertices, faces = joined(*((CUBE + place, TRIANGLES) for place in places))
    corners, numbers = np.unique(vertices, axis=0, return_inverse=True)
    return corners, numbers.ravel()[faces]


@pytest.mark.parametrize("copies", [1, 2])
@pytest.mark.parametrize("turned", [False, True])
def test_of_doubled_faces_one_is_kept_where_it_closes_the_surface(copies, turned):
    vertices, faces = ball()
    more = np.tile(faces[10:50, ::-1] if turned else faces[10:50], (copies, 1))
    surface = surface_from_arrays(vertices, np.concatenate([more, faces]))
    assert len(surface.faces) == len(faces)
    assert surface.volume == pytest.approx(surface_from_arrays(vertices, faces).volume)
    assert any(f"dropped {40 * copies} doubled faces" in line for line in surface.notices)


def test_a_wall_between_two_rooms_is_dropped_and_the_groups_stay_with_their_faces():
    vertices, faces = cubes((0, 0, 0), (0, 0, 1))
    surface = surface_from_arrays(vertices, faces, groups={"first": np.arange(12), "second": np.arange(12, 24)})
    assert surface.volume == pytest.approx(2.0) and len(surface.faces) == 20
    assert {name: len(numbers) for name, numbers in surface.groups.items()} == {"first": 10, "second": 10}
    assert surface.notices[0].startswith("dropped 4 faces that lie exactly on each other")
    assert "area 1)" in surface.notices[0]


def test_two_triangles_on_each_other_are_dropped():
    vertices, faces = ball()
    pillow = (5.0 * np.eye(3), np.array([[0, 1, 2], [0, 2, 1]]))
    assert len(surface_from_arrays(*joined((vertices, faces), pillow)).faces) == len(faces)


def test_faces_that_only_lie_on_each_other_enclose_nothing():
    with pytest.raises(MeshError, match="encloses no volume"):
        surface_from_arrays(CUBE[:4], [[0, 2, 3], [0, 3, 1], [0, 3, 2], [0, 1, 3]])


@pytest.mark.parametrize("inward", [False, True])
def test_bodies_that_touch_along_an_edge_are_parted(inward):
    vertices, faces = cubes((0, 0, 0), (1, 1, 0))
    for number in (0, 1):
        surface = surface_from_arrays(vertices, faces[:, ::-1] if inward else faces, component=number)
        assert surface.volume == pytest.approx(1.0) and len(surface.vertices) == 8
        assert surface.notices[0].startswith("split 2 vertices and 1 edge where sheets touch, the first at (1, 1, 0)")


def test_one_body_that_touches_itself_along_an_edge_stays_one():
    """Five cubes around an edge of two spans: the last two meet it from opposite sides."""
    vertices, faces = cubes((0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (1, 1, 0))
    surface = surface_from_arrays(vertices, faces)
    assert surface.volume == pytest.approx(5.0)
    assert len(surface.vertices) == len(surface.faces) // 2 + 2  # a sphere
    assert any(line.startswith("split ") for line in surface.notices)


def test_where_the_faces_enclose_no_material_by_turns_the_edge_is_refused():
    wall = np.concatenate([TRIANGLES, [[0, 1, 7], [0, 7, 6]]])  # inside, from one edge to the opposite one
    with pytest.raises(MeshError, match="4 non-manifold edges"):
        surface_from_arrays(CUBE, wall)
