from __future__ import annotations

import re

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES, ball, joined, obj, text_stl

from parameterize.surface.surface import MeshError, bodies_in, load_surface, surface_from_arrays


def test_largest_is_the_one_of_most_volume():
    fine, large = ball(0.5, subdivisions=3), ball(2.0, (5, 0, 0))
    surface = surface_from_arrays(*joined(fine, large), component="largest")
    assert surface.center == pytest.approx([5, 0, 0], abs=0.05)
    (notice,) = surface.notices
    small = surface_from_arrays(*fine).volume
    told = f"component 1 taken of 2 (0: 1280 faces, 1: 320 faces); the ones left out enclose {small:.3g}, this one "
    assert notice == f"{told}{surface.volume:.3g}"


def test_what_is_inside_the_chosen_one_is_told_with_its_share():
    outer, (vertices, faces) = ball(2.0), ball(1.0)
    surface = surface_from_arrays(*joined(outer, (vertices, faces[:, ::-1])), component="largest")
    assert surface.volume == pytest.approx(surface_from_arrays(*outer).volume)
    assert "component 1, a cavity or another body, 12.50% of its volume" in surface.notices[0]


def test_a_copy_is_no_second_body():
    vertices, faces = ball()
    shuffled = np.random.default_rng(0).permutation(len(vertices))
    copy = vertices[np.argsort(shuffled)], shuffled[faces[::-1]][:, ::-1]
    surface = surface_from_arrays(*joined((vertices, faces), copy))
    assert len(surface.faces) == len(faces)
    assert surface.notices == (
        "dropped 1 component (320 faces) exactly on the faces of others: the volume is unchanged",
    )


def test_bodies_that_cross_are_named_with_a_place():
    three = joined(ball(center=(9, 0, 0)), ball(), ball(center=(1, 0, 0)))
    with pytest.raises(MeshError, match=r"components 1 and 2 cross each other at \((.*)\): unite them") as refused:
        surface_from_arrays(*three)
    place = np.array(re.search(r" at \((.*?)\)", str(refused.value))[1].split(","), dtype=float)
    for middle in ([0, 0, 0], [1, 0, 0]):
        assert np.linalg.norm(place - middle) == pytest.approx(1.0, abs=0.1)


def test_a_body_in_a_cavity_is_a_second_one():
    surface = surface_from_arrays(*joined(ball(3.0), ball(2.0), ball(1.0)))
    volumes = [surface_from_arrays(*ball(radius)).volume for radius in (3.0, 2.0, 1.0)]
    assert surface.volume == pytest.approx(volumes[0] - volumes[1] + volumes[2])
    radii = np.linalg.norm(surface.vertices[surface.faces[:, 0]], axis=1)
    assert len(surface.solids) == 2 and np.array_equal(surface.owners, np.where(radii < 1.5, 1, 0))


def test_a_body_that_fills_a_cavity_is_glued_to_its_wall():
    (vertices, faces), outer = ball(1.0), ball(2.0)
    surface = surface_from_arrays(*joined(outer, (vertices, faces[:, ::-1]), (vertices, faces)))
    assert surface.volume == pytest.approx(surface_from_arrays(*outer).volume) and surface.solids == ("", "")
    assert len(surface.walls.corners) == len(faces) and (surface.shells, len(surface.faces)) == (1, len(outer[1]))


def cube(low, size=1.0):
    return CUBE * size + low, TRIANGLES


def test_bodies_that_touch_in_equal_triangles_are_glued():
    surface = surface_from_arrays(*joined(cube((0, 0, 0)), cube((0, 0, 1))), groups={"lower": np.arange(12)})
    assert surface.volume == pytest.approx(2.0) and (surface.shells, len(surface.faces)) == (1, 20)
    assert surface.solids == ("lower", "") and np.bincount(surface.owners).tolist() == [10, 10]
    assert np.array_equal(surface.groups["solid2"], np.flatnonzero(surface.owners == 1))
    assert np.array_equal(surface.groups["lower"], np.flatnonzero(surface.owners == 0))  # group:lower is its boundary
    assert np.all(surface.walls.corners[..., 2] == 1.0) and surface.walls.solids.tolist() == [[0, 1], [0, 1]]
    assert "glued solids over an area of 1, 2 faces" in surface.notices


def test_solids_of_an_stl_that_touch_are_told_apart_by_their_names(tmp_path):
    path = tmp_path / "two.stl"
    path.write_text("".join(text_stl(*cube((0, 0, k))).replace("cube", name) for k, name in enumerate(("pad", "base"))))
    surface = load_surface(path)
    assert surface.solids == ("pad", "base") and len(surface.faces) == 20 and len(surface.walls.corners) == 2
    assert surface.summary()["solids"] == ["pad", "base"]
    assert load_surface(path, component=0).volume == pytest.approx(1.0)


def test_bodies_that_touch_in_an_edge_are_not_glued():
    surface = surface_from_arrays(*joined(cube((0, 0, 0)), cube((1, 1, 0))))
    assert surface.shells == 2 and not len(surface.walls.corners) and not len(surface.crossings)


@pytest.mark.parametrize("low", [(0.25, 0.25, 1.0), (0.25, 0.25, 0.5)])  # beside each other; one in the other
def test_bodies_that_touch_in_other_triangles_are_refused(low):
    with pytest.raises(MeshError, match="components 0 and 1 cross each other at"):
        surface_from_arrays(*joined(cube((0, 0, 0)), cube(low, 0.5)))


def test_bodies_whose_faces_fall_into_other_triangles_are_refused():
    vertices = CUBE * (-1, 1, 1) + (1, 0, 1)  # mirrored: other diagonals between the same corners
    with pytest.raises(MeshError, match="components 0 and 1 overlap, or touch in faces that do not match, at"):
        surface_from_arrays(*joined(cube((0, 0, 0)), (vertices, TRIANGLES[:, ::-1])))


def test_open_bodies_are_measured_too_and_only_the_chosen_one_is_closed():
    (vertices, faces), (far, small) = ball(2.0, subdivisions=3), ball(1.0, (5, 0, 0), 4)
    pair = joined((vertices, faces[1:]), (far, small[9:]))
    with pytest.raises(MeshError, match="2 components .*, component 0 is open: choose one with --component largest"):
        surface_from_arrays(*pair)
    surface = surface_from_arrays(*pair, component="largest", close=True)
    assert len(surface.faces) == len(faces) and surface.center == pytest.approx([0, 0, 0], abs=0.1)


def test_bodies_of_a_file(tmp_path):
    path = tmp_path / "parts.obj"
    path.write_text(obj(*joined(ball(2.0), ball(subdivisions=3), ball(0.5, (5, 0, 0), 1))))
    assert bodies_in(path) == [1, 2]  # 0 is the ball inside
    path.write_text(obj(*ball()))
    assert bodies_in(path) == [None]
