"""Loads and supports that are stated in total: their resultants are exact, whatever the quadrature."""

from __future__ import annotations

import re

import numpy as np
import pytest
from bodies import exact_ring

import iga_nn
from solve import benchmark_volume

HELD = {"fix": "nz < -0.9"}
BORE = "x*x+y*y < 1.1 and nz*nz < 0.1"
QUICK = {"estimate": False}


def balance(body, **data):
    """The balance of a body that is held at its bottom, and solved coarsely."""
    return iga_nn.solve(body, iga_nn.Elasticity(**HELD, **data), **QUICK).report.balance


@pytest.mark.parametrize("region", ["nz > 0.9", "nz > 0.9 and x > 0.3", "nx > 0.2 and x*x+y*y > 3"])
def test_the_resultant_of_a_load_in_total_is_exact_on_regions_of_several_patches(region):
    force, moment, point = np.array([1.0, -2.0, 500.0]), np.array([3.0, 4.0, -20.0]), np.array([7.0, 8.0, 9.0])
    found = balance(exact_ring(), moment={region: moment}, remote_force={region: (force, point)})
    np.testing.assert_allclose(found.load, force, atol=1e-10 * 500)
    assert found.imbalance < 1e-8
    np.testing.assert_allclose(found.moments.load, moment + np.cross(point, force), atol=1e-10 * 5000)


def test_a_force_in_total_is_a_constant_force_per_area():
    body = benchmark_volume(2)
    area = iga_nn.integrate(body, over="u1")
    one = iga_nn.solve(body, iga_nn.Elasticity(fix="u0", total_force={"u1": (0, 0, 2)}), **QUICK)
    other = iga_nn.solve(body, iga_nn.Elasticity(fix="u0", load={"u1": (0, 0, 2 / area)}), **QUICK)
    np.testing.assert_allclose(one.report.balance.load, [0.0, 0.0, 2.0], atol=2e-10)
    np.testing.assert_allclose(one([[1.0, 0.5, 0.5]]), other([[1.0, 0.5, 0.5]]), rtol=1e-4)  # of the areas' quadratures


def test_a_bearing_presses_the_half_of_a_bore_that_its_force_points_to():
    problem = iga_nn.Elasticity(**HELD, bearing={BORE: (0, -3, 0)})
    system = iga_nn.discretize(exact_ring(), problem)
    angle = np.linspace(0.0, 2.0 * np.pi, 9)
    x = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle + 0.5])
    normal = np.stack([-np.cos(angle), -np.sin(angle), 0.0 * angle])
    traction = system.problem.conditions[1].flux_at(None, x, normal)
    pressure = np.maximum(-np.sin(angle), 0.0) * 2.0 * 3.0 / np.pi  # 2 F / (pi R h)
    np.testing.assert_allclose(traction, -pressure * normal, atol=1e-3)
    np.testing.assert_allclose(system.solve(estimate=False).report.balance.load, [0.0, -3.0, 0.0], atol=3e-10)


def test_a_bearing_carries_any_force_across_its_axis_and_none_along_it():
    slanted = (1.0, -2.0, 0.01)
    np.testing.assert_allclose(balance(exact_ring(), bearing={BORE: slanted}).load, slanted, atol=3e-10)
    with pytest.raises(ValueError, match="pressure on this region cannot carry 100% of the force 0;0;1: a bore"):
        balance(exact_ring(), bearing={BORE: (0, 0, 1)})


def test_a_moment_turns_a_round_shaft_as_saint_venant_says():
    moment, young, ratio = 20.0, 1000.0, 0.3
    shaft = iga_nn.Elasticity(**HELD, moment={"nz > 0.9": (0, 0, moment)}, young=young, poisson_ratio=ratio)
    solution = iga_nn.solve(exact_ring(), shaft, degree=3, refine=1, **QUICK)
    polar, shear = np.pi / 2.0 * (2.0**4 - 1.0), young / (2.0 * (1.0 + ratio))
    turn = moment * 1.0 / (shear * polar)
    place = np.array([[1.0, 0.0, 1.0]])  # of the first patch, at x = 2
    assert solution.field.patches[0](place)[0, 1] == pytest.approx(2.0 * turn, rel=1e-3)


def test_a_spring_in_total_gives_way_by_the_force_over_its_stiffness():
    springs = iga_nn.Elasticity(total_spring={"u0": 50}, total_force={"u1": (0, 0, 0), "u0": (3, 0, 0)}, young=1e3)
    solution = iga_nn.solve(benchmark_volume(2), springs, tolerance=1e-12, **QUICK)
    np.testing.assert_allclose(solution([[0.5, 0.5, 0.5]])[0, 0], 3.0 / 50.0, rtol=1e-8)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({"moment": {"u1": (1, 2)}}, "moment 'u1' must have three entries, such as (0, 0, -500), got (1, 2)"),
        ({"moment": {"u1": ("x", 0, 0)}}, "must be a finite number, the same at all points, got 'x'"),
        ({"remote_force": {"u1": (1, 2, 3)}}, "remote force 'u1': give a vector and a point"),
        ({"total_spring": {"u1": "x"}}, "total spring 'u1' must be a finite number"),
        ({"total_force": {"u0": (0, 0, 1)}}, "total force 'u0' acts where fix 'u0' holds the body"),
        ({"total_force": {"x > 9": (0, 0, 1)}}, "total force 'x > 9': no part of the boundary lies there"),
    ],
)
def test_what_no_region_carries_is_refused(data, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        iga_nn.solve(benchmark_volume(2), iga_nn.Elasticity(fix="u0", **data))


def test_asks_have_intervals_under_loads_in_total():
    body = iga_nn.Elasticity(fix="u0", moment={"u1": (0, 0, 1)}, total_force={"u1": (0, 0, 1)})
    coarse = iga_nn.solve(benchmark_volume(2), body, ask=["uz at (0.5, 0.5, 0.5)", "reaction z of u0"])
    fine = iga_nn.solve(benchmark_volume(2), body, degree=3, refine=1, ask="uz at (0.5, 0.5, 0.5)")
    answer, reaction = coarse.report.asked
    assert answer.lower <= fine.report.asked[0].value <= answer.upper
    assert reaction.value == pytest.approx(-1.0, abs=1e-8)
