"""Elements are proved positive, or refuted by a point, also where corners and Gauss points show nothing."""

from __future__ import annotations

import numpy as np
import pytest

from parameterize.meshes.evaluation import exact_determinant
from parameterize.meshes.kinds import SERENDIPITY, hexahedron, tetra
from parameterize.meshes.search import FLAT, FOLDED, INVERTED, POSITIVE, certify_elements

KINDS = [hexahedron(1), SERENDIPITY, hexahedron(2), hexahedron(3), tetra(1), tetra(2), tetra(3)]


def straight(kind):
    return kind.lattice / np.array(kind.degrees)


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_straight_elements_are_positive_far_away_and_small(kind):
    nodes = np.stack([straight(kind), 1e-6 * straight(kind), straight(kind) + 1e6])
    found = certify_elements(kind, nodes)
    assert found.is_proved and found.sign == 1
    assert np.all(found.lower > 0.999) and np.all(found.scaled > 0.7) and np.all(found.scaled <= 1.0 + 1e-9)


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_a_mirrored_mesh_is_of_the_other_orientation_and_one_mirrored_element_is_inverted(kind):
    mirrored = straight(kind) * [1, 1, -1]
    assert certify_elements(kind, mirrored[None]).sign == -1
    assert certify_elements(kind, mirrored[None]).is_proved
    found = certify_elements(kind, np.stack([straight(kind), mirrored, straight(kind)]))
    assert found.verdicts.tolist() == [POSITIVE, INVERTED, POSITIVE]


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_an_element_in_a_plane_is_flat(kind):
    assert certify_elements(kind, (straight(kind) * [1, 1, 0])[None]).verdicts.tolist() == [FLAT]


def test_a_corner_in_the_plane_of_its_neighbours_is_flat():
    nodes = straight(hexahedron(1))
    nodes[6] = (0.5, 0.5, 1.0)  # on the line between its neighbours in the top face
    found = certify_elements(hexahedron(1), nodes[None])
    assert found.verdicts.tolist() == [FLAT]
    assert found.witnesses[0].tolist() == [1, 1, 1]


def test_a_fold_inside_is_found_though_corners_are_positive():
    nodes = straight(hexahedron(2))
    nodes[26] += [0.0, 0.0, 0.6]  # the node in the middle alone: corners see nothing of it
    found = certify_elements(hexahedron(2), nodes[None])
    assert found.verdicts.tolist() == [FOLDED]
    assert exact_determinant(hexahedron(2), nodes, found.witnesses[0]) < 0


def test_the_least_bound_is_close():
    nodes = straight(SERENDIPITY)[None] + 0.08 * np.random.default_rng(1).normal(size=(40, 20, 3))
    found = certify_elements(SERENDIPITY, nodes)
    proved = found.verdicts == POSITIVE
    assert proved.sum() > 10 and np.all(found.lower[proved] > 0.0)
    assert np.all(found.least[found.verdicts == FOLDED] < 0.0)
    some = certify_elements(SERENDIPITY, nodes[proved])
    assert some.lower.min() >= 0.9 * some.least.min()


def test_a_least_value_that_no_corner_has_is_found():
    """An edge that bulges into the element has det J = 1 at all corners, and 1 - .6 on a whole line."""
    nodes = straight(SERENDIPITY)
    nodes[np.flatnonzero((SERENDIPITY.lattice == (1, 0, 0)).all(axis=1))[0], 1] = 0.6
    found = certify_elements(SERENDIPITY, nodes[None])
    assert found.is_proved
    assert found.lower[0] * found.volumes[0] == pytest.approx(0.4, abs=0.05)
