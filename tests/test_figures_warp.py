"""The factor of displacements, and the body that is drawn with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import iga_nn
import solve
from iga_nn.figures import fields
from iga_nn.figures import render as rendering
from iga_nn.figures.fields import factor_for, warp_of
from iga_nn.figures.solution import draw_solution, factor_in_words, moved_by
from solve.study import benchmark_volume


def test_factors_are_round_and_show_the_largest_displacement_at_5_to_8_percent():
    assert [factor_for(100.0, largest) for largest in (1.0, 8.0, 0.09, 5e-7, 700.0)] == pytest.approx(
        [8.0, 1.0, 80.0, 1.5e7, 0.01]
    )
    for largest in np.geomspace(1e-9, 1e9, 500):
        assert 8.0 / 1.51 <= factor_for(100.0, largest) * largest <= 8.0 * (1 + 1e-9)
    assert factor_for(1.0, 0.0) == factor_for(1.0, np.inf) == 0.0
    assert [factor_in_words(factor) for factor in (0.1, 1.5, 300.0, 1.5e7)] == ["0.1", "1.5", "300", "1.5e+07"]


@pytest.fixture(scope="module")
def stretched():
    """A bar 4 long whose end moves by 0.04."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 4)] * 3, indexing="ij"), axis=-1)
    bar = iga_nn.BSplineVolume.uniform(grid * [4, 1, 1])
    return bar, solve.solve_problem(bar, solve.Elasticity(exact=("x/100", "0", "0"), young=100.0, poisson_ratio=0.25))


def test_a_body_is_deformed_and_a_temperature_is_not(stretched):
    bar, body = stretched
    points = fields.points_of(bar)
    assert points.diagonal == pytest.approx(18**0.5)
    assert warp_of(body, 18**0.5) == 8.0 and warp_of(body.field, 18**0.5) == 8.0
    end = moved_by(points, body, 8.0).planes[1]
    assert end[..., 0] == pytest.approx(4.0 + 8 * 0.04, abs=1e-6)
    assert warp_of(solve.solve_problem(bar, solve.Poisson(exact="x")), 1.0) == 0.0


def test_the_solution_of_a_body_is_its_stress(stretched):
    """Strain 0.01 along x alone, lambda = mu = 40: the stress is diag(1.2, 0.4, 0.4), von Mises' 0.8."""
    stress = fields.fields_of(stretched[1])[0]
    assert stress.name == "von Mises" and np.abs(stress.lattices[0] - 0.8).max() < 1e-6
    if not rendering.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {rendering.REMEDY}")
    figure = draw_solution(None, *stretched)
    assert figure.axes[-1].get_ylabel() == "von Mises stress"
    assert figure.get_suptitle() == "The deformed body: displacements, at most 0.04, are drawn 8 times as large"


def test_a_stress_that_is_not_finite_is_left_out(stretched):
    """A volume that is collapsed where u = 0 has det J = 0 there."""
    volume = benchmark_volume(1, amplitude=0.0)
    net = volume.control_points.copy()
    net[0] = net[0, 0, 0]
    collapsed = replace(stretched[1].only, geometry=replace(volume, control_points=net))
    assert [field.name for field in fields.fields_of(collapsed)] == ["|u|", "u_x", "u_y", "u_z"]
