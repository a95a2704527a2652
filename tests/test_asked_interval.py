"""Intervals of asked quantities beside their true values."""

import numpy as np
import pytest
from cube_grids import glued, two

import iga_nn
from iga_nn import Elasticity, Poisson
from solve import benchmark_volume
from solve.asked import interval, raised


def asked(body, problem, ask, **how):
    return iga_nn.solve(body, problem, ask=ask, estimate=False, threads=1, **how).report.asked


def holds(answer, truth):
    return answer.lower <= truth <= answer.upper


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("body", ["cube", "two"])
def test_intervals_hold_the_values_of_a_smooth_solution(body, degree):
    volume = benchmark_volume(3, degree) if body == "cube" else two(2, degree)
    ask = ["u at (0.4, 0.5, 0.6)", "gradient_x at (0.7, 0.3, 0.6)", "gradient_y at (0.7, 0.3, 0.6)"]
    answers = asked(volume, Poisson(exact="exp(x)*sin(y)+z"), ask)
    wave, x, y = np.exp(0.7), 0.7, 0.3
    truths = np.exp(0.4) * np.sin(0.5) + 0.6, wave * np.sin(y), np.exp(x) * np.cos(y)
    for answer, truth in zip(answers, truths, strict=True):
        assert holds(answer, truth) and answer.width < 0.1
        assert answer.upper - answer.value == pytest.approx(sum(answer.parts.values()))


@pytest.mark.parametrize("degree", [2, 3])
def test_an_interval_holds_the_energy_at_a_reentrant_edge(degree):
    """u = r^(2/3) sin(2 t / 3) on three blocks: 0.91813 from degree 5 on spans graded to the edge."""

    def exact(x, y, z):
        angle = np.arctan2(y - 1.0, x - 1.0)
        angle = np.clip(np.where(angle <= 1e-14, angle + 2 * np.pi, angle) - np.pi / 2, 0.0, 1.5 * np.pi)
        return ((x - 1.0) ** 2 + (y - 1.0) ** 2) ** (1 / 3) * np.sin(2 * angle / 3)

    body = glued([(0, 0, 0), (1, 0, 0), (0, 1, 0)], 2, degree)
    problem = Poisson(exact=exact, source="0", boundary=exact)
    for answer, truth in zip(asked(body, problem, ["energy", "mean u"]), (0.91813, 0.527975), strict=True):
        assert holds(answer, truth)
        assert answer.upper - answer.value < 3.0 * abs(truth - answer.value)


@pytest.mark.slow
def test_ends_are_not_divided_where_this_costs_much(monkeypatch):
    monkeypatch.setattr(raised, "FEW", 0)
    bar = Elasticity(fix="p0_u0", load={"p1_u1": (0, 0, -1)})
    answer, reaction = asked(two(1, 2), bar, ["uz at (2, 0.5, 0.5)", "reaction z of p0_u0"])
    assert "solution of degree 3 adds" in answer.why
    assert reaction.value == pytest.approx(1.0) and reaction.width < 1e-6  # it balances the load


def test_a_held_region_that_ends_inside_of_a_face_widens():
    for region, wider in (("x < 1e-6", "1.5 times"), ("x < 1e-6 and y < 0.4", "5 times")):
        problem = Poisson(source="1", conditions=[iga_nn.Value(region)])
        (answer,) = asked(two(2, 2), problem, "u at (1.2, 0.5, 0.5)")
        assert answer.why.startswith(wider) and ("inside of a face" in answer.why) == (wider == "5 times")


def test_a_solution_that_is_even_across_one_span():
    """Degree 3 adds nothing to u = z (1 - z) s(x, y) across one span that degree 2 does not have; half a span does."""
    plate = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), (6, 6, 3), 2)
    (answer,) = asked(plate, Poisson(exact="cos(3*(z-0.5))"), "u at (0.5, 0.5, 0.5)")
    assert holds(answer, 1.0) and answer.value != pytest.approx(1.0, abs=1e-3)


def test_a_peak_that_the_raised_solution_does_not_confirm(monkeypatch):
    monkeypatch.setattr(interval, "CONFIRMED", 1e-6)
    (answer,) = asked(benchmark_volume(2, 2), Poisson(exact="exp(x)*sin(y)+z"), "gradient_z max")
    assert "does not confirm the solution's own" in answer.why and answer.value == pytest.approx(1.0, abs=0.02)


def test_no_interval_is_explained():
    (answer,) = asked(benchmark_volume(2), Poisson(source="1"), "u at (0.5, 0.5, 0.5)", max_iterations=1)
    assert answer.lower is None and answer.why == "not estimated: the iteration did not converge"
    (answer,) = asked(benchmark_volume(1, 2), Poisson(source="1"), "u at (0.5, 0.5, 0.5)", degree=8)
    assert answer.why == "not estimated: degree 8 is the highest one"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("von_mises max over u0", "no sample of the boundary lies there"),
        ("von_mises at (0, 0, 0)", "near a place where it is infinite"),
        ("max von_mises over x < 1", "near a place where it is infinite"),
    ],
)
def test_near_an_infinite_stress_there_is_no_interval(text, why):
    bar = iga_nn.BSplineVolume.from_function(lambda u, v, w: (10 * u, v, w), 4)
    law = iga_nn.Elasticity(fix="u0", load={"u1": (1, 0, 0)}, poisson_ratio=0.3)
    (answer,) = iga_nn.solve(bar, law, ask=text, estimate=False).answers
    assert answer.lower is None and why in answer.why
