import logging

import numpy as np
import pytest
from volumes import mapped

from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from solve import (
    ConvergenceError,
    ExpressionError,
    Poisson,
    SplineField,
    benchmark_volume,
    check_problem,
    discretize,
    solve_problem,
)

WAVE = Poisson(exact="exp(x+z)*sin(y)")


def affine(degree, n=3):
    """A sheared, stretched and shifted box."""
    points = greville(open_uniform_knots(n + degree, degree), degree)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    matrix = np.array([[2.0, 0.3, 0.0], [0.1, 1.0, 0.2], [0.0, -0.2, 0.7]])
    return BSplineVolume.uniform(grid @ matrix.T + [1.0, -2.0, 0.5], degree)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_patch_linear(degree):
    solution = solve_problem(affine(degree), Poisson(exact="1+2*x-3*y+z"), tolerance=1e-13)
    assert solution.report.l2_relative < 1e-11
    assert solution.report.h1_seminorm < 1e-11


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_patch_quadratic(degree):
    report = solve_problem(affine(degree), Poisson(exact="x**2-2*y**2+x*z+y"), tolerance=1e-13).report
    assert report.l2_relative < 1e-11


def test_linear_solution_on_a_curved_map_is_limited_by_the_quadrature_only():
    """p Gauss points are not exact there: the error is far below that of the approximation, and vanishes fast."""
    errors = [
        solve_problem(benchmark_volume(4), Poisson(exact="x+y+z"), refine=k, tolerance=1e-13).report.l2
        for k in range(2)
    ]
    assert errors[0] < 1e-6
    assert errors[1] < errors[0] / 16


@pytest.mark.parametrize(("n", "l2"), [(8, 1.434e-5), (27, 1.97e-7)])
def test_reference_errors_of_the_benchmark_map(n, l2):
    report = solve_problem(benchmark_volume(n), WAVE).report
    assert report.l2 == pytest.approx(l2, rel=0.05)
    assert report.dofs == (n + 3) ** 3
    assert report.iterations <= 23
    assert report.converged


def test_solution_evaluates_to_the_exact_one():
    solution = solve_problem(benchmark_volume(6), WAVE, refine=1)
    parameters = np.random.default_rng(0).random((50, 3))
    x, y, z = solution.geometry(parameters).T
    exact = np.exp(x + z) * np.sin(y)
    assert np.abs(solution(parameters) - exact).max() < 1e-4
    u = np.linspace(0.0, 1.0, 4)
    assert np.allclose(solution.grid(u, u[:2], u[:3])[1, 1, 2], solution([[u[1], u[1], u[2]]])[0])


def test_source_alone_means_zero_on_the_boundary():
    """-Laplace u = 3 pi^2 s with s = sin sin sin on the unit cube has the solution s."""
    points = greville(open_uniform_knots(9, 3), 3)
    cube = BSplineVolume.uniform(np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1), 3)
    solution = solve_problem(cube, Poisson(source="3*pi**2*sin(pi*x)*sin(pi*y)*sin(pi*z)"))
    assert solution([[0.5, 0.5, 0.5]])[0] == pytest.approx(1.0, abs=1e-3)
    assert np.all(solution.coefficients[0] == 0.0)
    assert "l2" not in solution.report.as_dict()


def test_zero_as_exact_solution_has_no_relative_error():
    report = solve_problem(benchmark_volume(3), Poisson(exact="0")).report
    assert report.l2 == 0.0
    assert report.iterations == 0
    assert "l2_relative" not in report.as_dict()


def test_functions_as_data_agree_with_formulas():
    formula = solve_problem(benchmark_volume(4), WAVE)
    function = solve_problem(
        benchmark_volume(4),
        Poisson(exact=lambda x, y, z: np.exp(x + z) * np.sin(y), source=lambda x, y, z: -np.exp(x + z) * np.sin(y)),
    )
    assert np.allclose(function.coefficients, formula.coefficients, atol=1e-12)
    assert function.report.l2 == pytest.approx(formula.report.l2, rel=1e-10)
    assert function.report.h1_seminorm is None
    assert "h1_seminorm" not in function.report.as_dict()


def test_units_scale_the_errors():
    """On a map in millimetres h grows by 1000 and the L2 norm by 1000^(3/2); the relative error stays."""
    small = solve_problem(benchmark_volume(4), WAVE).report
    large = solve_problem(
        benchmark_volume(4).transformed(1000.0, [0, 0, 0]), Poisson(exact="exp((x+z)/1000)*sin(y/1000)")
    ).report
    assert large.h == pytest.approx(1000.0 * small.h)
    assert large.l2 == pytest.approx(1000.0**1.5 * small.l2, rel=1e-4)
    assert large.l2_relative == pytest.approx(small.l2_relative, rel=1e-4)


