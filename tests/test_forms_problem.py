"""Manufactured solutions for every term and every kind of boundary data."""

import numpy as np
import pytest

from parameterize.spline.volume import FACE_NAMES
from solve import ExpressionError, Poisson, benchmark_volume, check_problem, convergence, solve_problem
from solve.discretization.face_data import face_rule
from solve.discretization.space import trial_space

WAVE = "exp(x+z)*sin(y)"
KAPPA = "1+x*x+0.5*sin(y)"
TENSOR = ("2+x*x", "0.3*y", "0.1", "1.5", "0.2*sin(z)", "1+z*z")
NEUMANN = {"u1": None, "v0": None}
ROBIN = {"w0": ("2+x", None), "w1": ("0.5", None)}

PROBLEMS = {
    "scalar kappa": Poisson(exact=WAVE, kappa=KAPPA),
    "tensor kappa": Poisson(exact=WAVE, kappa=TENSOR),
    "reaction": Poisson(exact=WAVE, reaction="3+x*y"),
    "neumann": Poisson(exact=WAVE, neumann=NEUMANN),
    "robin": Poisson(exact=WAVE, robin=ROBIN),
    "robin alone": Poisson(exact=WAVE, robin=dict.fromkeys(FACE_NAMES, ("1", None))),
    "pure neumann": Poisson(exact=WAVE, kappa=TENSOR, neumann=dict.fromkeys(FACE_NAMES)),
    "reaction, pure neumann": Poisson(exact=WAVE, reaction="1", neumann=dict.fromkeys(FACE_NAMES)),
    "all": Poisson(exact=WAVE, kappa=TENSOR, reaction="x*x", neumann=NEUMANN, robin=ROBIN),
}


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_full_order(problem):
    """Quadratic splines on the twisted cube: order 3 in L2 and 2 in H1, as for Laplace's equation."""
    rows = convergence(benchmark_volume(4, degree=2), problem, refine=(0, 1, 2))
    assert rows[-1].rate_l2 > 2.9
    assert rows[-1].rate_h1 > 1.9
    assert rows[-1].report.l2_relative < 1e-4
    assert rows[-1].report.iterations < 70


def test_data_from_the_exact_solution_are_the_derivatives_by_hand():
    """u = x^2 + y z, kappa with off-diagonal y at (x, z): kappa grad u = (2 x + y y, z, 2 x y + y), and its divergence
    is 2 + 0 + 0; c = z."""
    problem = Poisson(
        exact="x**2+y*z", kappa=("1", "0", "y", "1", "0", "1"), reaction="z", neumann={"u1": None},
        robin={"w0": ("3", None)},
    )  # fmt: skip
    x, y, z = points = np.array([[0.3], [0.5], [0.7]])
    normal = np.array([[0.6], [0.0], [0.8]])
    flux = 0.6 * (2 * x + y * y) + 0.8 * (2 * x * y + y)
    assert problem.source_at(points)[0] == pytest.approx(-2.0 + z * (x**2 + y * z))
    assert problem.on_face("u1", points, normal)[1][0] == pytest.approx(flux)
    alpha, g = problem.on_face("w0", points, normal)
    assert alpha == 3.0 and g[0] == pytest.approx(flux + 3.0 * (x**2 + y * z))


def test_nine_entries_are_the_six():
    nine = [TENSOR[i] for i in (0, 1, 2, 1, 3, 4, 2, 4, 5)]
    where = np.random.default_rng(0).random((3, 5))
    assert np.array_equal(Poisson(exact=WAVE, kappa=np.eye(3)).tensor(where), Poisson(exact=WAVE).tensor(where))
    assert np.array_equal(Poisson(exact=WAVE, kappa=nine).tensor(where), PROBLEMS["tensor kappa"].tensor(where))


@pytest.mark.parametrize(
    "rows",
    [
        [[2, 0.5, 0], [0.5, 3, "x"], [0, "x", 4]],
        ((2, 0.5, 0), (0.5, 3, "x"), (0, "x", 4)),
        [np.array([2, 0.5, 0], dtype=object), [0.5, 3, "x"], (0, "x", 4)],
    ],
)
def test_three_rows_of_kappa_are_the_six(rows):
    where = np.random.default_rng(0).random((3, 5))
    six = Poisson(exact=WAVE, kappa=(2, 0.5, 0, 3, "x", 4))
    assert np.array_equal(Poisson(exact=WAVE, kappa=rows).tensor(where), six.tensor(where))


@pytest.mark.parametrize("rows", [[[1, 0], [0, 1]], np.ones((2, 3)), [[1, 0, 0], [0, 1, 0], 1], [[1, 0, 0]]])
def test_other_rows_of_kappa_are_refused(rows):
    with pytest.raises(ValueError, match="three rows of three entries"):
        Poisson(exact=WAVE, kappa=rows)


