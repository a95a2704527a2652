import numpy as np
import pytest
from shapes import rounded_cube

from parameterize.cube.cube import snap
from parameterize.cube.flips import flipped, unflip, untangle


@pytest.fixture
def tangled():
    """A surface laid on the cube, with a few vertices beyond their neighbours."""
    places, faces = rounded_cube(300, power=40.0)
    places = snap(places)
    moved = places.copy()
    for vertex in (7, 100, 250):
        a, b, c = faces[(faces == vertex).any(axis=1)][0]
        moved[vertex] += 1.5 * (places[[a, b, c]].sum(axis=0) - 3.0 * places[vertex]) / 2.0
    moved = snap(moved)
    assert not flipped(places, faces).any() and flipped(moved, faces).sum() > 3
    return moved, faces


def test_flipped_triangles_turn_outwards_and_hardly_anything_moves(tangled):
    places, faces = tangled
    found = unflip(places, faces)
    assert not flipped(found, faces).any()
    moved = np.linalg.norm(found - places, axis=1)
    elsewhere = np.linalg.norm(untangle(places, faces) - places, axis=1)
    assert (moved > 1e-9).sum() < 0.1 * len(places)
    assert np.sum(moved**2) < np.sum(elsewhere**2)
    assert np.abs(np.abs(found - 0.5).max(axis=1) - 0.5).max() == 0.0  # on the cube


def test_a_layout_without_flips_stays(tangled):
    _, faces = tangled
    places = untangle(*tangled)
    assert np.allclose(unflip(places, faces), places, atol=1e-15)
