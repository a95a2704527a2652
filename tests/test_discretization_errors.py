import numpy as np
import pytest

from parameterize.spline.bspline import gauss_points, greville, open_uniform_knots
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import Elasticity, Poisson, benchmark_volume, solve_problem
from solve.discretization.errors import error_norms
from solve.discretization.space import trial_space


def cube(size, n=3, degree=2):
    points = size * greville(open_uniform_knots(n + degree, degree), degree)
    return BSplineVolume.uniform(np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1), degree)


def test_norms_of_a_linear_function_against_zero_by_hand():
    """On [0, 2]^3 the square of 3 x integrates to 9 * 8/3 * 4 = 96, and that of its gradient to 9 * 8 = 72."""
    volume = cube(2.0)
    space = trial_space(volume)

    def exact(points):
        x = points[0]
        return 3.0 * x[None], np.stack([3.0 + 0 * x, 0 * x, 0 * x])[None]

    errors = error_norms(volume, space, np.zeros((1, *space.shape)), exact)
    assert errors.l2 == pytest.approx(np.sqrt(96.0))
    assert errors.l2_relative == pytest.approx(1.0)
    assert errors.h1_seminorm == pytest.approx(np.sqrt(72.0))
    assert errors.h1_relative == pytest.approx(1.0)


def test_a_spline_has_no_distance_from_itself():
    """y is a spline on the curved map, with gradient (0, 1, 0): pulls the physical gradient back through J."""
    volume = benchmark_volume(4)
    errors = error_norms(
        volume,
        trial_space(volume),
        volume.control_points[None, ..., 1],
        lambda x: (x[1:2], np.stack([0 * x[0], 1 + 0 * x[0], 0 * x[0]])[None]),
    )
    assert errors.l2 < 1e-14
    assert errors.h1_seminorm < 1e-12


def test_without_gradient_the_seminorm_is_unknown():
    volume = cube(1.0)
    space = trial_space(volume)
    errors = error_norms(volume, space, np.zeros((1, *space.shape)), lambda x: (x[:1], None))
    assert errors.h1_seminorm is None
    assert errors.l2 == pytest.approx(np.sqrt(1.0 / 3.0))


def test_degree_plus_two_points_integrate_the_square_of_one_degree_more_exactly():
    volume = cube(1.0)
    space = trial_space(volume)
    errors = error_norms(volume, space, np.zeros((1, *space.shape)), lambda x: (x[:1] ** 3, None))
    assert errors.l2 == pytest.approx(np.sqrt(1.0 / 7.0), rel=1e-14)


WAVE = "exp(x+z)*sin(y)"
TENSOR = ("2+x*x", "0.3*y", "0.1", "1.5", "0.2*sin(z)", "1+z*z")


def effectivity(volume, problem, **arguments):
    report = solve_problem(volume, problem, estimate=True, **arguments).report
    assert report.error_estimate_relative == pytest.approx(report.error_estimate / report.l2 * report.l2_relative, 1e-3)
    return report.error_estimate / report.l2


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_estimate_is_near_the_error(degree):
    assert 0.5 < effectivity(benchmark_volume(4, degree), Poisson(exact=WAVE), refine=1) < 1.5


@pytest.mark.parametrize(
    "problem",
    [
        Poisson(exact="sin(5*x)*cos(4*y)+z**3"),
        Poisson(exact=WAVE, kappa="1+x*x+y"),
        Poisson(exact=WAVE, kappa=TENSOR, reaction="x*x", neumann={"u1": None}, robin={"w0": ("2+x", None)}),
        Poisson(exact=WAVE, reaction="1000"),
        Poisson(exact=WAVE, neumann=dict.fromkeys(FACE_NAMES)),
    ],
    ids=["waves", "kappa", "all terms", "large reaction", "pure neumann"],
)
def test_estimate_holds_for_every_term(problem):
    assert 0.8 < effectivity(benchmark_volume(4), problem, refine=1) < 1.5


def test_estimate_errs_on_the_safe_side_where_elements_are_stretched():
    """In a box 1 x 1 x 1/8 of a cube's knots, the error along x is judged by the largest element size."""
    points = greville(open_uniform_knots(7, 3), 3)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    box = BSplineVolume.uniform(grid * [1.0, 1.0, 0.125], 3)
    assert 0.8 < effectivity(box, Poisson(exact="sin(3*x)*cos(2*y)"), refine=1) < 1.5
    assert effectivity(box, Poisson(exact="sin(20*z)"), refine=1) > 5.0


def test_estimate_of_displacements_is_on_the_safe_side():
    body = Elasticity(exact=("exp(x)*sin(y)", "cos(x*z)", "x*y*z+sin(z)"), traction={"u1": None}, young=210.0)
    report = solve_problem(benchmark_volume(4), body, refine=1, estimate=True).report
    assert 1.0 < report.error_estimate / report.l2 < 4.0


def test_estimate_of_a_solution_with_singular_edges_is_on_the_safe_side():
    """u = 0 on all faces and f = 1: derivatives are unbounded along the edges. Measured against a much finer mesh."""
    volume = benchmark_volume(4)
    coarse, fine = (solve_problem(volume, Poisson(source="1"), refine=level) for level in (0, 2))
    points, weights = (part.ravel() for part in gauss_points(fine.knots[0], 3))
    difference = coarse.grid(points, points, points) - fine.grid(points, points, points)
    measure = np.linalg.det(volume.grid_jacobian(points, points, points))
    l2 = np.sqrt(np.einsum("i,j,k,ijk", weights, weights, weights, measure * difference**2))
    assert 1.0 < coarse.report.error_estimate / l2 < 4.0


def test_no_estimate_where_derivatives_jump_or_are_unknown():
    plain = Poisson(source="1")
    assert solve_problem(benchmark_volume(4, 1), plain).report.error_estimate is None
    assert solve_problem(benchmark_volume(4), plain).report.error_estimate > 0.0
    unknown = Poisson(source="1", kappa=lambda x, y, z: 1 + x * x)
    assert solve_problem(benchmark_volume(4), unknown).report.error_estimate is None
    assert solve_problem(benchmark_volume(4), Poisson(exact=WAVE)).report.error_estimate is None  # not asked for
