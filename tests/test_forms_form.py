"""Laws of a user's own: their rates, what follows from them, and laws that are refused."""

import pickle

import numpy as np
import pytest

import iga_nn
from parameterize.spline.volume import FACE_NAMES
from solve import ConvergenceError, ExpressionError, benchmark_volume, convergence, solve_problem
from solve.field import Points
from solve.forms.form import check_law
from solve.forms.hooke import Hooke

WAVE = "exp(x+z)*sin(y)"
MATRIX = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, 0.2], [0.0, 0.2, 3.0]])
COUPLING = np.array([[2.0, 0.5], [0.5, 1.0]])


class Anisotropic(iga_nn.Form):
    """Diffusion by a matrix that grows with x, and a reaction."""

    def flux(self, u, grad, x):
        return (1.0 + x[0] ** 2) * np.einsum("ij,cj...->ci...", MATRIX, grad)

    def react(self, u, grad, x):
        return (2.0 + np.sin(x[1])) * u


class ConvectionDiffusion(iga_nn.Form):
    symmetric = False

    def flux(self, u, grad, x):
        return (1.0 + 0.3 * x[2]) * grad

    def react(self, u, grad, x):
        return 3.0 * grad[:, 0] - 2.0 * x[0] * grad[:, 1]


class Conservative(iga_nn.Form):
    """The same kind of law with the convection in the flux: it reaches the data on faces."""

    symmetric = False

    def flux(self, u, grad, x):
        return grad - np.stack([u, -u, 2.0 * u], axis=1)

    def react(self, u, grad, x):
        return 4.0 * u


class Drift(iga_nn.Form):
    """Symmetric though it couples u with its gradient: grad u + b u, and b . grad u + 2 u, b = (x, 0, 1)."""

    def flux(self, u, grad, x):
        return grad + 0.5 * np.stack([x[0] * u, 0.0 * u, u], axis=1)

    def react(self, u, grad, x):
        return 0.5 * (x[0] * grad[:, 0] + grad[:, 2]) + 2.0 * u


class Coupled(iga_nn.Form):
    components = 2

    def flux(self, u, grad, x):
        return np.einsum("ab,bi...->ai...", COUPLING, grad)

    def react(self, u, grad, x):
        return np.stack([u[0] - 0.5 * np.cos(x[2]) * u[1], u[1] - 0.5 * np.cos(x[2]) * u[0]])


NATURAL = {"neumann": {"u1": None}, "robin": {"v0": ("1+x*x", None)}}
PROBLEMS = {
    "anisotropic": iga_nn.Problem(Anisotropic(), exact=WAVE, **NATURAL),
    "neumann on all faces": iga_nn.Problem(Anisotropic(), exact=WAVE, neumann=dict.fromkeys(FACE_NAMES)),
    "convection": iga_nn.Problem(ConvectionDiffusion(), exact=WAVE, **NATURAL),
    "conservative": iga_nn.Problem(Conservative(), exact=WAVE, **NATURAL),
    "drift": iga_nn.Problem(Drift(), exact=WAVE, **NATURAL),
    "two components": iga_nn.Problem(Coupled(), exact=(WAVE, "x*y*z+cos(y)"), **NATURAL),
}


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_full_order(problem):
    """Quadratic splines on the twisted cube, with the source, the flux and Robin's data that follow from the law."""
    rows = convergence(benchmark_volume(3, degree=2), problem, refine=(0, 1, 2))
    assert rows[-1].rate_l2 > 2.9 and rows[-1].rate_h1 > 1.9
    assert rows[-1].report.l2_relative < 5e-4 and rows[-1].report.iterations < 60


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_the_error_is_estimated_on_the_safe_side(problem):
    report = solve_problem(benchmark_volume(4), problem, refine=1, estimate=True).report
    assert 0.8 < report.error_estimate / report.l2 < 4.0


