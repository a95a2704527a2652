"""The part by which faces are named: nearest triangles against a search of all, floods of bodies known by hand."""

import time

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection
from mesh_files import CUBE, TRIANGLES
from plane_bodies import arrays
from shapes import ball

from iga_nn.samples import sample
from parameterize.surface.part import PartSurface
from parameterize.surface.surface import surface_from_arrays


def of(mesh, groups=None):
    return PartSurface(np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64), groups or {})


def cube():
    return PartSurface(CUBE, TRIANGLES, {})


def test_a_missing_group_lists_those_that_exist():
    part = PartSurface(CUBE, TRIANGLES, {"inlet": np.array([0, 1]), "wall": np.array([2])})
    assert part.group("inlet").tolist() == [0, 1] and part.area(part.group("wall")) == 0.5
    with pytest.raises(ValueError, match=r"^group 'lid' does not exist; the mesh has these groups: inlet, wall$"):
        part.group("lid")
    with pytest.raises(ValueError, match=r"these groups: none$"):
        cube().group("lid")


def test_nearest_is_that_of_a_search_of_all_triangles():
    vertices, faces = ball(300)
    part = PartSurface(vertices, faces, {})
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (400, 3))
    corners = vertices[faces]
    closest = trimesh.triangles.closest_point(np.tile(corners, (400, 1, 1)), np.repeat(points, len(faces), axis=0))
    distance = np.linalg.norm(closest.reshape(400, -1, 3) - points[:, None], axis=2)
    found = part.nearest(points)
    assert distance[np.arange(400), found] == pytest.approx(distance.min(axis=1), rel=1e-12)
    aligned = part.nearest(points, points)
    assert distance[np.arange(400), aligned] == pytest.approx(distance.min(axis=1), abs=1e-5)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [0, 1])
def test_on_an_edge_and_at_a_corner_the_normal_decides(axis, side):
    normal = np.zeros(3)
    normal[axis] = 2.0 * side - 1.0
    places = CUBE[CUBE[:, axis] == side]
    edges = (places[[0, 1, 2, 3]] + places[[1, 3, 0, 2]]) / 2.0
    points = np.concatenate([places, edges, edges + 1e-8, places + 0.2 * (places - 0.5)])
    found = cube().nearest(points, np.tile(normal, (len(points), 1)))
    assert np.all(CUBE[TRIANGLES[found]][:, :, axis] == side)


@pytest.mark.parametrize("moved", [-1e-15, 0.0, 1e-15])
def test_on_an_edge_without_a_normal_the_lowest_number_decides(moved):
    points = np.array([[1.0 + moved, 0.25, 1.0 - moved], [1.0, 1.0 - moved, 1.0], [1.0 - moved, 1.0 + moved, 0.5]])
    assert cube().nearest(points).tolist() == [2, 2, 7]


def test_a_nearer_triangle_wins_over_a_better_normal():
    found = cube().nearest([[0.5, 0.5, 0.9], [0.9, 0.5, 0.95]], [[1.0, 0.0, 0.0]] * 2)
    assert np.all(CUBE[TRIANGLES[found]][:, :, 2] == 1.0)


def test_a_round_wall_off_its_flat_triangles_ends_at_the_rim():
    """A bore of twelve sides; its circle lies deeper in the solid than the top is away."""
    bore = CrossSection.circle(2.0, 48) - CrossSection.circle(1.0, 12)
    vertices, faces = arrays(bore.extrude(1.0))
    part = surface_from_arrays(vertices, faces).part
    angles = (np.arange(12) + 0.5) * np.pi / 6.0
    outward = np.stack([np.cos(angles), np.sin(angles), np.zeros(12)], axis=1)
    points = outward + [0.0, 0.0, 0.99]
    assert np.all(part.normals[part.nearest(points)][:, 2] > 0.9)  # the top is nearer
    assert np.all(np.sum(part.normals[part.nearest(points, -outward)] * outward, axis=1) < -0.9)
    assert np.all(part.normals[part.nearest(points, [[0.0, 0.0, 1.0]] * 12)][:, 2] > 0.9)


def test_no_points_have_no_triangles():
    assert cube().nearest(np.empty((0, 3)), np.empty((0, 3))).shape == (0,)


