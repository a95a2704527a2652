"""Interfaces found and measured by rows are those of the plain comparison of two faces after the other."""

from itertools import combinations

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of
from cube_grids import frame, plate

from iga_nn import Body
from parameterize.spline.interface import Interface, face_layer, orientations
from parameterize.spline.interface_rows import gaps, interfaces_of, rows_of
from parameterize.spline.volume import FACE_NAMES

TURNS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 1, 0), (False, True, False))]
TURNED = row_of([(0, 0, 0), (1, 0, 0), (1, 1, 0)], TURNS)


def plain_interfaces(patches):
    """Compare all pairs of faces in all eight ways."""
    faces = [(number, name) for number in range(len(patches)) for name in FACE_NAMES]
    for first, second in combinations(faces, 2):
        below, above = (face_layer(patches[number].control_points, name) for number, name in (first, second))
        for way in orientations(first, second):
            turned = way.turned(above)
            if below.shape == turned.shape and np.abs(below - turned).max() < 1e-9:
                yield way
                break


@pytest.mark.parametrize("body", [TURNED, plate(), frame(), ring(3), exact_ring()])
def test_interfaces_are_those_of_the_plain_comparison(body):
    assert list(Body.from_patches(body.patches).interfaces) == list(plain_interfaces(body.patches))


def test_rows_and_interfaces_are_the_same():
    ways = [*orientations((0, "u1"), (2, "w0")), Interface((5, "v0"), (5, "v1"))]
    assert list(interfaces_of(rows_of(ways))) == ways
    assert interfaces_of(rows_of([])) == ()


def test_the_gap_is_the_largest_distance_and_infinite_for_other_knots():
    moved = [patch.transformed(1.0, (0.0, 0.0, 0.25 * number)) for number, patch in enumerate(TURNED)]
    finer = [moved[0], moved[1].refined(), moved[2]]
    rows = TURNED.interface_rows
    np.testing.assert_allclose(gaps(Body(tuple(moved)).groups, rows), 0.25)
    assert np.isinf(gaps(Body(tuple(finer)).groups, rows)).all()