def test_functions_as_data_agree_with_formulas():
    volume = benchmark_volume(3, degree=2)
    formulas = Poisson(
        source="x",
        boundary="y",
        kappa=KAPPA,
        reaction="z*z",
        neumann={"u1": "0.4+x*y", "v0": "z"},
        robin={"w0": ("2+x", "0.4+x*y"), "w1": ("0.5", "y")},
    )
    functions = Poisson(
        source=lambda x, y, z: x,
        boundary=lambda x, y, z: y,
        kappa=lambda x, y, z: 1 + x * x + 0.5 * np.sin(y),
        reaction=lambda x, y, z: z * z,
        neumann={"u1": lambda x, y, z: 0.4 + x * y, "v0": lambda x, y, z: z},
        robin={
            "w0": (lambda x, y, z: 2 + x, lambda x, y, z: 0.4 + x * y),
            "w1": (lambda x, y, z: 0.5, lambda x, y, z: y),
        },
    )
    found, wanted = (solve_problem(volume, problem).coefficients for problem in (functions, formulas))
    assert np.allclose(found, wanted, atol=1e-12)


def test_the_mean_is_that_of_the_exact_solution_or_zero():
    volume, everywhere = benchmark_volume(4, degree=2), dict.fromkeys(FACE_NAMES)
    shifted = solve_problem(volume, Poisson(exact=f"7+{WAVE}", neumann=everywhere)).coefficients
    plain = solve_problem(volume, Poisson(exact=WAVE, neumann=everywhere)).coefficients
    assert np.allclose(shifted, 7.0 + plain, atol=1e-8)
    zero = Poisson(source="0", neumann=dict.fromkeys(FACE_NAMES, "0"))
    assert np.all(solve_problem(volume, zero).coefficients == 0.0)


def test_data_out_of_balance_are_refused():
    problem = Poisson(source="1", neumann=dict.fromkeys(FACE_NAMES, "0"))
    with pytest.raises(ValueError, match="source plus flux integrate to 0.97"):  # its volume
        solve_problem(benchmark_volume(2), problem)


def test_normals_close_up_and_the_flux_of_the_place_is_three_volumes():
    """Gauss: the normal's integral over a closed surface vanishes, that of x . n is three times the volume."""
    volume = benchmark_volume(4)
    rules = [face_rule(volume, trial_space(volume), name) for name in FACE_NAMES]
    total = sum((rule.normal * rule.measure).sum(axis=(1, 2, 3)) for rule in rules)
    through = sum(((rule.points * rule.normal).sum(axis=0) * rule.measure).sum() for rule in rules)
    points, weights = np.polynomial.legendre.leggauss(20)
    grid, weights = (points + 1) / 2, weights / 2
    inside = np.einsum("i,j,k,ijk->", weights, weights, weights, np.linalg.det(volume.grid_jacobian(grid, grid, grid)))
    assert np.abs(total).max() < 1e-12
    assert through == pytest.approx(3.0 * inside, rel=1e-6)


def test_the_term_of_a_robin_face_is_symmetric_and_has_the_face_as_its_sum():
    volume = benchmark_volume(3, degree=2)
    space = trial_space(volume)
    rule = face_rule(volume, space, "v1")
    x, y = np.random.default_rng(0).standard_normal((2, *space.shape))
    products = [np.zeros(space.shape) for _ in range(3)]
    for vector, product in zip((x, y, np.ones(space.shape)), products, strict=True):
        rule.add_product(vector[None, None], product[None, None])
    assert np.vdot(y, products[0]) == pytest.approx(np.vdot(x, products[1]))
    assert products[2].sum() == pytest.approx(rule.measure.sum())
    diagonal, unit, column = np.zeros(space.shape), np.zeros(space.shape), np.zeros(space.shape)
    rule.add_diagonal(0, diagonal[None])
    unit[1, -1, 2] = 1.0
    rule.add_product(unit[None, None], column[None, None])
    assert diagonal[1, -1, 2] == pytest.approx(column[1, -1, 2])


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ({"kappa": "x"}, "kappa must be positive, and is not at x=-"),
        ({"kappa": ("1", "2", "0", "1", "0", "1")}, "kappa must be positive definite"),
        ({"kappa": "1e-300"}, "kappa must be 1e-100 or more, and is not at x="),
        ({"kappa": "9e-101+0*x"}, "kappa must be 1e-100 or more"),
        ({"kappa": ("1e-300", "0", "0", "1e-300", "0", "1e-300")}, "kappa must be 1e-100 or more"),
        ({"reaction": "x"}, "reaction must be zero or positive"),
        ({"robin": {"u0": ("0-1", None)}}, "robin u0: alpha must be zero or positive"),
        ({"neumann": {"u0": "log(0*x)"}}, "neumann u0 is not finite"),
    ],
)
def test_data_of_the_wrong_sign_are_refused(data, says):
    with pytest.raises(ExpressionError, match=says):
        check_problem(benchmark_volume(3), Poisson(exact=WAVE, **data))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ({"exact": "x", "neumann": {"top": None}}, "neumann: 'top' is no face of the cube"),
        ({"exact": "x", "neumann": {"u0": None}, "robin": {"u0": ("1", None)}}, "face u0 has both"),
        ({"exact": "x", "kappa": ("1", "2")}, "kappa has 2 entries"),
        ({"exact": "x", "kappa": ("1", "x", "0", "y", "1", "0", "0", "0", "1")}, "not symmetric"),
        ({"exact": "x", "kappa": lambda x, y, z: x}, "kappa is a function"),
        ({"source": "1", "neumann": {"u0": None}}, "neumann u0 has no data"),
        ({"exact": "x", "robin": {"u0": ("q", None)}}, "robin u0: alpha: expression, column 1"),
    ],
)
def test_problems_that_do_not_fit_together_are_refused(data, says):
    with pytest.raises(ValueError, match=says):
        Poisson(**data)
