"""The cube's edges are turned out of hollows and towards ridges."""

import numpy as np
import pytest
from shapes import ball, rounded_cube

from parameterize.config import LAYOUT
from parameterize.cube.cube import project_radially
from parameterize.cube.sphere import SphereLayout
from parameterize.cube.turning import _bends, _hollowness, turned


def laid(vertices, faces):
    centred = vertices - vertices.mean(axis=0)
    return SphereLayout(vertices, faces, centred / np.linalg.norm(centred, axis=1, keepdims=True))


def test_a_hollow_counts_positive_and_a_ridge_negative():
    points, faces = ball(1500)
    assert (_bends(laid(points, faces))[2] < 0.0).all()
    dented = points * (1.0 - 0.5 * np.exp(-8.0 * (1.0 - points[:, 2:])))
    middles, _, bends = _bends(laid(dented, faces))
    assert (bends[middles[:, 2] > 0.98] > 0.0).mean() > 0.8 and (bends[middles[:, 2] < 0.0] < 0.0).all()


def test_the_edges_of_a_cube_are_found_again():
    """Of 2 000 rotations the chosen one leads the cube's edges close to those of a rounded cube."""
    points, faces = rounded_cube(4000, 30.0)
    layout = laid(points, faces)
    options = type(LAYOUT)(turns=2000)
    found = turned(layout, options, np.random.default_rng(0))
    middles, along, bends = _bends(layout)
    best = _hollowness(middles, along, bends, options.edge_width)
    middles, along, bends = _bends(found)
    assert best < _hollowness(middles, along, bends, options.edge_width) < 0.6 * best < 0.0
    ridge = np.sort(np.abs(points - 0.5), axis=1)[:, 1] > 0.47  # on the edges of the rounded cube
    place = np.sort(np.abs(project_radially(found.directions[ridge])), axis=1)[:, 1]
    assert np.median(place) > 0.4


def test_the_same_generator_gives_the_same_turn():
    layout = laid(*ball(200))
    first, second = (turned(layout, LAYOUT, np.random.default_rng(7)).directions for _ in range(2))
    assert np.array_equal(first, second)
    assert not np.allclose(turned(layout, LAYOUT, np.random.default_rng(8)).directions, first)
    assert np.linalg.norm(first, axis=1) == pytest.approx(1.0)
