"""Rays from points to a surface, points inside, depths, and lattices."""

import tracemalloc

import numpy as np
import pytest
import trimesh
from shapes import CORNERS, CUBE_FACES, ball, enclosed_volume, turned

from parameterize.surface.solid import DIRECTIONS, Solid, crossed_pairs, inside_of

CELL = 0.1


def test_rays_reach_the_surface_through_faces_edges_and_corners():
    body = Solid(CORNERS, CUBE_FACES)
    ways = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.8, 0.0], [1.0, 1.0, 1.0], [1.0, -1.0, 0.0]])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    expected = [0.5, 0.5, 0.5 / 0.8, 0.5 * np.sqrt(3.0), 0.5 * np.sqrt(2.0)]
    assert np.allclose(body.rays(np.full(3, 0.5), ways), expected, rtol=1e-4)


def test_rays_that_meet_nothing_are_as_long_as_the_diagonal():
    assert np.isclose(Solid(CORNERS, CUBE_FACES).rays(np.array([2.0, 0.5, 0.5]), np.eye(3)[0]), np.sqrt(3.0))


def test_points_inside():
    points = np.array([[[0.5, 0.5, 0.5], [1.1, 0.5, 0.5]]])
    assert Solid(CORNERS, CUBE_FACES).contains(points).tolist() == [[True, False]]


def box_corners(low, high):
    mesh = trimesh.creation.box(bounds=[low, high])
    return mesh.vertices[mesh.faces]


def test_directions_and_their_opposites_lead_to_all_neighbours():
    both = {*DIRECTIONS, *(tuple(-x for x in d) for d in DIRECTIONS)}
    assert len(DIRECTIONS) == 13 and len(both) == 26


def test_points_of_a_box_are_inside_up_to_its_half_open_faces():
    """A lattice point on a face belongs to the box on one side and not on the other: never twice, never to none."""
    inside = inside_of(box_corners((1, 2, 3), (4, 6, 8)), (9, 9, 9))
    assert inside.sum() == 3 * 4 * 5
    other = inside_of(box_corners((4, 2, 3), (7, 6, 8)), (9, 9, 9))
    assert not np.any(inside & other) and np.all((inside | other)[2:7, 3:6, 4:8])


def test_points_of_a_turned_body_are_those_of_its_implicit_form():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=7.0)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))
    mesh.apply_translation([9.3, 9.1, 9.2])
    inside = inside_of(mesh.vertices[mesh.faces], (19, 19, 19))
    radius = np.linalg.norm(
        np.stack(np.meshgrid(*[np.arange(19)] * 3, indexing="ij"), axis=-1) - (9.3, 9.1, 9.2), axis=-1
    )
    assert np.all(inside[radius < 6.9]) and not np.any(inside[radius > 7.0])


def test_two_boxes_with_a_narrow_gap_are_crossed_between_all_neighbours_across_it():
    """The gap lies between the planes x = 4 and x = 5: each pair of points on both sides is crossed, and no other."""
    corners = np.concatenate(
        [box_corners((0.5, 0.5, 0.5), (4.4, 5.5, 5.5)), box_corners((4.6, 0.5, 0.5), (8.5, 5.5, 5.5))]
    )
    inside = inside_of(corners, (10, 7, 7))
    assert inside.sum() == 8 * 5 * 5
    pairs = np.concatenate([np.stack(pair, axis=1) for pair in crossed_pairs(corners, inside)])
    assert np.all(np.sort(pairs[:, :, 0], axis=1) == (4, 5))
    steps = {tuple(step) for step in pairs[:, 1] - pairs[:, 0]}
    assert {tuple(abs(step[0]) for step in steps)} == {(1,) * 9} and len(steps) == 9
    straight = pairs[np.all(pairs[:, 0, 1:] == pairs[:, 1, 1:], axis=1)]
    assert len({tuple(pair) for pair in straight[:, 0].tolist()}) == 25


def test_lattice_points_fill_the_volume():
    vertices, faces = ball(1500)
    points = Solid(vertices, faces).lattice(0.1)
    assert np.linalg.norm(points, axis=1).max() < 1.0
    assert len(points) * 0.1**3 == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)
    assert Solid(vertices, faces).signed_distances(np.zeros((1, 3)))[0] == pytest.approx(-1.0, abs=0.01)
    assert Solid(vertices, faces).signed_distances(np.array([[0.0, 2.0, 0.0]]))[0] == pytest.approx(1.0, abs=0.01)


def whole_lattice(vertices, cell, margin):
    low, high = np.floor((vertices.min(0) - margin) / cell), np.ceil((vertices.max(0) + margin) / cell)
    return np.stack(np.meshgrid(*map(np.arange, low, high + 1.0), indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (3.0, 1.0, 0.5), (6.0, 0.4, 0.4)])
def test_nothing_inside_is_left_out_of_the_lattice(stretch):
    vertices, faces = ball(500)
    vertices = turned(vertices * stretch, (0.5, 0.9, -0.4))
    everywhere = whole_lattice(vertices, CELL, CELL / 2.0)
    distances = Solid(vertices, faces).signed_distances(CELL * everywhere)
    inside = everywhere[distances < 0.0]
    assert Solid(vertices, faces).lattice(CELL) == pytest.approx(CELL * inside)
    close = everywhere[distances < CELL / 2.0]
    found = Solid(vertices, faces).lattice_near(CELL, CELL / 2.0)
    assert {tuple(row) for row in close.astype(int).tolist()} <= {tuple(row) for row in found.tolist()}
    assert np.array_equal(found, np.unique(found, axis=0))  # each once, in their order


@pytest.mark.parametrize("count", [pytest.param(12, marks=pytest.mark.slow), 400])
def test_a_needle_askew_takes_the_memory_of_what_is_in_it(count):
    """Of the box around it, 16 cubed, the lattice has 4 million points, and the needle some 5000 of them."""
    vertices, faces = ball(count)
    vertices = turned(vertices * [14.0, 0.35, 0.35], (0.0, -0.62, 0.79))
    assert np.ptp(vertices, axis=0).min() > 14.0
    tracemalloc.start()
    points = Solid(vertices, faces).lattice(CELL)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(points) * CELL**3 == pytest.approx(enclosed_volume(vertices, faces), rel=0.1)
    assert taken < 50e6  # the coordinates of all would take 75 and more, and there were several arrays
