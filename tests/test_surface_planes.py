"""Plane parts of a surface."""

import numpy as np
import pytest
from plane_bodies import BODIES, arrays
from shapes import rounded_cube

from parameterize.surface.plane_faces import planes_of


def test_the_planes_of_a_box_have_its_normals_and_distances():
    vertices, faces = arrays(BODIES["box"][0]().refine(4))
    found = planes_of(vertices, faces, 6)
    assert np.bincount(found.parts).tolist() == [len(faces) // 6] * 6
    known = sorted(
        (*normal, offset) for normal, offset in zip(found.normals.round(9) + 0.0, found.offsets, strict=True)
    )
    expected = [(-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 0), (0, 0, 1, 3), (0, 1, 0, 2), (1, 0, 0, 1)]
    assert known == [pytest.approx(row, abs=1e-9) for row in expected]


def test_parts_in_one_plane_that_are_not_connected_are_two():
    assert len(planes_of(*arrays("U"), 64)) == 10


def test_a_smooth_surface_has_too_many():
    assert planes_of(*rounded_cube(200), 64) is None
