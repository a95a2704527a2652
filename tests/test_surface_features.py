"""Sharp edges of a surface."""

import numpy as np
import pytest
from plane_bodies import BODIES, arrays, prism, ring
from shapes import ball

from parameterize.surface.features import SHARP, features_of
from parameterize.surface.geometry import edge_triangles, normals_and_areas
from parameterize.surface.surface import surface_from_arrays


def test_an_l_has_eighteen_edges_and_twelve_corners():
    vertices, faces = arrays(BODIES["L"][0]().refine(5))
    found = features_of(vertices, faces)
    assert (len(found), len(found.corners)) == (18, 12)
    assert found.lengths.sum() == pytest.approx(2 * 12.0 + 6 * 2.0)
    assert found.edges.shape == (18 * 5, 2)


def test_the_answer_of_check_counts_them():
    facts = surface_from_arrays(*arrays("box")).summary()["sharp_edges"]
    assert facts == {"edges": 12, "corners": 8, "length": pytest.approx(24.0)}


def test_the_rims_of_a_shaft_are_closed_and_its_sides_smooth():
    vertices, faces = arrays(prism(ring(40, 1.0), 2.0))
    found = features_of(vertices, faces)
    assert (len(found), len(found.corners)) == (2, 0)
    assert found.lengths == pytest.approx([2.0 * np.sin(np.pi / 40) * 40] * 2)
    assert len(features_of(vertices, faces, angle=5.0)) == 40 + 80


def test_a_smooth_surface_has_none():
    assert len(features_of(*ball(400))) == 0


def test_noise_is_no_feature():
    points, faces = ball(2000)
    points[7] *= 1.05
    _, triangles = edge_triangles(faces)
    normals, _ = normals_and_areas(points, faces)
    bends = np.sum(normals[triangles[:, 0]] * normals[triangles[:, 1]], axis=1)
    assert np.sum(bends < np.cos(np.radians(SHARP))) >= 3  # around the vertex that stands out
    assert len(features_of(points, faces)) == 0
