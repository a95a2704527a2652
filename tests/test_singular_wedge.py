"""Exponents at the edge of a wedge, against closed forms and numbers of the literature."""

from math import pi

import numpy as np
import pytest

from solve.singular.wedge import REGULAR, Sector, exponent

FREE, FIXED, ROLLER = ((0.0,) * 9, tuple(np.eye(3).ravel()), tuple(np.diag([0.0, 1.0, 0.0]).ravel()))


def elastic(degrees, first=FREE, last=FREE, ratio=0.3):
    return exponent((Sector(np.radians(degrees), 1.0, ratio),), first, last)


@pytest.mark.parametrize("degrees", [200.0, 270.0, 315.0, 360.0])
def test_poisson(degrees):
    angle = np.radians(degrees)
    assert exponent((Sector(angle),), (0.0,), (0.0,)) == pytest.approx(pi / angle, abs=1e-3)
    assert exponent((Sector(angle),), (1.0,), (1.0,)) == pytest.approx(pi / angle, abs=1e-3)
    assert exponent((Sector(angle),), (1.0,), (0.0,)) == pytest.approx(pi / (2.0 * angle), abs=1e-3)


def test_elasticity_at_a_free_and_at_a_held_corner():
    assert elastic(270.0) == pytest.approx(0.5445, abs=1e-3)  # Williams 1952
    assert elastic(360.0) == pytest.approx(0.5, abs=0.02)  # a crack
    assert elastic(90.0, FIXED) == pytest.approx(0.7112, abs=1e-3)
    assert elastic(180.0, FIXED) == pytest.approx(0.5, abs=1e-3)
    assert elastic(180.0, ROLLER) == pytest.approx(0.5, abs=1e-3)  # a punch without friction
    assert elastic(135.0, ROLLER) == pytest.approx(elastic(270.0), abs=2e-3)  # its mirror image


def test_nothing_is_singular_at_convex_free_edges_and_where_a_plane_of_symmetry_meets_a_face():
    assert elastic(90.0) == elastic(180.0) == elastic(90.0, ROLLER) == elastic(90.0, ROLLER, ROLLER) == REGULAR
    assert elastic(58.0, FIXED) == REGULAR > elastic(64.0, FIXED)
    assert exponent((Sector(pi / 2),), (1.0,), (0.0,)) == REGULAR


def test_two_materials_at_a_free_surface():
    quarter = pi / 2
    alike = (Sector(quarter, 1.0, 0.3), Sector(quarter, 1.0, 0.3))
    assert exponent(alike, FREE, FREE) == REGULAR
    stiffer = (Sector(quarter, 1.0, 0.3), Sector(quarter, 10.0, 0.3))
    assert exponent(stiffer, FREE, FREE) == pytest.approx(exponent(stiffer[::-1], FREE, FREE), abs=2e-3)
    assert 0.7 < exponent(stiffer, FREE, FREE) < 0.85
    ratio = 10.0  # tan(lambda pi/2) = -ratio tan(lambda pi)
    closed = 2.0 / pi * np.arctan(np.sqrt(1.0 + 2.0 * ratio))
    found = exponent((Sector(quarter, 1.0), Sector(pi, ratio)), (0.0,), (0.0,))
    assert found == pytest.approx(closed, abs=2e-3)
