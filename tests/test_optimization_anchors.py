import numpy as np
import pytest
from block_bodies import BODIES, uniform_nets
from shapes import ball

from parameterize.cube.cube import CORNERS, EDGES, snap
from parameterize.optimization.anchors import Anchors, edge_points, face_points
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.surface_distance import TANGENTIAL, Correspondence
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.interface import Interface
from parameterize.spline.spline_map import ControlNets
from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.geometry import vertex_quadrics, vertex_weights

NETS = ControlNets(3, ((open_uniform_knots(6, 3),) * 3,))  # three spans a direction


def anchors_on_a_ball(radius=0.5, given_corners=None):
    points, faces = ball(2000)
    points = 0.5 + radius * points
    fit = Correspondence(
        SlidingParameters(NETS, snap(points), triangles=faces),
        points,
        vertex_quadrics(points, faces, TANGENTIAL),
        vertex_weights(points, faces, len(points)),
        given_corners=given_corners,
    )
    return Anchors(fit)


def unit_cube():
    row = greville(NETS.knots[0][0], 3)
    return np.stack(np.meshgrid(row, row, row, indexing="ij")).reshape(3, -1)


def test_edge_points_are_the_corners_and_two_a_span():
    points, faces = edge_points(NETS)
    assert len(points) == 8 + 12 * (2 * 3 - 1)
    assert (((points == 0.0) | (points == 1.0)).sum(axis=1) >= 2).all()
    assert (points[np.arange(len(points)), faces // 2] == faces % 2).all()
    assert {tuple(c) for c in CORNERS} <= {tuple(p) for p in points}


def test_anchors_measure_how_far_the_edges_are_from_the_surface():
    anchors, control = anchors_on_a_ball(), unit_cube()
    anchors.aim(control)
    energy, _ = anchors.energy_and_gradient(control)
    # F is the identity, the surface a ball of radius 1/2: nearly all of the distance is along the ball's normal
    distance = np.linalg.norm(edge_points(NETS)[0] - 0.5, axis=1) - 0.5
    assert energy == pytest.approx((distance**2).mean(), rel=0.02)


def test_what_they_pull_on_comes_closer():
    anchors, control = anchors_on_a_ball(), unit_cube()
    anchors.aim(control)
    before, gradient = anchors.energy_and_gradient(control)
    after, _ = anchors.energy_and_gradient(control - gradient)
    assert after < before
    # downhill leads towards the centre, at all eight corners
    inward = NETS.of_block((gradient * (control - 0.5)).sum(0), 0)
    assert (inward[[0, 0, 0, 0, -1, -1, -1, -1], [0, 0, -1, -1] * 2, [0, -1] * 4] > 0.0).all()


def test_released_they_pull_on_nothing():
    anchors, control = anchors_on_a_ball(), unit_cube()
    anchors.aim(control)
    anchors.release()
    energy, gradient = anchors.energy_and_gradient(control)
    assert energy == 0.0
    assert not gradient.any()


def test_given_corners_are_held_while_nothing_else_is():
    wanted = CORNERS + 0.01 * np.arange(24).reshape(8, 3)
    anchors, control = anchors_on_a_ball(given_corners=wanted), unit_cube()
    anchors.release()
    _, gradient = anchors.energy_and_gradient(control)
    downhill = -NETS.of_block(gradient, 0)[:, [0, -1]][:, :, [0, -1]][:, :, :, [0, -1]].reshape(3, 8).T
    np.testing.assert_allclose(downhill / np.abs(downhill).max(), (wanted - CORNERS) / 0.23, atol=1e-12)


@pytest.mark.parametrize("name", BODIES)
def test_edge_points_of_blocks_lie_on_the_edges_of_exposed_faces(name):
    """An edge between a face of the boundary and a glued one has points, an edge between two glued ones has none."""
    spline = BODIES[name](7)
    nets = spline.nets
    points, faces = edge_points(nets)
    assert nets.exposed[faces].all()
    assert (points[np.arange(len(points)), faces % 6 // 2] == faces % 2).all()
    for block in range(len(nets.knots)):
        found = {tuple(p) for p in points[faces // 6 == block]}
        assert len(found) == (faces // 6 == block).sum()
        for i, j in EDGES:
            middle = (CORNERS[i] + CORNERS[j]) / 2.0
            at = [6 * block + 2 * axis + int(middle[axis]) for axis in range(3) if middle[axis] in (0.0, 1.0)]
            assert (tuple(middle) in found) == nets.exposed[at].any()


def test_a_block_whose_faces_are_all_glued_has_no_edge_points():
    around = [Interface((0, face), (k + 1, face)) for k, face in enumerate(FACE_NAMES)]
    nets = uniform_nets(*[(2, 2, 2)] * 7, interfaces=around)
    _, faces = edge_points(nets)
    assert set(faces // 6) == set(range(1, 7))


@pytest.mark.parametrize("name", BODIES)
def test_blocks_have_anchors_inside_all_exposed_faces(name):
    spline = BODIES[name](7)
    nets = spline.nets
    points, faces = face_points(nets)
    assert set(faces) == set(np.flatnonzero(nets.exposed))
    assert (points[np.arange(len(points)), faces % 6 // 2] == faces % 2).all()
    assert ((points > 0.0) & (points < 1.0)).sum(axis=1).tolist() == [2] * len(points)
    for face in set(faces):
        inner = [
            len(np.unique(row)) - 2
            for row in np.delete(np.array(nets.knots[face // 6], dtype=object), face % 6 // 2, axis=0)
        ]
        assert (faces == face).sum() == np.prod(inner)
