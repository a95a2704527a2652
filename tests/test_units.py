"""The same model in any unit and at any place: the same map, to the last bits, and the same relative errors."""

import numpy as np
import pytest
from shapes import ball
from small_run import shortened

import iga_nn
from parameterize.surface.surface import surface_from_arrays

SINGLE = 2.0**-23  # spacing of single precision between 1 and 2, where the placed surface ends
FAR = 1e4  # of the size: coordinates that large keep 12 of their 16 digits
POINTS, FACES = ball(400)
POINTS = POINTS * (1.0, 1.3, 0.7) + (0.2, -0.1, 0.4)
SIZE = np.ptp(POINTS, axis=0).max()
pytestmark = pytest.mark.usefixtures("few_distances")


def surface(factor, shift):
    return surface_from_arrays(factor * (POINTS + shift * SIZE), FACES)


def figures(given):
    """Verdict, one-to-one, ARAP at volume 1, and the relative errors of the default problem."""
    config = shortened(iga_nn.preset("fast")).with_control_points(8)
    result = iga_nn.parameterize(given, config, seed=3, device="cpu")
    report = iga_nn.solve(result.volume, iga_nn.Poisson(), refine=0).report
    arap = result.quality.arap.unit_volume
    verdicts = (result.certificate.verdict, result.quality.boundary_check.injective)
    return verdicts, (arap.mean, arap.max, report.l2_relative, report.h1_relative)


@pytest.fixture(scope="module")
def as_given():
    return figures(surface(1.0, 0.0))


@pytest.mark.parametrize(("factor", "shift"), [(1e-3, 0.0), (1e3, 0.0), (1.0, FAR)])
def test_unit_and_place_change_no_figure(as_given, factor, shift):
    verdicts, numbers = figures(surface(factor, shift))
    assert verdicts == as_given[0]
    assert numbers == pytest.approx(as_given[1], rel=1e-6)


def test_the_placed_surface_has_the_same_bits_in_any_unit():
    placed = surface(1.0, 0.0).unit_vertices
    for factor in (25.4, 1e-3, 1e3, 1e9):
        assert np.array_equal(surface(factor, 0.0).unit_vertices, placed)


def test_far_away_the_digits_that_are_lost_move_a_vertex_by_one_rounding_at_most():
    """A coordinate 1e4 sizes away has lost 4 digits; one that lies between two roundings may then fall either way."""
    placed = surface(1.0, 0.0).unit_vertices
    for shift in (1e3, FAR, 1e5):
        moved = np.abs(surface(1.0, shift).unit_vertices - placed)
        assert moved.max() <= SINGLE
        assert np.count_nonzero(moved) < 0.01 * moved.size


def test_rounding_moves_no_vertex_by_more_than_half_of_single_precision():
    given = surface(1e3, 5.0)
    moved = np.abs(given.to_unit(given.vertices) - given.unit_vertices).max()
    assert 0.0 < moved <= 0.51 * SINGLE
