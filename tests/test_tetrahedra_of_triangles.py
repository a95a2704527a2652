"""Tetrahedra of parts that are given by triangles alone: faces, curves, sizes, cavities, several solids."""

from functools import cache

import numpy as np
import pytest
import trimesh

from parameterize.arrays import Array, IntArray
from parameterize.layouts.tetrahedra.curves import curves_through
from parameterize.layouts.tetrahedra.curving import curved, stepped_back
from parameterize.layouts.tetrahedra.from_triangles import tetrahedra_of_triangles
from parameterize.layouts.tetrahedra.mesh import TetrahedralMesh
from parameterize.layouts.tetrahedra.mesher import MesherError, Sizes
from parameterize.layouts.tetrahedra.outline import outline_of
from parameterize.layouts.tetrahedra.smooth_faces import SmoothFaces

SHARP = 40.0
Triangles = tuple[Array, IntArray]


def alone(faces: IntArray) -> IntArray:
    """Return the sides of the triangles of one solid."""
    return np.tile([1, 0], (len(faces), 1))


@cache
def cylinder() -> Triangles:
    """Return a cylinder of radius 1 and height 1, its circles of 64 chords."""
    found = trimesh.creation.cylinder(1.0, 1.0, sections=64)
    return np.array(found.vertices), np.array(found.faces)


def block(low: float, high: float) -> Triangles:
    """Return a cube."""
    found = trimesh.creation.box(bounds=[[low] * 3, [high] * 3])
    return np.array(found.vertices), np.array(found.faces)


def rounded_plate() -> Triangles:
    """Return a plate of 8 x 4 x 1 with one of its long edges rounded by 1/2, in 8 chords."""
    angles = np.linspace(0.0, np.pi / 2.0, 9)
    arc = np.stack([3.5 + 0.5 * np.cos(angles), 0.5 + 0.5 * np.sin(angles)], axis=1)
    profile = np.concatenate([[[0.0, 0.0], [4.0, 0.0]], arc, [[0.0, 1.0]]])
    count = len(profile)
    points = np.concatenate([np.insert(profile, 1, height, axis=1) for height in (8.0, 0.0)])
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)])
    sides = np.array([(k, count + k, (k + 1) % count, count + (k + 1) % count) for k in range(count)])
    walls = sides[:, [0, 1, 2, 2, 1, 3]].reshape(-1, 3)
    return points, np.concatenate([fan[:, ::-1], fan + count, walls])


