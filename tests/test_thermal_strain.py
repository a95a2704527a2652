"""Tests thermal strain: bars that are held and free, a strip of two metals, and what is asked of them."""

import numpy as np
import pytest

import iga_nn
from solve import benchmark_volume

YOUNG, EXPANSION, RISE = 210000.0, 12e-6, 100.0
STEEL = {"young": YOUNG, "poisson_ratio": 0.3, "expansion": EXPANSION}
ROLLERS = ("u0", "v0", "w0")
CARBON = {
    "young": (126.0, 11.0, 11.0),
    "poisson_ratio": (0.28, 0.28, 0.4),
    "shear_modulus": (6.6, 6.6, 11.0 / 2.8),
    "expansion": (-1e-3, 26e-3, 26e-3),
}


def bar(length=4.0, height=1.0, base=0.0):
    corners = [[[[length * i, j, base + height * k] for k in (0, 1)] for j in (0, 1)] for i in (0, 1)]
    return iga_nn.BSplineVolume.uniform(corners, degree=1)


def solved(volume, how=None, **law):
    return iga_nn.solve(volume, iga_nn.Elasticity(**{**STEEL, **law}), **{"degree": 2, **(how or {})})


def test_a_free_bar_grows_without_stress():
    found = solved(bar(), temperature_change=RISE, roller=ROLLERS)
    assert np.allclose(found.field([[1, 1, 1]]), [EXPANSION * RISE * np.array([4, 1, 1])], rtol=1e-9)
    assert np.abs(found.quantity("stress", [[0.3, 0.4, 0.5]])).max() < 1e-6


@pytest.mark.parametrize("formulation", ["displacement", "mixed"])
def test_a_held_bar_has_the_stress_of_its_strain(formulation):
    how = {"formulation": formulation, "ask": ["energy", "stress_xx at (1, 0.5, 0.5)", "reaction x of u1"]}
    found = solved(bar(), how, temperature_change=RISE, roller=("u0", "u1", "v0", "w0"))
    stress = -YOUNG * EXPANSION * RISE
    assert np.allclose(found.quantity("stress", [[0.3, 0.4, 0.5]])[0, 0, 0], stress, rtol=1e-8)
    energy, pointwise, reaction = (one.value for one in found.answers)
    assert np.allclose([pointwise, reaction], [stress, stress], rtol=1e-8)
    assert np.isclose(energy, 0.5 * stress**2 / YOUNG * 4.0, rtol=1e-8)
    assert found.report.balance.imbalance < 1e-8


def test_held_faces_of_the_cube_answer_like_regions():
    strong = solved(bar(), temperature_change=RISE, displacement=(0, 0, 0))
    weak = solved(bar(), temperature_change=RISE, fix=("u0", "u1", "v0", "v1", "w0", "w1"))
    pressure = YOUNG * EXPANSION * RISE / (1 - 2 * 0.3)
    for found in (strong, weak):
        assert np.isclose(found.quantity("pressure", [[0.3, 0.4, 0.5]])[0], pressure, rtol=1e-8)
    assert np.isclose(strong.report.balance.reactions["u1"][0], -pressure, rtol=1e-8)
    assert np.isclose(weak.report.balance.reactions["fix 'u1'"][0], -pressure, rtol=1e-8)


@pytest.mark.parametrize("axes", [{}, {"first_axis": ("1+y", "1-x", "1")}])
def test_an_exact_solution_with_a_temperature_is_found_and_its_error_estimated(axes):
    body = {**CARBON, **axes, "exact": ("x*x*y+sin(z)", "y*z*x", "z*x*x"), "temperature_change": "1+x*y+z*z"}
    report = iga_nn.solve(benchmark_volume(3), iga_nn.Elasticity(**body), estimate=True).report
    assert report.errors.l2_relative < 1e-3
    assert 0.5 < report.estimate.l2_relative / report.errors.l2_relative < 20.0


def test_a_strip_of_two_metals_bends_as_timoshenko_says():
    """Compare with 1/r = 6 (a2 - a1) T (1+m)^2 / (h (3 (1+m)^2 + (1 + m n) (m^2 + 1/(m n)))), m = 1, n = 1/2.

    S. Timoshenko, Analysis of Bi-metal Thermostats, J. Opt. Soc. Am. 11 (1925) 233.
    """
    strip = iga_nn.Body.from_patches([bar(12.0), bar(12.0, base=1.0)])
    body = iga_nn.Elasticity(
        young={0: 100.0, 1: 200.0},
        poisson_ratio=0.0,
        expansion={0: 2e-5, 1: 1e-5},
        temperature_change=RISE,
        roller=("u0", "p0_v0", "p1_v0"),
        spring={"w0 and x < 1": "1e-3"},
    )
    field = iga_nn.solve(strip, body, degree=3, refine=2).field
    left, middle, right = field.probe([[x, 0.5, 1.0] for x in (0, 2, 4)])[:, 2]
    curvature = 6 * 1e-5 * RISE * 4 / (2 * (3 * 4 + (1 + 0.5) * (1 + 2)))
    assert np.isclose((right - 2 * middle + left) / 2.0**2, curvature, rtol=3e-3)


def test_a_temperature_may_be_the_solution_of_a_heat_problem():
    volume = bar()
    heat = iga_nn.solve(volume, iga_nn.Poisson(value={"u0": "0", "u1": "100"}), degree=2)
    found = solved(volume, temperature_change=heat.field, roller=ROLLERS)
    same = solved(volume, temperature_change="25*x", roller=ROLLERS)
    assert np.allclose(found.field.coefficients, same.field.coefficients, rtol=1e-6)


def test_a_temperature_without_an_expansion_is_refused():
    with pytest.raises(ValueError, match="give expansion=12e-6"):
        iga_nn.Elasticity(temperature_change=20.0, fix="u0")
    with pytest.raises(ValueError, match="material and young: give one of them"):
        iga_nn.Elasticity(material="steel", young=210.0, fix="u0")


def test_the_safety_is_the_yield_strength_over_the_stress():
    found = iga_nn.solve(bar(), iga_nn.Elasticity(material="steel", load={"u1": (47, 0, 0)}, roller=ROLLERS), degree=2)
    assert np.isclose(found.quantity("safety", [[0.5, 0.5, 0.5]])[0], 5.0)
    assert np.isclose(found.extremes("safety").least, 5.0, rtol=1e-6)


def test_newton_finds_the_same_but_for_what_its_supports_give_way():
    body = iga_nn.Elasticity(**STEEL, temperature_change=RISE, roller=("u0", "u1", "v0", "w0"))
    stress = iga_nn.newton(bar(), body, degree=2).quantity("stress", [[0.5, 0.5, 0.5]])[0, 0, 0]
    assert np.isclose(stress, -YOUNG * EXPANSION * RISE, rtol=1e-3)


def test_thermal_strain_of_a_sector_is_refused():
    body = iga_nn.Elasticity(**STEEL, temperature_change=RISE, roller="w0", conditions=[iga_nn.Cyclic("u0", "v0", "z")])
    with pytest.raises(ValueError, match="thermal strain goes without it: solve the whole body"):
        iga_nn.solve(bar(1.0), body, degree=2)
