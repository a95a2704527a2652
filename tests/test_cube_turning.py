"""The cube's edges are turned out of hollows and towards ridges."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import ball, rounded_cube

from parameterize.cube.cube import CubeLayout, project_radially
from parameterize.cube.turning import _HOLLOW, _OTHER_TURN, _angle_between, _bends, _concavity, best_turn


def laid(vertices, faces):
    centred = vertices - vertices.mean(axis=0)
    return CubeLayout(vertices, faces, centred / np.linalg.norm(centred, axis=1, keepdims=True), len(vertices))


def turned(layout, seed, number=0):
    rotation = best_turn(layout, np.random.default_rng(seed), number)
    return replace(layout, places=layout.places @ rotation.T)


def test_a_hollow_counts_positive_and_a_ridge_negative():
    points, faces = ball(1500)
    assert (_bends(laid(points, faces))[2] < 0.0).all()
    dented = points * (1.0 - 0.5 * np.exp(-8.0 * (1.0 - points[:, 2:])))
    middles, _, bends = _bends(laid(dented, faces))
    assert (bends[middles[:, 2] > 0.98] > 0.0).mean() > 0.8 and (bends[middles[:, 2] < 0.0] < 0.0).all()


def test_the_edges_of_a_cube_are_found_again():
    """The chosen rotation leads the cube's edges close to those of a rounded cube."""
    points, faces = rounded_cube(4000, 30.0)
    layout = laid(points, faces)
    found = turned(layout, 0)
    middles, along, bends = _bends(layout)
    best = _concavity(middles, along, bends)
    middles, along, bends = _bends(found)
    assert _concavity(middles, along, bends) == pytest.approx(best, rel=0.01) and best < 0.0
    ridge = np.sort(np.abs(points - 0.5), axis=1)[:, 1] > 0.47  # on the edges of the rounded cube
    place = np.sort(np.abs(project_radially(found.places[ridge])), axis=1)[:, 1]
    assert np.median(place) > 0.47


def test_ridges_do_not_make_up_for_a_hollow_on_the_same_edge():
    """Of two layouts with the same sum of bends, that one is better whose edges lie in no hollow."""
    middles = np.array([[-0.5, -0.5, -0.4], [-0.5, -0.5, 0.4]])  # both on one edge of the cube, far apart
    along = np.array([[0.0, 0.0, 1.0]] * 2)
    even, uneven = (_concavity(middles, along, np.array(bends)) for bends in ([-1.0, -1.0], [1.0, -3.0]))
    assert even == pytest.approx(-2.0, rel=1e-6)
    assert uneven == pytest.approx(-2.0 + _HOLLOW, rel=1e-6)


def test_the_same_generator_gives_the_same_turn():
    layout = laid(*ball(200))
    first, second = (turned(layout, 7).places for _ in range(2))
    assert np.array_equal(first, second)
    assert not np.allclose(turned(layout, 8).places, first)
    assert np.linalg.norm(first, axis=1) == pytest.approx(1.0)


def test_a_higher_number_gives_another_turn_that_is_no_better():
    points, faces = ball(600)
    layout = laid(points * (1.0 + 0.3 * np.sin(5.0 * points[:, :1]) * points[:, 1:2]), faces)
    middles, along, bends = _bends(layout)
    found = [turned(layout, 1, number).places for number in (0, 1, 100)]
    turns = [Rotation.align_vectors(directions, layout.places)[0] for directions in found]
    costs = [_concavity(middles @ turn.as_matrix().T, along @ turn.as_matrix().T, bends) for turn in turns]
    assert _angle_between(turns[1], turns[0]) > _OTHER_TURN
    assert costs[0] < costs[1] <= costs[2]


def test_where_the_best_rotations_lead_to_one_turn_others_follow():
    """All rotations that are turned further find the edges of a rounded cube."""
    layout = laid(*rounded_cube(2000, 30.0))
    first, second = (turned(layout, 0, number).places for number in range(2))
    away = Rotation.align_vectors(first, second)[0]
    assert _angle_between(away, Rotation.identity()) > _OTHER_TURN


def test_a_quarter_turn_of_the_cube_is_no_other_turn():
    quarter, some = Rotation.from_euler("z", 90.0, degrees=True), Rotation.from_rotvec([0.3, -0.2, 0.1])
    assert _angle_between(quarter * some, some) == pytest.approx(0.0, abs=1e-12)
    assert _angle_between(Rotation.from_rotvec([0.0, 0.4, 0.0]) * quarter * some, some) == pytest.approx(0.4)
