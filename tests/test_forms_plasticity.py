"""Plasticity: the return to the yield surface, its tangent, and numbers that are refused."""

import numpy as np
import pytest

import iga_nn

SHEAR = 80.0


class Place:
    """Points that know the history there."""

    def __init__(self, state):
        self.state = state


def law(**numbers):
    given = {"young": 200.0, "poisson_ratio": 0.25, "yield_strength": 1.0, "hardening": 10.0} | numbers
    return iga_nn.Plasticity(fix="u0", **given)


def sheared(gamma):
    grad = np.zeros((3, 3, 1, 1))
    grad[0, 1] = gamma
    return grad


def test_simple_shear_yields_at_the_yield_strength_over_the_root_of_three():
    yielding = 1.0 / np.sqrt(3.0) / SHEAR
    below = law().flux(None, sheared(0.99 * yielding), None)
    assert below[0, 1, 0, 0] == pytest.approx(0.99 / np.sqrt(3.0))
    far = law(hardening=0.0).flux(None, sheared(50.0 * yielding), None)
    assert far[0, 1, 0, 0] == pytest.approx(1.0 / np.sqrt(3.0))


def test_hardening_raises_the_stress_by_its_slope_over_the_plastic_strain():
    own, grad = law(), sheared(0.1)
    state = own.advanced(grad, None)
    stress = own.flux(None, grad, None)
    assert own.quantities["von_mises"](None, grad, None)[0, 0] == pytest.approx(1.0 + 10.0 * state[6, 0, 0])
    assert stress[0, 1, 0, 0] == pytest.approx(SHEAR * (0.1 - 2.0 * state[1, 0, 0]))
    assert state[[0, 3, 5]].sum() == pytest.approx(0.0)


def test_unloading_is_elastic():
    own = law()
    place = Place(own.advanced(sheared(0.1), None))
    before, after = (own.flux(None, sheared(gamma), place)[0, 1, 0, 0] for gamma in (0.1, 0.095))
    assert before - after == pytest.approx(SHEAR * 0.005)


def test_the_tangent_is_the_derivative_of_the_stress():
    own, rng = law(), np.random.default_rng(0)
    place = Place(own.advanced(0.02 * rng.standard_normal((3, 3, 2, 4)), None))
    grad, by = 0.02 * rng.standard_normal((2, 3, 3, 2, 4))
    tangent = own.tangent(None, grad, place)[:, 1:, :, 1:]
    wanted = (own.flux(None, grad + 1e-6 * by, place) - own.flux(None, grad - 1e-6 * by, place)) / 2e-6
    assert np.allclose(np.einsum("aibj...,bj...->ai...", tangent, by), wanted, rtol=1e-6, atol=1e-6)
    assert np.allclose(tangent, tangent.transpose(2, 3, 0, 1, 4, 5))


@pytest.mark.parametrize(
    ("numbers", "says"),
    [
        ({"young": 0.0}, "young must be positive, got 0"),
        ({"poisson_ratio": 0.5}, "poisson_ratio must lie between -1 and 1/2, got 0.5"),
        ({"yield_strength": -1.0}, "yield_strength must be positive, got -1"),
        ({"hardening": -1.0}, "hardening must be zero or more, got -1"),
        ({"hardening": "steel"}, "hardening must be a number, got 'steel'"),
    ],
)
def test_numbers_out_of_range_are_refused(numbers, says):
    with pytest.raises(ValueError, match=says):
        law(**numbers)


def test_a_body_that_nothing_holds_is_refused():
    with pytest.raises(ValueError, match="nothing holds the body"):
        iga_nn.Plasticity()
    with pytest.raises(ValueError, match="nothing holds the body"):
        iga_nn.Plasticity(load={"u1": (1, 0, 0)}).demand_held()