def test_many_points_of_a_large_mesh_take_seconds():
    mesh = trimesh.creation.icosphere(subdivisions=6)  # 81920 triangles
    part = of(mesh)
    points = np.random.default_rng(0).normal(size=(200_000, 3))
    points *= np.random.default_rng(1).uniform(0.97, 1.03, (200_000, 1)) / np.linalg.norm(points, axis=1, keepdims=True)
    part.nearest(points[:10], points[:10])  # compiles
    start = time.perf_counter()
    part.nearest(points, points)
    assert time.perf_counter() - start < 20.0


def test_a_flood_of_a_cube_is_a_side_or_all():
    for triangle in range(12):
        assert cube().flood(triangle).tolist() == [triangle // 2 * 2, triangle // 2 * 2 + 1]
    assert len(cube().flood(0, angle=91.0)) == 12 and len(cube().flood(0, angle=89.0)) == 2
    with pytest.raises(ValueError, match="triangle must lie between 0 and 11, got 12"):
        cube().flood(12)


def test_a_flood_of_a_cylinder_is_its_round_or_an_end():
    part = of(trimesh.creation.cylinder(radius=2.0, height=3.0, sections=36))  # bends by 10 degrees
    side = part.flood(int(part.nearest([[2.0, 0.0, 0.1]])[0]))
    assert part.area(side) == pytest.approx(36 * 4.0 * np.sin(np.pi / 36) * 3.0)
    lid = part.flood(int(part.nearest([[0.3, 0.2, 1.5]])[0]))
    assert part.area(lid) == pytest.approx(18 * 4.0 * np.sin(np.pi / 18))
    assert len(part.flood(int(side[0]), angle=9.0)) == 2


def test_a_sliver_neither_stops_a_flood_nor_leads_it_around_an_edge():
    """The top's triangle 2 is divided by a point that rounding has put beside the edge of the top."""
    vertices = np.vstack([CUBE, [0.5, 1e-9, 1.0 + 2e-8]])
    a, b, c = TRIANGLES[2]  # 4, 5, 7: the edge 4-5 is that of the front
    faces = np.concatenate([np.delete(TRIANGLES, 2, axis=0), [[a, b, 8], [b, c, 8], [c, a, 8]]])
    part = PartSurface(vertices, faces, {})
    top = part.flood(int(part.nearest([[0.6, 0.5, 1.0]])[0]))
    assert part.area(top) == pytest.approx(1.0, abs=1e-6) and len(top) in (3, 4)
    front = part.flood(int(part.nearest([[0.6, 0.0, 0.5]])[0]))
    assert part.area(front) == pytest.approx(1.0, abs=1e-6) and len(np.intersect1d(top, front)) == 0


def test_a_surface_has_its_part():
    surface = surface_from_arrays(CUBE, TRIANGLES, groups={"lid": [2, 3]})
    assert surface.part.group("lid").tolist() == [2, 3] and surface.part is surface.part
    ends = sample("cube").part.flood(0)
    assert sample("cube").part.area(ends) == pytest.approx(1.0)


def test_an_edge_that_bends_by_just_the_angle_is_crossed():
    assert len(cube().flood(0, 0.0)) == 2 and len(cube().flood(0, 90.0)) == 12 and len(cube().flood(0, 89.9)) == 2


def test_offsets_of_a_round_are_zero_between_its_chords_and_the_round():
    part = of(trimesh.creation.cylinder(radius=2.0, height=3.0, sections=36))  # bends by 10 degrees
    angles, height = np.linspace(0.01, 6.0, 50), np.linspace(-1.2, 1.2, 50)
    normals = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    sagitta = 2.0 * (1.0 - np.cos(np.pi / 36))
    for off in (0.0, 0.01, -0.01, -0.5 * sagitta):
        points = (2.0 + off) * normals + height[:, None] * [0.0, 0.0, 1.0]
        found = part.offsets(points, normals)
        assert np.all(np.abs(found + off) < (0.03 * sagitta if off >= 0.0 else 1.01 * sagitta))
        assert np.all(found * off <= 0.0)
    lids = np.array([[0.3, 0.2, 1.49], [0.3, 0.2, -1.52]])
    assert part.offsets(lids, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])) == pytest.approx([0.01, -0.02])


def test_offsets_of_a_box_are_those_of_its_planes_and_edges():
    part = cube()
    points = np.array([[0.3, 0.4, 1.1], [0.3, 0.4, 0.9], [1.1, 0.5, 1.1]])
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    assert part.offsets(points, normals) == pytest.approx([-0.1, 0.1, -0.14])