def test_report_entry_has_the_keys_of_report_json():
    report = solve_problem(benchmark_volume(3), WAVE).report
    entry = report.as_dict()
    errors = {"l2", "l2_relative", "h1_seminorm", "h1_relative", "meaningful"}
    assert set(entry) == errors | {"elements", "dofs", "h", "iterations", "converged", "residual", "seconds"}
    assert set(solve_problem(benchmark_volume(3), WAVE, estimate=True).report.as_dict()) - set(entry) == {
        "error_estimate",
        "error_estimate_relative",
        "error_estimate_energy_relative",
    }
    assert set(entry["seconds"]) == {"setup", "solve", "errors"}
    assert entry["elements"] == 27
    assert entry["residual"] <= 1e-10
    assert len(report.residuals) == report.iterations + 1
    assert "27 elements, 216 dofs" in str(report)


def test_round_trip_of_the_solution_file(tmp_path):
    solution = solve_problem(benchmark_volume(3), WAVE, degree=2)
    solution.save(tmp_path / "solution.npz")
    field = SplineField.load(tmp_path / "solution.npz")
    assert field.degrees == solution.degrees == (2, 2, 2)
    assert np.array_equal(field.coefficients, solution.coefficients)
    assert all(np.array_equal(a, b) for a, b in zip(field.knots, solution.knots, strict=True))
    assert np.array_equal(field([[0.2, 0.5, 0.9]]), solution([[0.2, 0.5, 0.9]]))