def test_a_scalar_law_is_probed_into_the_factors_of_poisson():
    """The same law as `Poisson` knows it: the same system, up to rounding."""
    kappa = [f"(1+x*x)*{MATRIX[i, j]}" for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
    known = iga_nn.Poisson(exact=WAVE, kappa=kappa, reaction="2+sin(y)")
    volume = benchmark_volume(3, degree=2)
    ours, theirs = (iga_nn.discretize(volume, p) for p in (iga_nn.Problem(Anisotropic(), exact=WAVE), known))
    matrix, other = ours.patches[0].matrix, theirs.patches[0].matrix
    assert type(matrix) is type(other)
    assert np.allclose(matrix.factors, other.factors, rtol=1e-12, atol=1e-15)
    assert np.allclose(ours.load, theirs.load, atol=1e-12)


@pytest.mark.parametrize("constant", [False, True])
def test_elasticity_as_a_law_of_ones_own_is_the_same(constant):
    hooke = Hooke(**iga_nn.Elasticity.lame(1.5, 0.7))

    class Plain(iga_nn.Form):
        components = 3

        def flux(self, u, grad, x):
            return hooke.stress(grad)

    Plain.constant = constant

    exact = ("exp(x)*sin(y)", "cos(x*z)", "x*y*z+sin(z)")
    body = iga_nn.Elasticity(exact=exact, traction={"u1": None}, **iga_nn.Elasticity.lame(1.5, 0.7))
    law = iga_nn.Problem(Plain(), exact=exact, neumann={"u1": None})
    found, wanted = (solve_problem(benchmark_volume(3, degree=2), p, tolerance=1e-13) for p in (law, body))
    assert np.allclose(found.coefficients, wanted.coefficients, atol=1e-10)
    assert found.report.iterations == wanted.report.iterations


def refused(**members):
    return type("Own", (iga_nn.Form,), members)()


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (refused(), "Own must define flux"),
        (
            refused(flux=lambda s, u, grad, x: grad[0]),
            r"Own\.flux must return shape \(1, 3, 64\) for u of shape \(1, 64\)",
        ),
        (refused(flux=lambda s, u, grad, x: grad, react=lambda s, u, grad, x: grad), r"Own\.react must return shape"),
        (refused(flux=lambda s, u, grad, x: grad * abs(grad)), r"Own\.flux must be linear in u and grad"),
        (refused(flux=lambda s, u, grad, x: grad, react=lambda s, u, grad, x: u + 1.0), "react must be linear"),
        (refused(flux=lambda s, u, grad, x: grad, react=lambda s, u, grad, x: grad[:, 0]), "set `symmetric = False`"),
        (refused(flux=lambda s, u, grad, x: -grad), "flux must be coercive"),
        (refused(flux=lambda s, u, grad, x: x[0] * grad, constant=True), "Own is not constant"),
        (refused(flux=lambda s, u, grad, x: grad, react=lambda s, u, grad, x: u, constant=True), "is not constant"),
        (refused(flux=lambda s, u, grad, x: grad / (0.0 * x[0])), "must return finite real numbers"),
        (refused(flux=lambda s, u, grad, x: grad * None), r"Own\.flux fails: TypeError: unsupported operand"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_laws_that_cannot_be_solved_are_refused_with_one_line(law, says):
    problem = iga_nn.Problem(law, source="1")
    with pytest.raises((ValueError, NotImplementedError), match=says) as caught:
        iga_nn.solve(benchmark_volume(2), problem)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (refused(), "Own must define flux"),
        (
            refused(flux=lambda s, u, grad, x: grad[0]),
            r"Own\.flux must return shape \(1, 3, 5\) for u of shape \(1, 5\)",
        ),
        (refused(flux=lambda s, u, grad, x: None), r"Own\.flux must return shape"),
        (refused(components=0), "Own.components must be a whole number, 1 or more, got 0"),
        (refused(components=2.5), "got 2.5"),
    ],
)
def test_shapes_are_said_before_what_jets_cannot_do(law, says):
    with pytest.raises(ValueError, match=says):
        iga_nn.Problem(law, exact="X*Y")


def test_a_law_that_is_not_coercive_somewhere_is_refused_with_the_place():
    """Its sign changes next to a corner, where no sample lies but a quadrature point does."""
    law = refused(flux=lambda s, u, grad, x: np.where(np.abs(x).sum(axis=0) > 0.2, 1.0, -1.0) * grad)
    with pytest.raises(ExpressionError, match=r"Own\.flux must be positive definite.* at x=0\.0"):
        iga_nn.solve(benchmark_volume(4), iga_nn.Problem(law, source="1"))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"source": ("1", "2", "3")}, "source must have two entries, one a component"),
        ({"source": "1"}, "source must have two entries"),
        ({}, r"source has no data: give source=\(\"0\", \.\.\.\)"),
        ({"exact": lambda x: x[:2]}, "source has no data: exact is a function, a field or a choice"),
        ({"source": ("1", "1"), "neumann": {"top": None}}, "'top' is no face"),
        ({"source": ("1", "1"), "neumann": {"u0": None}}, "neumann u0 has no data"),
        ({"source": ("1", "1"), "neumann": ["u0"]}, "neumann must be a dictionary of face names"),
        ({"source": ("1", "1"), "robin": {"u0": 3}}, r"robin u0: give two entries \(alpha, g\), got 3"),
    ],
)
def test_data_that_do_not_fit_the_law_are_refused(arguments, says):
    with pytest.raises(ValueError, match=says):
        iga_nn.Problem(Coupled(), **arguments)


