"""Data beside an exact solution that is not theirs: said, and only then."""

import pytest

from solve import Elasticity, Poisson, benchmark_volume, solve_problem
from solve.contradiction import contradictions

VOLUME = benchmark_volume(4)
TWO_PROBLEMS = "the errors compare the solutions of two problems"


@pytest.mark.parametrize(
    ("data", "notice"),
    [
        ({"exact": "x", "source": "y"}, f"source is not that of exact: {TWO_PROBLEMS}"),
        ({"exact": "x*x", "source": "-2", "kappa": "2"}, f"source is not that of exact: {TWO_PROBLEMS}"),
        ({"exact": "x*x", "boundary": "3"}, f"boundary differs from exact: {TWO_PROBLEMS}"),
        ({"exact": "abs(x-0.5)"}, "exact contains abs"),
    ],
)
def test_data_that_contradict_the_exact_solution_are_named(data, notice):
    notices = solve_problem(VOLUME, Poisson(**data)).report.notices
    assert len(notices) == 1
    assert notices[0].startswith(notice)


def test_force_and_displacement_that_contradict_are_named():
    body = Elasticity(exact=("x*x", "y", "0"), force=("1", "0", "0"), displacement=("x", "y", "0"))
    notices = solve_problem(VOLUME, body).report.notices
    assert notices == (
        f"force is not that of exact: {TWO_PROBLEMS}",
        f"displacement differs from exact: {TWO_PROBLEMS}",
    )
    fits = Elasticity(exact=("x*x", "y", "0"), force=(str(-2.0 * 3.5 / 2.6), "0", "0"))  # -2 (lambda + 2 mu), nu = 0.3
    assert contradictions(VOLUME, fits) == ()


@pytest.mark.parametrize(
    "data",
    [
        {"exact": "exp(x)*sin(y)", "source": "0"},  # harmonic: the second derivatives cancel
        {"exact": "x*x", "source": "-4", "kappa": "2", "boundary": "x*x"},
        {"exact": "1e9*x*y*z", "source": "0"},
        {"exact": "x", "boundary": "x+7", "neumann": dict.fromkeys(("u0", "u1", "v0", "v1", "w0", "w1"))},
        {"exact": lambda x, y, z: x, "source": "1", "boundary": "x"},
        {"source": "1"},
        {"exact": "log(x-0.05)", "source": "1", "boundary": "log(abs(x-0.05))"},  # not finite where it is compared
    ],
)
def test_data_that_agree_are_not_doubted(data):
    assert contradictions(VOLUME, Poisson(**data)) == ()
