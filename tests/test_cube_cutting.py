import tracemalloc

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from shapes import area, ball, enclosed_volume, is_closed, turned

from parameterize.cube.cutting import cut_along_rays, split_edges, subdivide_finely, subdivide_long_edges
from parameterize.surface.geometry import edge_table


def surrounding(seed):
    """A bumpy surface around (1/2, 1/2, 1/2), star-shaped from there."""
    points, faces = ball(400)
    rng = np.random.default_rng(seed)
    bumps = 1.0 + 0.1 * np.sin(points @ rng.normal(size=(3, 3)) * 2.0).sum(axis=1)
    return turned(0.5 + 0.6 * bumps[:, None] * points, rng.uniform(-1.0, 1.0, 3)), faces


def off_one_face(points):
    """How far each triangle (m, 3, 3), counted from the centre, is from lying before a single face of the cube."""
    sizes = np.abs(points).max(axis=2)  # (m, 3)
    gaps = [(sizes - sign * points[:, :, axis]).max(axis=1) for axis in range(3) for sign in (1.0, -1.0)]
    return np.min(gaps, axis=0)


@pytest.mark.parametrize("seed", range(4))
def test_after_cutting_every_triangle_is_before_one_face(seed):
    points, faces = surrounding(seed)
    cut = cut_along_rays(points, faces, 0.0)
    after = cut.carry(points)
    assert off_one_face(points[faces] - 0.5).max() > 0.01
    assert off_one_face(after[cut.faces] - 0.5).max() < 1e-14
    assert after[: len(points)] == pytest.approx(points, abs=0.0)
    assert is_closed(cut.faces)
    assert area(after, cut.faces) == pytest.approx(area(points, faces), rel=1e-12)
    assert enclosed_volume(after - 0.5, cut.faces) == pytest.approx(enclosed_volume(points - 0.5, faces), rel=1e-12)
    assert len(np.unique(cut.faces)) == len(after)


def test_new_vertices_lie_on_the_half_planes_and_on_mesh_edges():
    points, faces = surrounding(7)
    cut = cut_along_rays(points, faces, 0.0)
    new = np.arange(len(points), len(cut.parents))
    assert (cut.parents[new] < new[:, None]).all()
    assert (cut.share[new] > 0.0).all() and (cut.share[new] < 1.0).all()
    sizes = np.sort(np.abs(cut.carry(points)[new] - 0.5), axis=1)
    tie = np.minimum(sizes[:, 2] - sizes[:, 1], sizes[:, 1] - sizes[:, 0])  # two coordinates are equal in size
    assert tie.max() < 1e-14


def test_snapping_leaves_no_short_piece():
    points, faces = surrounding(1)
    plain, snapped = cut_along_rays(points, faces, 0.0), cut_along_rays(points, faces, 0.2)
    new = slice(len(points), None)
    assert plain.share[new].min() < 0.2
    assert snapped.share[new].min() >= 0.2 and snapped.share[new].max() <= 0.8
    assert is_closed(snapped.faces)


def test_a_mesh_that_resolves_the_edges_is_not_cut():
    corners = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    faces = ConvexHull(corners).simplices.astype(np.int64)
    cut = cut_along_rays(corners, faces, 0.0)
    assert len(cut.parents) == 8 and np.array_equal(cut.faces, faces)


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_splitting_a_triangle(count):
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    edges = np.array([[0, 1], [1, 2], [0, 2]])[:count]
    pieces = split_edges(np.array([[0, 1, 2]]), edges.reshape(-1, 2), 3)
    assert len(pieces) == count + 1
    points = np.concatenate([vertices, vertices[edges].mean(axis=1).reshape(-1, 3)])
    a, b, c = np.moveaxis(points[pieces], 1, 0)
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > 0.1).all()  # same orientation, no sliver
    assert 0.5 * normals[:, 2].sum() == pytest.approx(0.5)


def test_no_edge_stays_too_long():
    points, faces = ball(60)
    longest = 0.15
    finer, triangles = subdivide_long_edges(points, faces, longest)
    ends = finer[edge_table(triangles)[0]]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max() <= longest
    assert np.array_equal(finer[:60], points)
    assert is_closed(triangles)
    assert area(finer, triangles) == pytest.approx(area(points, faces), rel=1e-12)
    assert enclosed_volume(finer, triangles) == pytest.approx(enclosed_volume(points, faces), rel=1e-12)


def test_short_edges_are_left_alone():
    points, faces = ball(60)
    finer, triangles = subdivide_long_edges(points, faces, 10.0)
    assert finer is points and triangles is faces


def test_slivers_are_cut_less_finely_before_they_are_millions():
    """Of a needle of slivers: cut as finely as asked for they would have 400 000 vertices."""
    points, faces = ball(1000)
    points = points * [1.0, 1.0, 300.0]
    assert subdivide_long_edges(points, faces, 0.1, most=1500) is None
    tracemalloc.start()
    finer, triangles = subdivide_finely(points, faces, 0.1, 3000)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 1000 < len(finer) <= 3000 and is_closed(triangles)
    assert taken < 20e6
    whole, _ = subdivide_long_edges(points, faces, 5.0)
    same, _ = subdivide_long_edges(points, faces, 5.0, most=len(whole))
    assert np.array_equal(whole, same) and subdivide_long_edges(points, faces, 5.0, most=len(whole) - 1) is None


def test_edges_of_a_tetrahedron():
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    assert edge_table(faces)[0].tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
