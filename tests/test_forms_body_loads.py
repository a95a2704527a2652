"""Fluids, foundations, turns, and the forces of a body's mass: cases of textbooks."""

from __future__ import annotations

import numpy as np
import pytest

import iga_nn
from iga_nn.errors import InputError
from iga_nn.options import ElasticityOptions

EXACTLY = {"tolerance": 1e-13, "estimate": False}
PLANES = ["nx < -0.99", "ny < -0.99", "nz < -0.99"]


def box(x, y, z, control_points=5):
    """A box from the origin."""
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (x * u, y * v, z * w), control_points)


def test_a_wall_holds_a_fluid_whose_resultant_acts_a_third_above_the_ground():
    weight, height, width = 9.81e-6, 30.0, 20.0
    law = iga_nn.Elasticity(fix="nz < -0.9", hydrostatic={"nx < -0.9": ((0, 0, -weight), (0, 0, height))})
    balance = iga_nn.solve(box(2.0, width, height), law, **EXACTLY).report.balance
    resultant = weight * height**2 / 2.0 * width
    np.testing.assert_allclose(balance.load, [resultant, 0.0, 0.0], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(balance.moments.load[1] / resultant, height / 3.0, rtol=1e-10)


def test_a_fluid_presses_nothing_above_its_surface():
    law = iga_nn.Elasticity(fix="nz < -0.9", hydrostatic={"nx < -0.9": ((0, 0, -1), (0, 0, 1))})
    load = iga_nn.solve(box(1.0, 1.0, 2.0), law, **EXACTLY).report.balance.load
    assert load[0] == pytest.approx(0.5, rel=1e-2)  # the pressure bends inside of spans


def test_a_hanging_bar_under_its_own_weight():
    length, young, density, gravity = 4.0, 1000.0, 2.0, 10.0
    law = iga_nn.Elasticity(
        roller=PLANES, young=young, poisson_ratio=0.0, density=density, gravity=(gravity, 0, 0), acceleration=(-1, 0, 0)
    )
    solution = iga_nn.solve(box(length, 1.0, 1.0), law, **EXACTLY)
    weight = density * (gravity + 1.0)
    tip, top = [[1.0, 0.5, 0.5]], [[0.0, 0.5, 0.5]]
    np.testing.assert_allclose(solution(tip)[0, 0], weight * length**2 / (2.0 * young), rtol=1e-9)
    np.testing.assert_allclose(solution.quantity("stress", top)[0, 0, 0], weight * length, rtol=1e-9)
    np.testing.assert_allclose(solution.report.balance.load, [weight * length, 0.0, 0.0], atol=1e-9)


def test_a_bar_that_spins_about_its_end():
    length, young, density, speed = 3.0, 1000.0, 2.0, 5.0
    law = iga_nn.Elasticity(
        roller=PLANES, young=young, poisson_ratio=0.0, density=density, spin=((0, 0, speed), (0, 0, 0))
    )
    solution = iga_nn.solve(box(length, 0.1, 0.1), law, **EXACTLY)
    pull = density * speed**2
    np.testing.assert_allclose(solution([[1.0, 0.5, 0.5]])[0, 0], pull * length**3 / (3.0 * young), rtol=1e-9)
    middle = solution.quantity("stress", [[0.5, 0.5, 0.5]])[0, 0, 0]
    np.testing.assert_allclose(middle, pull * (length**2 - (length / 2.0) ** 2) / 2.0, rtol=1e-8)


def test_a_block_sinks_into_its_foundation():
    law = iga_nn.Elasticity(
        foundation={"nz < -0.9": 4.0}, roller=PLANES[:2], pressure={"nz > 0.9": 2.0}, young=100.0, poisson_ratio=0.0
    )
    solution = iga_nn.solve(box(1.0, 1.0, 3.0), law, **EXACTLY)
    np.testing.assert_allclose(solution([[0.5, 0.5, 0.0]])[0, 2], -2.0 / 4.0, rtol=1e-9)
    np.testing.assert_allclose(solution([[0.5, 0.5, 1.0]])[0, 2], -2.0 / 4.0 - 2.0 * 3.0 / 100.0, rtol=1e-9)


def test_a_foundation_lets_a_body_slide():
    law = iga_nn.Elasticity(foundation={"nz < -0.9": 4.0}, load={"nz > 0.9": (1, 0, 0)})
    with pytest.raises(ValueError, match="the supports leave the body free to move"):
        iga_nn.solve(box(1.0, 1.0, 1.0), law)


def test_a_turned_end_moves_as_a_rigid_body():
    turned = iga_nn.Elasticity(fix="u0", turn={"u1": ((0.01, 0, 0), (0, 0.5, 0.5))}, young=2.6, poisson_ratio=0.3)
    solution = iga_nn.solve(box(4.0, 1.0, 1.0), turned, **EXACTLY)
    np.testing.assert_allclose(solution([[1.0, 1.0, 0.5]]), [[0.0, 0.0, 0.005]], atol=1e-12)
    moments = solution.report.balance.moments.reactions
    assert moments["turn 'u1'"][0] == pytest.approx(-moments["fix 'u0'"][0]) and moments["turn 'u1'"][0] > 0.0


def test_densities_by_solid_and_forces_by_formula_add_up():
    options = ElasticityOptions(body_force="x;0;0", density="p0: 1, p1: 2", gravity="0;0;-10", fix=("u0",))
    source = options.of_body()["body_force"]
    assert sorted(source) == [0, 1] and source[1][0].startswith("(x)+(2.0)*(")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"gravity": "0;0;-10"}, "gravity: give the density of the body, too"),
        ({"gravity": "0;0;-10", "density": -1.0}, "density must not be negative, got -1"),
        ({"gravity": "0;x;-10", "density": 1.0}, "gravity must be a finite number, the same at all points, got 'x'"),
        ({"gravity": "0;0;1", "density": 1.0, "exact": "x;0;0"}, "the force per volume follows from the exact"),
        ({"spin": "0;0;10", "density": 1.0}, "--spin '0;0;10': write a vector and a point, such as"),
        ({"remote_force": ("u1=0;0;1",)}, "--remote-force '0;0;1': write a vector and a point, such as"),
        ({"total_force": ("u1=1",)}, "--total-force '1': write three formulas with semicolons"),
        ({"moment": ("u1=1;0;inf",)}, "inf"),
    ],
)
def test_a_refusal_says_what_to_write(given, said):
    with pytest.raises(InputError, match=said):
        ElasticityOptions(fix=("u0",), **given).problem()
