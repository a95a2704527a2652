"""Extremes of stresses outside of the places where they are infinite."""

import numpy as np
import pytest

import iga_nn
from parameterize.spline.volume import BSplineVolume
from solve.outside import needs_gradient

LENGTH = 8.0


@pytest.fixture(scope="module")
def shelf():
    """A beam held at one end, and bent by a force at the other: the largest stress is L F h / (2 I) = 48 at the end."""
    beam = BSplineVolume.from_function(lambda u, v, w: (LENGTH * u, v, w), (11, 4, 4))
    problem = iga_nn.Elasticity(fix="u0", load={"u1": (0, 0, -1)})
    return iga_nn.solve(beam, problem, refine=1)


def test_stress_is_that_outside_of_two_spans(shelf):
    found = shelf.extremes("von_mises")
    distance = 2.0 * LENGTH / 16
    assert (found.spans, found.radius, found.beside) == (2.0, pytest.approx(distance), True)
    assert found.largest_at[0] >= 0.96 * distance  # between two points of the rim
    assert found.largest == pytest.approx(6.0 * (LENGTH - found.largest_at[0]), rel=0.03)
    everywhere = shelf.extremes("von_mises", everywhere=True)
    assert everywhere.spans is None and everywhere.largest > found.largest and everywhere.largest_at[0] < 0.5 * distance


def test_displacements_are_looked_for_everywhere(shelf):
    names = {name: shelf.all_extremes()[name].spans for name in ("magnitude", "von_mises")}
    assert names == {"magnitude": None, "von_mises": 2.0}
    form = shelf.problem.form
    assert needs_gradient(form, lambda u, grad, x: grad[0, 0]) and not needs_gradient(form, lambda u, grad, x: u[0])


def test_on_a_coarse_mesh_the_radius_is_smaller():
    """Of one span, which ends at its own length from the rim."""
    cube = BSplineVolume.from_function(lambda u, v, w: (u, v, w), 4)
    pulled = iga_nn.solve(cube, iga_nn.Elasticity(fix="u0", load={"u1": (1, 0, 0)}))
    found = pulled.extremes("von_mises")
    assert (found.spans, found.radius) == (1.0, 1.0)
    assert not pulled.singular.is_near([found.largest_at], 1.0).any()
    held = iga_nn.solve(cube, iga_nn.Elasticity(fix="u0 or u1", body_force=(1, 0, 0)))
    assert held.extremes("von_mises").spans in (0.5, 0.0)


def test_of_a_known_solution_nothing_is_left_out():
    exact = iga_nn.Elasticity(exact=("x*y", "0", "z"), traction={"u1": None})
    found = iga_nn.solve(BSplineVolume.from_function(lambda u, v, w: (u, v, w), 4), exact)
    assert not len(found.singular) and found.extremes("von_mises").spans is None
    assert np.isfinite(found.extremes("von_mises").largest)
