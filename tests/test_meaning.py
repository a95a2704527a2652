"""Numbers that mean nothing are said: formulas that do not vary on the domain, solutions the mesh does not resolve."""

import numpy as np
import pytest

from solve import Elasticity, Poisson, benchmark_volume, solve_problem
from solve.forms.parser import ExpressionError

UNIT = benchmark_volume(3)
MILLIMETRES = UNIT.transformed(430.0, [-564.0, -300.0, -564.0])
WIDE = UNIT.transformed(120.0, [-60.0, -60.0, -60.0])


def said(volume, problem):
    report = solve_problem(volume, problem).report
    return report, " ".join(report.notices)


def test_an_exact_solution_that_underflows_is_named_with_its_range_and_the_way_out():
    report, notices = said(MILLIMETRES, Poisson(exact="exp(x+z-800)*sin(y)"))
    assert not report.meaningful and not report.as_dict()["meaningful"]
    assert "'exp(x+z-800)*sin(y)' runs from" in notices and "underflows" in notices
    assert "try 'exp(X+Z-800)*sin(Y)'" in notices


@pytest.mark.parametrize(
    "data",
    [{"exact": "1e9+1e-9*x"}, {"source": "exp(-x*x)", "boundary": "0"}, {"source": "1", "boundary": "1+1e-20*x"}],
)
def test_data_that_do_not_vary_are_named(data):
    report, notices = said(MILLIMETRES, Poisson(**data))
    assert not report.meaningful
    assert "means nothing here" in notices


@pytest.mark.parametrize(
    "data",
    [
        {"kappa": "1+exp(-x*x)"},
        {"reaction": "1+1e-20*x"},
        {"robin": {"u0": ("1+1e-20*x", "1")}},
        {"neumann": {"u0": "1+1e-20*x"}},
    ],
)
def test_coefficients_and_fluxes_that_do_not_vary_are_named_and_the_numbers_hold(data):
    report, notices = said(MILLIMETRES, Poisson(source="1", **data))
    assert report.meaningful
    assert "means nothing here" in notices


FLUX = "exp(0-(x+134)**2)"


@pytest.mark.parametrize("data", [{"neumann": {"u0": FLUX}}, {"robin": {"u0": ("1", FLUX)}}])
def test_data_of_a_face_are_judged_there(data):
    """The flux is 1 at a corner of u1, where it does not act, and underflows on u0, where it does."""
    report, notices = said(MILLIMETRES, Poisson(source="1", **data))
    assert f"{FLUX!r} runs from 0 to 0 on face u0: it underflows" in notices and report.meaningful
    body = Elasticity(force=("0", "0", "1"), traction={"u0": (FLUX, "0", "0")})
    assert f"traction u0 {FLUX!r} runs from 0 to 0" in " ".join(solve_problem(MILLIMETRES, body).report.notices)


def test_data_may_be_constant_on_a_face_because_it_is_flat():
    """On x = 0 the formulas are 0 and 7 by intent: nothing else of them varies there."""
    box = benchmark_volume(2, amplitude=0.0)
    _, notices = said(box, Poisson(source="1", neumann={"u0": "x*y", "v1": "7*y"}, robin={"w1": ("Z+1", "z")}))
    assert notices == ""


def test_an_estimate_of_a_solution_not_resolved_is_named():
    report, notices = said(MILLIMETRES, Poisson(source="sin(x)"))
    assert report.error_estimate_relative > 0.5 and not report.meaningful
    assert "does not resolve the solution" in notices


def test_a_vector_that_is_not_resolved_is_named_whole():
    body = Elasticity(exact=("sin(x)", "0", "0"))
    report = solve_problem(MILLIMETRES, body).report
    assert not report.meaningful and "exact 'sin(x);0;0' runs from" in report.notices[0]


def test_a_volume_that_encloses_nothing_has_no_scale():
    flat = UNIT.transformed(1.0, [0.0] * 3)
    flat.control_points[..., 2] = 0.0
    with pytest.raises(ValueError, match="encloses nothing"):
        solve_problem(flat, Poisson())


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
        {"exact": "x", "source": "0*x", "boundary": "x"},
        {"exact": "2+sin(8*pi*X)/100"},
        {"exact": "X", "source": "X-X"},
    ],
)
def test_data_that_mean_something_are_not_doubted(data):
    for volume in (UNIT, MILLIMETRES):
        report, notices = said(volume, Poisson(**data))
        assert report.meaningful and notices == ""


def test_a_vector_that_underflows_is_named():
    body = Elasticity(exact=("exp(x-900)", "0", "0"))
    report = solve_problem(MILLIMETRES, body).report
    assert not report.meaningful and "exact 'exp(x-900)'" in report.notices[0]


def test_values_that_are_not_finite_are_refused_with_their_range_and_the_way_out():
    with pytest.raises(ExpressionError, match=r"elsewhere it runs from .* try 'exp\(9\*X\)'"):
        solve_problem(WIDE, Poisson(source="exp(9*x)"))
    with pytest.raises(ExpressionError, match=r"exceeds 1e\+100 .* try '1e99\*X'"):
        solve_problem(MILLIMETRES, Poisson(source="1e99*x"))
    with np.errstate(all="ignore"), pytest.raises(ExpressionError, match="not finite") as refused:
        solve_problem(UNIT, Poisson(source=lambda x, y, z: np.log(x - 1e6)))
    assert "try" not in str(refused.value)
