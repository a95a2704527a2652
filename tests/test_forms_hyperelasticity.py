"""Hyperelastic laws: the stress as the derivative of the energy, tension and shear by hand, and refusals."""

import numpy as np
import pytest

import iga_nn

BULK = 30.0
LAWS = {
    "neo-Hooke": (iga_nn.NeoHookean(shear=0.8, bulk=BULK, fix="u0"), lambda a, b: 0.4 * a),
    "Mooney": (iga_nn.MooneyRivlin(c10=0.3, c01=0.2, bulk=BULK, fix="u0"), lambda a, b: 0.3 * a + 0.2 * b),
    "Yeoh": (
        iga_nn.Yeoh(c10=0.4, c20=-0.02, c30=0.01, bulk=BULK, fix="u0"),
        lambda a, b: 0.4 * a - 0.02 * a**2 + 0.01 * a**3,
    ),
}


def energy(of_invariants, f):
    det, right = np.linalg.det(f), f.T @ f
    first = det ** (-2 / 3) * np.trace(right)
    second = det ** (-4 / 3) * 0.5 * (np.trace(right) ** 2 - np.trace(right @ right))
    return of_invariants(first - 3.0, second - 3.0) + 0.5 * BULK * (det - 1.0) ** 2


@pytest.mark.parametrize("name", LAWS)
def test_the_stress_is_the_derivative_of_the_energy(name):
    law, of_invariants = LAWS[name]
    grad = 0.3 * np.random.default_rng(1).standard_normal((3, 3))
    stress = law.flux(None, grad[:, :, None], None)[:, :, 0]
    for i in range(3):
        for j in range(3):
            by = np.zeros((3, 3))
            by[i, j] = 1e-6
            high, low = (energy(of_invariants, np.eye(3) + grad + sign * by) for sign in (1.0, -1.0))
            assert stress[i, j] == pytest.approx((high - low) / 2e-6, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("name", LAWS)
def test_small_strains_are_those_of_its_moduli(name):
    law, _ = LAWS[name]
    grad = np.zeros((3, 3, 1))
    grad[0, 1], grad[2, 2] = 1e-6, 2e-6
    stress = law.flux(None, grad, None)[:, :, 0] / 1e-6
    assert stress[0, 1] == pytest.approx(law.shear_at_rest, rel=1e-4)
    assert stress[2, 2] == pytest.approx(2.0 * BULK + 8.0 / 3.0 * law.shear_at_rest, rel=1e-4)


@pytest.mark.parametrize("name", LAWS)
def test_simple_shear_keeps_the_volume_and_is_that_of_the_book(name):
    """In shear gamma, tau = 2 (w1 + w2) gamma for i1 = i2 = 3 + gamma^2, of any of these laws."""
    law, _ = LAWS[name]
    grad = np.zeros((3, 3, 1))
    grad[0, 1] = 0.9
    one, two = law.slopes(0.81, 0.81)
    assert law.quantities["stress"](None, grad, None)[0, 1, 0] == pytest.approx(2.0 * (one + two) * 0.9)
    assert law.quantities["volume_ratio"](None, grad, None)[0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: iga_nn.NeoHookean(shear=-1.0, fix="u0"), "the shear modulus at rest must be positive, it is -1"),
        (lambda: iga_nn.MooneyRivlin(c10=0.1, c01=-0.1, fix="u0"), "must be positive, it is 0 for c10 0.1, c01 -0.1"),
        (lambda: iga_nn.Yeoh(c10=1.0, bulk=0.0, fix="u0"), "bulk must be positive, got 0"),
    ],
)
def test_numbers_out_of_range_are_refused(make, says):
    with pytest.raises(ValueError, match=says):
        make()
