"""Numbers that mean nothing are said: formulas that do not vary on the domain, solutions the mesh does not resolve."""

import numpy as np
import pytest

from solve import Elasticity, Poisson, benchmark_volume, solve_elasticity, solve_poisson
from solve.forms.formula import ExpressionError

UNIT = benchmark_volume(3)
MILLIMETRES = UNIT.transformed(430.0, [-564.0, -300.0, -564.0])
WIDE = UNIT.transformed(120.0, [-60.0, -60.0, -60.0])


def said(volume, problem):
    report = solve_poisson(volume, problem).report
    return report, " ".join(report.notices)


def test_an_exact_solution_that_underflows_is_named_with_its_range_and_the_way_out():
    report, notices = said(MILLIMETRES, Poisson(exact="exp(x+z-800)*sin(y)"))
    assert not report.meaningful and not report.as_dict()["meaningful"]
    assert "'exp(x+z-800)*sin(y)' runs from" in notices and "underflows" in notices
    assert "try 'exp(X+Z-800)*sin(Y)'" in notices


@pytest.mark.parametrize(
    "data",
    [
        {"exact": "1e9+1e-9*x"},
        {"source": "exp(-x*x)", "boundary": "0"},
        {"source": "1", "kappa": "1+1e-20*x"},
        {"source": "1", "reaction": "1+1e-20*x"},
        {"source": "1", "robin": {"u0": ("1+1e-20*x", "1")}},
        {"source": "1", "neumann": {"u0": "1+1e-20*x"}},
        {"source": "1", "boundary": "1+1e-20*x"},
    ],
    ids=lambda data: next(reversed(data)),
)
def test_data_that_do_not_vary_are_named(data):
    report, notices = said(MILLIMETRES, Poisson(**data))
    assert not report.meaningful
    assert "means nothing here" in notices


def test_an_exact_solution_that_the_mesh_does_not_resolve_is_named():
    report, notices = said(WIDE, Poisson(exact="exp(x+z)*sin(y)"))
    assert report.l2_relative > 0.5 and not report.meaningful
    assert "do not resolve it" in notices and "relative L2 error is" in notices and "exp(X+Z)*sin(Y)" in notices


@pytest.mark.parametrize(
    "data",
    [
        {},
        {"exact": "3"},
        {"exact": "x"},
        {"source": "0", "boundary": "x"},
        {"exact": "x*x", "kappa": ["1", "0", "0", "1", "0", "1"]},
    ],
)
def test_data_that_mean_something_are_not_doubted(data):
    for volume in (UNIT, MILLIMETRES):
        report, notices = said(volume, Poisson(**data))
        assert report.meaningful and notices == ""


def test_a_vector_that_underflows_is_named():
    body = Elasticity(exact=("exp(x-900)", "0", "0"))
    report = solve_elasticity(MILLIMETRES, body).report
    assert not report.meaningful and "exact 'exp(x-900)'" in report.notices[0]


def test_values_that_are_not_finite_are_refused_with_their_range_and_the_way_out():
    with pytest.raises(ExpressionError, match=r"elsewhere it runs from .* try 'exp\(9\*X\)'"):
        solve_poisson(WIDE, Poisson(source="exp(9*x)"))
    with pytest.raises(ExpressionError, match=r"exceeds 1e\+100 .* try '1e99\*X'"):
        solve_poisson(MILLIMETRES, Poisson(source="1e99*x"))
    with np.errstate(all="ignore"), pytest.raises(ExpressionError, match="not finite") as refused:
        solve_poisson(UNIT, Poisson(source=lambda x, y, z: np.log(x - 1e6)))
    assert "try" not in str(refused.value)