def test_a_file_that_does_not_fit_together_is_refused(tmp_path):
    solution = solve_problem(benchmark_volume(3), WAVE)
    knots = {f"knots_{a}": k for a, k in zip("uvw", solution.knots, strict=True)}
    np.savez(tmp_path / "a.npz", degrees=np.array([3, 3, 3]), **knots, coefficients=np.zeros((6, 6, 5)))
    with pytest.raises(ValueError, match="direction w: 5 coefficients"):
        SplineField.load(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", degrees=np.array([3, 3, 3]), **knots, coefficients=np.full((6, 6, 6), np.nan))
    with pytest.raises(ValueError, match="finite"):
        SplineField.load(tmp_path / "b.npz")


def test_no_convergence_is_reported_and_raised_on_request():
    solution = solve_problem(benchmark_volume(4), WAVE, max_iterations=3)
    assert not solution.report.converged
    assert solution.report.iterations == 3
    assert "NOT CONVERGED" in str(solution.report)
    with pytest.raises(ConvergenceError, match="after 3 iterations") as caught:
        solve_problem(benchmark_volume(4), WAVE, max_iterations=3, strict=True)
    assert np.array_equal(caught.value.solution.coefficients, solution.coefficients)


def test_a_map_that_is_not_certified_is_said_loudly(caplog):
    with caplog.at_level(logging.WARNING, logger="solve"):
        report = solve_problem(benchmark_volume(3), WAVE, certified="undecided").report
    assert "undecided" in report.notices[0]
    assert "undecided" in caplog.text
    assert solve_problem(benchmark_volume(3), WAVE, certified="certified").report.notices == ()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("reaction", [None, "2"])
def test_a_fold_seen_at_the_gauss_points_is_said(reaction):
    problem = Poisson(exact=WAVE.exact, reaction=reaction)
    report = solve_problem(benchmark_volume(8, amplitude=0.3), problem).report
    assert any("det J < 0 at" in notice for notice in report.notices)
    assert report.converged and report.iterations > 0 and report.l2 is not None  # with |det J| the form stays positive


@pytest.mark.parametrize(
    ("problem", "name"),
    [
        (Poisson(exact="log(x)"), "exact"),
        (Poisson(source="1/(x-x)"), "source"),
        (Poisson(source="0", boundary="sqrt(0-1-x)"), "boundary"),
        (Poisson(source=lambda x, y, z: np.full(x.shape, np.nan)), "source"),
    ],
)
def test_data_that_are_not_finite_name_the_point(problem, name):
    """The benchmark map reaches x < 0."""
    with pytest.raises(ExpressionError, match=rf"{name}.* not finite at x=-?\d.*, y=.*, z="):
        solve_problem(benchmark_volume(3), problem)
    with pytest.raises(ExpressionError, match=rf"{name}.* not finite"):
        check_problem(benchmark_volume(3), problem)


@pytest.mark.parametrize("problem", [Poisson(source="1e300"), Poisson(source="0", boundary="1e300*x")])
def test_data_whose_squares_overflow_are_refused(problem):
    with pytest.raises(ExpressionError, match="exceeds 1e\\+100 at x="):
        solve_problem(benchmark_volume(3), problem)


def test_numbers_are_formulas_of_constants():
    numbers = Poisson(source=1, kappa=2.0, reaction=-0.5 + 1.0, boundary=0, robin={"u0": (3.0, 1)})
    words = Poisson(source="1", kappa="2", reaction="0.5", boundary="0", robin={"u0": ("3", "1")})
    found = [solve_problem(benchmark_volume(3), problem).coefficients for problem in (numbers, words)]
    assert np.array_equal(*found)


def test_problems_without_a_source_are_refused_with_the_remedy():
    with pytest.raises(ValueError, match='source="0"'):
        Poisson(boundary="x")
    with pytest.raises(ValueError, match="source"):
        Poisson(exact=lambda x, y, z: x)
    with pytest.raises(ValueError, match="source must be a number, a formula"):
        Poisson(source=object())
    with pytest.raises(ExpressionError, match="boundary: expression, column 1"):
        Poisson(source="0", boundary="q")


@pytest.mark.parametrize(
    ("arguments", "name"),
    [({"tolerance": 0.0}, "tolerance"), ({"max_iterations": 0}, "max_iterations"), ({"refine": -1}, "refine")],
)
def test_arguments_out_of_range_are_named(arguments, name):
    with pytest.raises(ValueError, match=name):
        solve_problem(benchmark_volume(3), WAVE, **arguments)


def test_a_space_without_interior_functions_is_refused():
    with pytest.raises(ValueError, match="raise refine or degree"):
        solve_problem(benchmark_volume(1), WAVE, degree=1)


def test_a_coarser_solution_to_start_from_saves_iterations():
    volume, problem = benchmark_volume(4, amplitude=0.16), Poisson(exact="exp(x+z)*sin(y)")
    coarse = solve_problem(volume, problem, refine=1)
    cold, warm = (solve_problem(volume, problem, refine=2, start=start) for start in (None, coarse))
    assert warm.report.iterations <= 0.75 * cold.report.iterations
    assert np.allclose(warm.coefficients, cold.coefficients, atol=1e-8)


def test_the_solution_is_the_same_for_any_number_of_threads():
    volume, problem = benchmark_volume(9), Poisson(exact="exp(x+z)*sin(y)", reaction="1+x")
    one, three = (solve_problem(volume, problem, threads=threads) for threads in (1, 3))
    assert np.array_equal(one.coefficients, three.coefficients)
    assert one.report.l2 == three.report.l2
    with pytest.raises(ValueError, match="threads must be at least 1"):
        solve_problem(volume, problem, threads=0)


@pytest.mark.parametrize("degree", [2, 3, 4])
@pytest.mark.parametrize("wave", [1.0, 5.0], ids=["smooth", "wavy"])
def test_the_default_quadrature_keeps_the_error_of_one_gauss_point_more_than_the_degree(degree, wave):
    problem = Poisson(exact="exp(x+z)*sin(y)", kappa=f"exp(sin({wave}*x)*y)", reaction="1+x", neumann={"u0": None})
    volume = benchmark_volume(12, degree)
    reference, default = (
        solve_problem(volume, problem, tolerance=1e-12, quadrature=rule).report for rule in ("gauss+1", "spline")
    )
    assert default.l2 == pytest.approx(reference.l2, rel=5e-3)
    assert default.h1_seminorm == pytest.approx(reference.h1_seminorm, rel=5e-3)


@pytest.mark.parametrize("rule", ["spline", "gauss", "gauss+1"])
@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_directions_of_one_span_may_have_natural_data_on_both_ends(rule, degree):
    slab = mapped(lambda u, v, w: (u, v, 0.2 * w), (degree + 3, degree + 3, degree + 1), (degree,) * 3)
    problem = Poisson(exact="x+2*z", neumann={"w0": None, "w1": None, "v0": None})
    assert solve_problem(slab, problem, quadrature=rule).report.l2_relative < 1e-9


def test_a_quadrature_that_is_unknown_is_refused():
    with pytest.raises(ValueError, match="quadrature must be one of spline, gauss"):
        solve_problem(benchmark_volume(2), Poisson(), quadrature="newton")


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ({"tolerance": "x"}, "tolerance must be a number between 0 and 1, got 'x'"),
        ({"tolerance": 1.0}, "tolerance must be a number between 0 and 1, got 1.0"),
        ({"max_iterations": 2.5}, "max_iterations must be a whole number, at least 1, got 2.5"),
    ],
)
def test_limits_of_another_kind_are_refused(how, says):
    with pytest.raises(ValueError, match=says):
        solve_problem(benchmark_volume(2), Poisson(), **how)


def test_bytes_are_no_datum():
    with pytest.raises(ValueError, match="source must be a number, a formula"):
        Poisson(source=b"1", boundary=0)


@pytest.mark.parametrize("degree", [0, 9, 99])
def test_a_degree_out_of_range_is_refused_at_once(degree):
    with pytest.raises(ValueError, match="at least 1 and at most 8"):
        discretize(benchmark_volume(2), Poisson(), degree=degree)
