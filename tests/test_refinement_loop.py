import math

import numpy as np
import pytest
from cube_grids import glued

import iga_nn
from solve import Poisson, benchmark_volume
from solve.refinement.loop import GROWTH


def around_an_edge(x, y, z):
    """r^(2/3) sin(2 t / 3): harmonic around the re-entrant edge x = y = 1 of three blocks, without flux along it."""
    angle = np.arctan2(y - 1.0, x - 1.0)
    angle = np.clip(np.where(angle <= 1e-14, angle + 2 * np.pi, angle) - np.pi / 2, 0.0, 1.5 * np.pi)
    return ((x - 1.0) ** 2 + (y - 1.0) ** 2) ** (1 / 3) * np.sin(2 * angle / 3)


def l_shape(degree=1):
    return glued([(0, 0, 0), (1, 0, 0), (0, 1, 0)], 1, degree)


def test_an_edge_is_graded_with_the_rate_of_smooth_solutions():
    """The energy's error falls like the unknowns to the power -2/2 in the plane; uniform spans would give -1/3."""
    problem = Poisson(exact=around_an_edge, source="0", boundary=around_an_edge)
    found = iga_nn.adaptive(l_shape(), problem, 0.008, degree=2)
    assert found.reached and len(found.steps) > 4
    first, last = found.steps[1], found.steps[-1]
    more = last.solution.report.dofs / first.solution.report.dofs
    assert math.log(first.energy_error / last.energy_error) / math.log(more) > 0.9
    assert math.log(first.solution.report.l2 / last.solution.report.l2) / math.log(more) > 1.2
    row = np.diff(last.grading.rows[0])
    assert row.max() / row.min() > 50  # towards the edge
    assert min(last.grading.spans) == first.grading.spans[2] == 2  # none along it


def test_steps_say_their_numbers():
    steps = []
    problem = Poisson(exact="exp(x)*sin(y)")
    found = iga_nn.adaptive(benchmark_volume(1, 2), problem, 0.01, ask="u at (0.5, 0.5, 0.5)", callback=steps.append)
    assert found.reached and tuple(steps) == found.steps
    (answer,) = found.solution.answers
    assert answer.width <= 0.01 and answer.lower <= math.exp(0.5) * math.sin(0.5) <= answer.upper
    assert found.steps[-1].excess <= 1.0 and set(found.steps[0].seconds) == {"solve", "estimate"}
    assert str(found).endswith("accuracy 1 % reached")
    dofs = [step.solution.report.dofs for step in steps]
    assert all(b < 2 * GROWTH * a for a, b in zip(dofs, dofs[1:], strict=False))


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ({"max_unknowns": 300}, "the limit of 300 unknowns"),
        ({"time_limit": 1e-9}, "the limit of 1e-09 seconds"),
        ({"max_iterations": 1}, "the linear solver did not converge in 1 iterations"),
    ],
)
def test_what_stops_a_refinement_is_said(how, why):
    problem = Poisson(exact=around_an_edge, source="0", boundary=around_an_edge)
    found = iga_nn.adaptive(l_shape(), problem, 1e-6, degree=2, **how)
    assert found.stopped == why and not found.reached
    assert str(found).endswith(f"accuracy 0.0001 % not reached: {why}")


def test_a_goal_far_from_the_edge_needs_fewer_unknowns_than_the_energy():
    problem = Poisson(exact=around_an_edge, source="0", boundary=around_an_edge)
    by_goal = iga_nn.adaptive(l_shape(), problem, 1e-3, degree=2, ask="u at (0.3, 0.3, 0.5)")
    by_energy = iga_nn.adaptive(l_shape(), problem, 1e-2, degree=2)
    assert by_goal.reached and by_energy.reached
    exact = float(around_an_edge(*np.array([0.3, 0.3, 0.5])))
    assert abs(by_goal.solution.answers[0].value - exact) < 1e-3 * exact
    assert by_goal.solution.report.dofs < by_energy.solution.report.dofs


@pytest.mark.parametrize("accuracy", [0.0, 1.0, math.nan])
def test_an_accuracy_is_a_number_between_0_and_1(accuracy):
    with pytest.raises(ValueError, match="accuracy must be a number between 0 and 1"):
        iga_nn.adaptive(benchmark_volume(1), Poisson(), accuracy)


def test_a_space_without_a_raised_one_ends_the_refinement(monkeypatch):
    problem = Poisson(exact=around_an_edge, source="0", boundary=around_an_edge)
    monkeypatch.setattr("solve.asked.raised.MOST", 1500)
    found = iga_nn.adaptive(l_shape(), problem, 1e-6, degree=2)
    assert found.stopped.startswith("the error is not estimated: the raised space has") and len(found.steps) > 1
    with pytest.raises(ValueError, match="the error is not estimated"):
        iga_nn.adaptive(l_shape(), problem, 0.1, degree=2, refine=4)
