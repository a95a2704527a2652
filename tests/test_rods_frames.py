"""Frames along curves."""

import numpy as np

from parameterize.layouts.rods.frames import angle_about, at_lengths, parallel_transport, rotated, tangents, turned

TURN = np.linspace(0.0, 2 * np.pi, 721)


def test_a_frame_is_carried_along_a_plane_curve_without_a_turn():
    circle = np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)
    assert np.allclose(parallel_transport(np.eye(3)[2], tangents(circle)), np.eye(3)[2])


def test_a_frame_turns_by_the_area_that_the_tangents_enclose_on_the_sphere():
    slope = 0.6  # the tangents of a helix go round a circle of latitude
    along = np.stack([np.cos(TURN), np.sin(TURN), np.full(len(TURN), slope)], axis=1) / np.hypot(1.0, slope)
    frame = parallel_transport(np.eye(3)[2], along)
    area = 2 * np.pi * (1.0 - slope / np.hypot(1.0, slope))
    turn = angle_about(along[0], frame[0], frame[-1])
    assert np.isclose(np.cos(turn), np.cos(area), atol=1e-4) and np.isclose(
        abs(np.sin(turn)), abs(np.sin(area)), atol=1e-4
    )
    assert np.abs((frame * along).sum(axis=1)).max() < 1e-12


def test_a_rotation_takes_one_vector_to_another_and_keeps_lengths():
    rng = np.random.default_rng(1)
    first, second = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    rows = rng.normal(size=(4, 3))
    assert np.allclose(rotated(first, first, second), second)
    assert np.allclose(np.linalg.norm(rotated(rows, first, second), axis=1), np.linalg.norm(rows, axis=1))
    assert np.allclose(rotated(np.cross(first, second), first, second), np.cross(first, second))


def test_a_quarter_turn_about_the_tangent():
    along, across = np.eye(3)[[2]], np.eye(3)[[0]]
    assert np.allclose(turned(across, along, np.array([0.5 * np.pi])), np.eye(3)[[1]])
    assert np.isclose(angle_about(along[0], across[0], np.array([-1.0, 1.0, 5.0])), 0.75 * np.pi)


def test_a_polygon_goes_on_straight_beyond_its_ends():
    corner = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    found = at_lengths(corner, np.array([-1.0, 1.0, 2.5, 4.0]))
    assert np.allclose(found, [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.5, 0.0], [2.0, 2.0, 0.0]])