def test_what_is_no_law_no_problem_or_no_volume_is_a_type_error():
    with pytest.raises(TypeError, match="form must be an instance of a subclass of Form"):
        iga_nn.Problem(Coupled, source=("0", "0"))
    with pytest.raises(TypeError, match="problem must be a Poisson, an Elasticity or a Problem, got NoneType"):
        iga_nn.solve(benchmark_volume(2), None)
    with pytest.raises(TypeError, match="volume must be a BSplineVolume, got str"):
        iga_nn.solve("volume.npz", iga_nn.Poisson())


def test_a_law_that_does_not_run_on_jets_needs_its_source():
    class Table(iga_nn.Form):
        def flux(self, u, grad, x):
            return np.interp(x[0], [-1.0, 2.0], [1.0, 2.0]) * grad

    with pytest.raises(ValueError, match="source has no data: the law Table does not run on jets"):
        iga_nn.Problem(Table(), exact="x")
    report = solve_problem(benchmark_volume(2), iga_nn.Problem(Table(), source="1", boundary="0")).report
    assert report.converged and report.error_estimate is None


class Helmholtz(iga_nn.Form):
    """A reaction so negative that the matrix is not positive definite."""

    def flux(self, u, grad, x):
        return grad

    def react(self, u, grad, x):
        return -400.0 * u


def test_an_indefinite_law_is_named_and_solved_once_it_says_not_symmetric():
    problem = iga_nn.Problem(Helmholtz(), exact=WAVE)
    with pytest.raises(ConvergenceError, match="set `symmetric = False`"):
        iga_nn.solve(benchmark_volume(6), problem, refine=1)
    law = Helmholtz()
    law.symmetric = False
    report = iga_nn.solve(benchmark_volume(6), iga_nn.Problem(law, exact=WAVE), refine=1).report
    assert report.converged and report.errors.l2 < 1e-5


def test_constants_left_open_are_refused_where_no_mean_is_known():
    class Flow(ConvectionDiffusion):
        def react(self, u, grad, x):
            return 0.0

    problem = iga_nn.Problem(Flow(), source="0", neumann=dict.fromkeys(FACE_NAMES, "0"))
    with pytest.raises(ValueError, match="does not determine the solution"):
        iga_nn.solve(benchmark_volume(2), problem)


def test_coupling_is_seen():
    x = Points.of(np.random.default_rng(0).random((3, 5)), ())
    assert check_law(Drift(), x) and not check_law(Anisotropic(), x)


def test_problems_are_pickled():
    volume = benchmark_volume(2)
    for problem in (iga_nn.Poisson(kappa="1+X*X"), iga_nn.Elasticity(exact=("x", "Y", "0")), PROBLEMS["drift"]):
        there = pickle.loads(pickle.dumps(problem))
        assert np.array_equal(solve_problem(volume, there).coefficients, solve_problem(volume, problem).coefficients)


@pytest.mark.parametrize("refine", [1.5, None, [0], "a"])
def test_levels_that_are_no_numbers_are_refused(refine):
    with pytest.raises(ValueError, match="refine must be a whole number"):
        iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(), refine=refine)


@pytest.mark.parametrize(
    ("how", "says"),
    [({"refine": 50}, "refine 50 gives .* elements"), ({"degree": 2.5}, "degree must be a whole number")],
)
def test_spaces_that_cannot_be_made_are_refused(how, says):
    with pytest.raises(ValueError, match=says):
        iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x"), **how)


@pytest.mark.parametrize("source", [lambda x, y, z: 1j * x, lambda x, y, z: "x"])
def test_data_that_are_no_real_numbers_are_refused(source):
    with pytest.raises(ValueError, match="source must return real numbers"):
        iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(source=source))


def test_a_function_that_fails_is_named():
    with pytest.raises(ValueError, match="source fails: ZeroDivisionError: division by zero"):
        iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(source=lambda x, y, z: 1 / 0))


def test_a_study_of_one_level_is_refused():
    with pytest.raises(ValueError, match=r"refine must be levels such as range\(3\), got 1"):
        iga_nn.convergence(benchmark_volume(2), iga_nn.Poisson(), refine=1)
