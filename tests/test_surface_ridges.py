"""Ridges among sharp edges, and what lies on them."""

import numpy as np
import pytest
from plane_bodies import arrays

from parameterize.surface.features import features_of
from parameterize.surface.ridges import Ridges


def ridges_of(name):
    vertices, faces = arrays(name)
    found = features_of(vertices, faces)
    return Ridges.of(found, vertices, faces), found, vertices


def test_the_inner_edge_of_an_L_is_no_ridge():
    ridges, found, _ = ridges_of("L")
    assert (len(found), len(ridges.lengths)) == (18, 17)
    assert len(ridges.corners) == 12
    a, b = ridges.corners[np.bincount(ridges.links.ravel(), minlength=12) == 2]  # three edges meet at the others
    assert ridges.lengths.sum() == pytest.approx(found.lengths.sum() - np.linalg.norm(b - a))


def test_points_and_mesh_edges_on_ridges_are_told_from_others():
    ridges, _, _ = ridges_of("frustum")
    a, b = ridges.segments[0]
    points = np.array([a, b, 0.3 * a + 0.7 * b, 0.5 * (a + b) + 1e-3])
    assert ridges.hold(points).tolist() == [True, True, True, False]
    assert ridges.end_at(points).tolist() == [True, True, False, False]
    assert ridges.along(points, np.array([[0, 2], [2, 1], [0, 3]])).tolist() == [True, True, False]


def test_an_edge_between_two_ridges_is_not_on_one():
    ridges, _, vertices = ridges_of("frustum")
    ends = np.array([ridges.links[0], ridges.links[0]])
    across = [i for i in range(len(ridges.corners)) if i not in ends[0] and not _linked(ridges, ends[0, 0], i)]
    edges = np.array([ends[0], [ends[0, 0], across[0]]])
    assert ridges.along(ridges.corners, edges).tolist() == [True, False]


def _linked(ridges, a, b):
    return any({a, b} == set(pair) for pair in ridges.links.tolist())