def two_blocks() -> tuple[Array, IntArray, IntArray]:
    """Return two unit cubes with a common face, and the solids at the sides of the triangles."""
    points = np.array([(x, y, z) for x in (0, 1, 2) for y in (0, 1) for z in (0, 1)], dtype=float)
    around = np.array([(0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    quads = np.concatenate([around, around + 4, [(0, 2, 3, 1), (8, 9, 11, 10), (4, 5, 7, 6)]])
    sides = np.array([(1, 0)] * 4 + [(2, 0)] * 4 + [(1, 0), (2, 0), (1, 2)])
    return points, quads[:, [0, 2, 1, 0, 3, 2]].reshape(-1, 3), np.repeat(sides, 2, axis=0)


@cache
def of_cylinder() -> TetrahedralMesh:
    points, faces = cylinder()
    return tetrahedra_of_triangles(points, faces, alone(faces), SHARP, Sizes(1.0, 8.0))


def test_a_cylinder_has_three_faces_and_two_circles() -> None:
    points, faces = cylinder()
    found = outline_of(points, faces, alone(faces), SHARP)
    assert found.labels.max() == 2
    assert len(found.corners) == 0
    assert [len(chain) for chain in found.chains] == [65, 65]
    assert all(chain[0] == chain[-1] for chain in found.chains)


def test_curves_through_chords_are_circles() -> None:
    points, faces = cylinder()
    found = curves_through(points, outline_of(points, faces, alone(faces), SHARP).chains)
    np.testing.assert_allclose(found.lengths, 2.0 * np.pi, rtol=1e-6)
    places = found.at(np.zeros(50, dtype=int), np.linspace(0.0, 9.0, 50))  # and on around
    np.testing.assert_allclose(np.hypot(places[:, 0], places[:, 1]), 1.0, atol=1e-6)
    np.testing.assert_allclose(found.curvature(np.zeros(50, dtype=int), np.linspace(0.0, 6.0, 50)), 1.0, rtol=1e-3)


def test_facets_do_not_show_on_smooth_faces() -> None:
    points, faces = cylinder()
    outline = outline_of(points, faces, alone(faces), SHARP)
    surface = SmoothFaces(points, faces, outline)
    side = np.flatnonzero(np.abs(outline.normals[:, 0, 2]) < 0.5)
    places = surface.lifted(side, np.full((len(side), 3), 1.0 / 3.0))
    assert np.abs(np.hypot(places[:, 0], places[:, 1]) - 1.0).max() < 1e-4  # the facets leave it by 1.2e-3
    np.testing.assert_allclose(surface.curvatures[side], 1.0, rtol=1e-2)


def test_a_seam_runs_where_a_plane_ends_and_a_rounding_begins() -> None:
    points, faces = rounded_plate()
    found = outline_of(points, faces, alone(faces), SHARP)
    assert found.labels.max() + 1 == 7
    assert len(found.corners) == 10


@pytest.mark.parametrize("turn", [5.0, 20.0])
def test_planes_that_meet_in_a_small_angle_are_not_rounded(turn: float) -> None:
    points, faces = block(0.0, 1.0)
    top = points[:, 2] > 0.5
    points[top, 0] *= 1.0 + np.tan(np.radians(turn))
    found = outline_of(points, faces, alone(faces), 89.0 + turn)  # so that no edge is sharp by its angle
    assert found.labels.max() + 1 == 6
    assert len(found.corners) == 8


def test_tetrahedra_keep_faces_and_curves_and_their_nodes_lie_there() -> None:
    mesh = of_cylinder()
    assert (mesh.volumes > 0.0).all()
    assert sorted(np.unique(mesh.faces)) == [1, 2, 3]
    assert sorted(np.unique(mesh.curves)) == [1, 2]
    assert np.bincount(mesh.curves)[1:].min() >= 6
    nodes = mesh.numbering.gathered(mesh.nodes)[mesh.on_part]
    radius, height = np.hypot(nodes[:, 0], nodes[:, 1]), np.abs(nodes[:, 2])
    assert np.minimum(np.abs(radius - 1.0), np.abs(height - 0.5)).max() < 1e-3
    rim = mesh.points[np.unique(mesh.segments)]
    np.testing.assert_allclose(np.abs(rim[:, 2]), 0.5, atol=1e-12)
    np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 1]), 1.0, atol=1e-6)


def test_they_are_proved_on_the_part() -> None:
    found = stepped_back(curved(of_cylinder()))
    assert found.is_proved
    assert found.farthest < 0.05


def test_no_triangle_has_two_sides_on_one_smooth_curve() -> None:
    mesh = of_cylinder()
    arcs = {tuple(sorted(pair)) for pair in mesh.segments.tolist()}
    sides = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    assert max(sum(tuple(side) in arcs for side in three) for three in sides.tolist()) == 1


def test_a_cavity_stays_empty() -> None:
    (outer, first), (inner, second) = block(0.0, 3.0), block(1.0, 2.0)
    faces = np.concatenate([first, second[:, ::-1] + len(outer)])
    mesh = tetrahedra_of_triangles(np.concatenate([outer, inner]), faces, alone(faces), SHARP, Sizes(2.0, 8.0))
    assert mesh.volumes.sum() == pytest.approx(26.0)
    assert len(np.unique(mesh.faces)) == 12


def test_solids_share_the_triangles_between_them() -> None:
    points, faces, sides = two_blocks()
    mesh = tetrahedra_of_triangles(points, faces, sides, SHARP, Sizes(2.0, 8.0))
    for solid in (0, 1):
        assert mesh.volumes[mesh.solids == solid].sum() == pytest.approx(1.0)
    assert len(np.unique(mesh.faces)) == 11
    assert len(np.unique(mesh.points[mesh.points[:, 0] == 1.0], axis=0)) == np.count_nonzero(mesh.points[:, 0] == 1.0)


def test_places_ask_for_shorter_edges() -> None:
    points, faces = block(0.0, 1.0)
    few = tetrahedra_of_triangles(points, faces, alone(faces), SHARP, Sizes(1.0, 8.0))
    sizes = Sizes(1.0, 8.0, places=np.array([[0.0, 0.0, 0.0, 0.02]]))
    many = tetrahedra_of_triangles(points, faces, alone(faces), SHARP, sizes)
    assert len(many.cells) > 2 * len(few.cells)


def test_walls_that_meet_are_refused() -> None:
    (outer, first), (inner, second) = block(0.0, 3.0), block(2.0, 4.0)
    faces = np.concatenate([first, second + len(outer)])
    with pytest.raises(MesherError, match="meet each other"):
        tetrahedra_of_triangles(np.concatenate([outer, inner]), faces, alone(faces), SHARP, Sizes(3.0, 8.0))
