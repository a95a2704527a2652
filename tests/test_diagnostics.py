"""What is said of numbers that are not to be trusted, and only of those."""

import numpy as np
import pytest

from parameterize.spline.volume import BSplineVolume
from solve import ConvergenceError, Elasticity, Poisson, benchmark_volume, solve_problem
from solve.diagnostics import contradictions, worst_place
from solve.discretization.space import trial_space
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
    body = Elasticity(body_force=("0", "0", "1"), traction={"u0": (FLUX, "0", "0")})
    assert f"traction u0 {FLUX!r} runs from 0 to 0" in " ".join(solve_problem(MILLIMETRES, body).report.notices)


def test_data_may_be_constant_on_a_face_because_it_is_flat():
    """On x = 0 the formulas are 0 and 7 by intent: nothing else of them varies there."""
    box = benchmark_volume(2, amplitude=0.0)
    _, notices = said(box, Poisson(source="1", neumann={"u0": "x*y", "v1": "7*y"}, robin={"w1": ("Z+1", "z")}))
    assert notices == ""


def test_an_estimate_of_a_solution_not_resolved_is_named_and_is_no_verdict():
    report, notices = said(MILLIMETRES, Poisson(source="sin(x)"))
    assert report.error_estimate_relative > 0.5 and report.meaningful
    assert f"is estimated as {report.error_estimate_relative:.2g}: refine it" in notices


@pytest.mark.filterwarnings("error")
def test_the_smallest_kappa_is_solved_and_a_solution_too_large_for_its_norms_is_named():
    """Scaled by 1e100 the solution is that of kappa = 1; with a source of 1e100 it is beyond 1e150."""
    plain, small = (solve_problem(UNIT, Poisson(source="1", kappa=kappa)).report for kappa in ("1", "1e-100"))
    assert small.error_estimate_relative == pytest.approx(plain.error_estimate_relative, rel=1e-6)
    assert small.error_estimate == pytest.approx(1e100 * plain.error_estimate, rel=1e-6)
    report, notices = said(UNIT, Poisson(source="1e100", kappa="1e-100"))
    assert not report.meaningful and report.error_estimate is None and "too large for its norms" in notices


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
    with pytest.raises(ExpressionError, match="not finite at x=0, y=0, z=0") as refused:
        solve_problem(UNIT, Poisson(exact="log(x)"))  # the size of the domain is not at fault
    assert "try" not in str(refused.value)


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
    body = Elasticity(exact=("x*x", "y", "0"), body_force=("1", "0", "0"), displacement=("x", "y", "0"))
    notices = solve_problem(VOLUME, body).report.notices
    assert notices == (
        f"body_force is not that of exact: {TWO_PROBLEMS}",
        f"displacement differs from exact: {TWO_PROBLEMS}",
    )
    fits = Elasticity(
        exact=("x*x", "y", "0"), body_force=(str(-2.0 * 3.5 / 2.6), "0", "0")
    )  # -2 (lambda + 2 mu), nu = 0.3
    assert contradictions(VOLUME, fits) == []


@pytest.mark.parametrize(
    "data",
    [
        {"exact": "exp(x)*sin(y)", "source": "0"},  # harmonic: the second derivatives cancel
        {"exact": "x*x", "source": "-4", "kappa": "2", "boundary": "x*x"},
        {"exact": "1e9*x*y*z", "source": "0"},
        {"exact": "x", "boundary": "x+7", "neumann": dict.fromkeys(("u0", "u1", "v0", "v1", "w0", "w1"))},
        {"exact": lambda x, y, z: x, "source": "1", "boundary": "x"},
        {"source": "1"},
        {"exact": "sqrt(x-0.05)", "source": "1", "boundary": "sqrt(abs(x-0.05))"},  # not finite where it is compared
    ],
)
def test_data_that_agree_are_not_doubted(data):
    assert contradictions(VOLUME, Poisson(**data)) == []


def pressed_corner(height):
    """The trilinear unit cube with its corner (1, 1, 1) moved down to (1, 1, height)."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1)
    corners[1, 1, 1, 2] = height
    return BSplineVolume.uniform(corners, 1)


def test_worst_place_is_found_near_the_pressed_corner():
    """Of the two Gauss points a direction, the one nearest the corner: (1 + 1 / sqrt 3) / 2 = 0.7887 three times."""
    volume = pressed_corner(0.1)
    parameters, point, scaled = worst_place(volume, trial_space(volume))
    assert parameters == pytest.approx([0.788675] * 3, abs=1e-6)
    assert point == pytest.approx(volume(parameters[None])[0])
    jacobian = volume.jacobian(parameters[None])[0]
    assert scaled == pytest.approx(np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=0).prod())


def test_the_line_of_a_failed_solve_has_history_and_place():
    with pytest.raises(ConvergenceError) as caught:
        solve_problem(pressed_corner(0.1), Poisson(exact="sin(9*x)*y*z"), refine=2, max_iterations=2, strict=True)
    line = str(caught.value)
    assert "residual 1.0e+00 at the start" in line and "after 2 iterations" in line and "\n" not in line
    assert "the map is worst at u=0.9" in line
    assert caught.value.solution.report.notices == (line,)


def cantilever(thickness, spans, degree, turn):
    """A rod of length 1, straight or along an arc, held at u0 and pulled across at its end: its deflection and notices.

    thickness: the side of its square section. turn: the angle of the arc, 0 for a straight rod.
    """

    def place(u, v, w):
        if turn == 0.0:
            return u, thickness * v, thickness * w
        radius = 1.0 / turn + thickness * (v - 0.5)
        return radius * np.cos(turn * u), radius * np.sin(turn * u), thickness * w

    rod = BSplineVolume.from_function(place, (spans + degree, degree + 1, degree + 1), degree)
    free = dict.fromkeys(("v0", "v1", "w0", "w1"), ["0"] * 3) | {"u1": [f"{thickness**2}", "0", f"{thickness**2}"]}
    solution = solve_problem(rod, Elasticity(traction=free, young=1.0, poisson_ratio=0.0), max_iterations=3000)
    return float(np.linalg.norm(solution([[1.0, 0.5, 0.5]]))), " ".join(solution.report.notices)


@pytest.mark.parametrize(
    ("coarse", "fine"),
    [((1e-2, 3, 2, 0.0), (1e-2, 16, 2, 0.0)), ((1e-2, 2, 3, 1.6), (1e-2, 12, 3, 1.6))],
)
def test_spans_that_are_much_longer_than_the_body_is_thick_are_named(coarse, fine):
    (small, notices), (right, silence) = cantilever(*coarse), cantilever(*fine)
    assert small < 0.9 * right
    assert "times as long as the body is thick" in notices and f"degree {coarse[2]}" in notices
    assert "times as long" not in silence


def test_short_bodies_and_other_laws_are_not_said_to_be_slender():
    assert said(UNIT, Elasticity(body_force=("0", "0", "1"), displacement=("0", "0", "0")))[1] == ""
    foil = BSplineVolume.from_function(lambda u, v, w: (u, v, 1e-4 * w), 5)
    assert "thick" not in said(foil, Poisson(source="1", boundary="0"))[1]
