"""Newton's method: rates, the patch test, beams that bend far, and what is refused."""

import numpy as np
import pytest
from example_files import load
from scipy.integrate import solve_bvp

import iga_nn
from solve import ConvergenceError, benchmark_volume, solve_problem

NOTHING = ("0", "0", "0")
FREE = ("u1", "v0", "v1", "w0", "w1")


class Warm(iga_nn.Form):
    """A conductivity 1 + u^2, and a reaction u^3."""

    linear = symmetric = False

    def flux(self, u, grad, x):
        return (1.0 + u[0] ** 2) * grad

    def react(self, u, grad, x):
        return u**3


def neo_hookean(young=100.0, poisson_ratio=0.3):
    """The law of the gallery."""
    small = iga_nn.Elasticity(displacement=NOTHING, young=young, poisson_ratio=poisson_ratio)
    return load("large_strain").NeoHookean(*small.constants)


def test_a_nonlinear_conductivity_has_the_rates_of_its_degree():
    problem = iga_nn.Problem(Warm(), exact="exp(X+Z)*sin(Y)", neumann={"u1": None}, robin={"v0": ("2", None)})
    reports = [iga_nn.newton(benchmark_volume(2), problem, refine=level).report for level in range(3)]
    l2 = np.log2([a.l2 / b.l2 for a, b in zip(reports, reports[1:], strict=False)])
    h1 = np.log2([a.h1_seminorm / b.h1_seminorm for a, b in zip(reports, reports[1:], strict=False)])
    assert l2[-1] > 3.7 and h1[-1] > 2.7


def test_the_last_residuals_are_squares_of_those_before():
    report = iga_nn.newton(benchmark_volume(2), iga_nn.Problem(Warm(), exact="exp(X+Z)*sin(Y)"), refine=1).report
    first, second, third = report.residuals[-4:-1]
    assert second < 10.0 * first**2 and third < 10.0 * second**2 and report.residuals[-1] < 1e-10
    assert report.iterations == len(report.residuals) - 1 <= 7


def test_a_linear_law_takes_one_step():
    class Plain(iga_nn.Form):
        linear = False

        def flux(self, u, grad, x):
            return (1.0 + x[0] * x[0]) * grad

    class Linear(Plain):
        linear = True

    data = {"source": "1+y", "boundary": "x"}
    found = iga_nn.newton(benchmark_volume(3), iga_nn.Problem(Plain(), **data), tolerance=1e-7)
    wanted = solve_problem(benchmark_volume(3), iga_nn.Problem(Linear(), **data), tolerance=1e-12)
    assert found.report.iterations <= 2
    assert np.allclose(found.coefficients, wanted.coefficients, atol=1e-7)


def wavy_box():
    """A cube whose inside is bent: control points of degree 2, the middle ones moved."""
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), control_points=4, degree=2)
    points = volume.control_points.copy()
    points[1:3, 1:3, 1:3] += np.random.default_rng(0).uniform(-0.06, 0.06, (2, 2, 2, 3))
    return iga_nn.BSplineVolume(volume.degrees, volume.knots, points)


@pytest.mark.parametrize("natural", [{}, {"u1": None, "v0": None}], ids=["held", "pulled"])
def test_an_affine_deformation_is_exact(natural):
    """The patch test at strains of 30 %: degree 3 on a map of degree 2 is integrated exactly."""
    exact = ("0.3*x+0.1*y", "-0.2*y+0.2*z", "0.1*z+0.05*x")
    problem = iga_nn.Problem(neo_hookean(), exact=exact, source=NOTHING, neumann=natural)
    found = iga_nn.newton(wavy_box(), problem, degree=3, quadrature="gauss+1", tolerance=1e-13)
    assert found.report.l2 < 1e-10 and found.report.h1_seminorm < 1e-10


def test_an_affine_deformation_is_exact_under_loads_on_regions():
    """The same, held on cube faces that are named as a region; the loads are P n by hand."""
    exact = ("0.3*x+0.1*y", "-0.2*y+0.2*z", "0.1*z+0.05*x")
    gradient = np.array([[0.3, 0.1, 0.0], [0.0, -0.2, 0.2], [0.05, 0.0, 0.1]])
    law, f = neo_hookean(), np.eye(3) + gradient
    piola = law.shear * f + (law.first * np.log(np.linalg.det(f)) - law.shear) * np.linalg.inv(f).T
    loads = [iga_nn.Flux("nx > 0.99", piola[:, 0].tolist()), iga_nn.Flux("ny < -0.99", (-piola[:, 1]).tolist())]
    problem = iga_nn.Problem(law, exact=exact, source=NOTHING, value="u0 or v1 or w0 or w1", conditions=loads)
    found = iga_nn.newton(wavy_box(), problem, degree=3, quadrature="gauss+1", tolerance=1e-13)
    assert found.report.l2 < 1e-10 and found.report.h1_seminorm < 1e-10


def bent(pull, length=10.0, **how):
    """The tip's displacement of a beam of section 1 x 1 and nu = 0 under a dead load across its end."""
    beam = iga_nn.BSplineVolume.from_function(lambda u, v, w: (length * u, v, w), control_points=(12, 4, 4))
    traction = {**dict.fromkeys(FREE, NOTHING), "u1": ("0", "0", str(pull))}
    law = iga_nn.Problem(neo_hookean(poisson_ratio=0.0), source=NOTHING, neumann=traction)
    small = iga_nn.Elasticity(traction=traction, young=100.0, poisson_ratio=0.0)
    place = [[1.0, 0.5, 0.5]]
    return iga_nn.newton(beam, law, **how)(place)[0], solve_problem(beam, small)(place)[0]


def elastica(pull, stiffness, length):
    """The tip (along, across) of an inextensible rod clamped at one end, load across: EI t'' = -P cos t."""
    s = np.linspace(0.0, length, 101)
    found = solve_bvp(
        lambda s, y: np.array([y[1], -pull / stiffness * np.cos(y[0]), np.cos(y[0]) - 1.0, np.sin(y[0])]),
        lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
        s,
        np.zeros((4, len(s))),
        tol=1e-8,
    )
    return found.y[2:, -1]


def test_a_small_load_bends_a_beam_as_in_linear_elasticity():
    found, linear = bent(1e-4)
    assert found[2] == pytest.approx(linear[2], rel=1e-5)


def test_a_large_load_bends_a_beam_as_the_elastica():
    """A third of its length: less than linear elasticity says, whose beam does not become shorter."""
    found, linear = bent(0.1)
    along, across = elastica(0.1, 100.0 / 12.0, 10.0)
    assert found[2] == pytest.approx(across, rel=0.02) and found[0] == pytest.approx(along, rel=0.03)
    assert found[2] < 0.9 * linear[2]


def test_load_steps_and_a_start_lead_to_the_same_solution():
    at_once, _ = bent(0.02)
    in_steps, _ = bent(0.02, load_steps=3)
    assert np.allclose(at_once, in_steps, atol=1e-8)
    volume, problem = benchmark_volume(2), iga_nn.Problem(Warm(), exact="exp(X+Z)*sin(Y)")
    coarse = iga_nn.newton(volume, problem)
    fine = iga_nn.newton(volume, problem, refine=1, start=coarse)
    assert fine.report.residuals[0] < 0.1
    assert np.allclose(fine.coefficients, iga_nn.newton(volume, problem, refine=1).coefficients, atol=1e-7)


def test_what_cannot_be_solved_is_refused():
    class Blind(iga_nn.Form):
        linear = False

        def flux(self, u, grad, x):
            return np.asarray(grad, dtype=float) * np.exp(0.1 * u[0])

    class Wrong(Warm):
        symmetric = True

    volume, data = benchmark_volume(2), {"source": "1"}
    with pytest.raises(ValueError, match="Warm is not linear: iga_nn.newton solves it"):
        solve_problem(volume, iga_nn.Problem(Warm(), **data))
    with pytest.raises(ValueError, match="Blind has no derivative: it does not run on jets"):
        iga_nn.newton(volume, iga_nn.Problem(Blind(), **data))
    with pytest.raises(ValueError, match="Wrong has a derivative that is not symmetric"):
        iga_nn.newton(volume, iga_nn.Problem(Wrong(), exact="1+x"))

    class Open(Warm):
        def flux(self, u, grad, x):
            return grad

        react = iga_nn.Form.react

    every = dict.fromkeys(("u0", "u1", "v0", "v1", "w0", "w1"), "0")
    with pytest.raises(ValueError, match="do not determine the solution"):
        iga_nn.newton(volume, iga_nn.Problem(Open(), neumann=every, **data))
    with pytest.raises(ValueError, match="load_steps must be"):
        iga_nn.newton(volume, iga_nn.Problem(Warm(), **data), load_steps=0)
    with pytest.raises(ConvergenceError, match="no convergence, residual .* after 1 iterations: raise load_steps"):
        iga_nn.newton(volume, iga_nn.Problem(Warm(), exact="3*x"), max_iterations=1)


@pytest.mark.parametrize("start", ["1", 1.0, [1], np.ones(3)])
def test_a_start_that_is_no_field_is_refused(start):
    with pytest.raises(TypeError, match="start must be a field of the trial space, such as solution.field, got"):
        iga_nn.newton(benchmark_volume(2), iga_nn.Problem(Warm(), source="1"), start=start)


def test_a_start_of_other_components_than_the_law_is_refused():
    volume = benchmark_volume(2)
    bent = solve_problem(volume, iga_nn.Elasticity(body_force=("0", "0", "1"))).field
    for function, problem in (
        (iga_nn.newton, iga_nn.Problem(Warm(), source="1")),
        (solve_problem, iga_nn.Poisson(source="1", boundary="0")),
    ):
        with pytest.raises(ValueError, match="start has 3 components, the law 1"):
            function(volume, problem, start=bent)


@pytest.mark.parametrize("wrong", [3, Warm()])
def test_what_is_no_problem_is_refused_as_by_solve(wrong):
    for function in (iga_nn.newton, solve_problem):
        with pytest.raises(TypeError, match="problem must be a Poisson, an Elasticity or a Problem, got"):
            function(benchmark_volume(2), wrong)


class Thawing(iga_nn.Form):
    """A conductivity 1 + u."""

    linear = symmetric = False

    def flux(self, u, grad, x):
        return (1.0 + u[0]) * grad


BAR = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4.0 * u, v, w), control_points=5)


def thawing(**conditions):
    return iga_nn.newton(BAR, iga_nn.Problem(Thawing(), source="0", **conditions), refine=1)


@pytest.mark.parametrize(
    "conditions",
    [
        {"value": {"u0": 0, "u1": 1}},
        {"value": {"u0": 0}, "conditions": [iga_nn.Flux("nx > 0.99", 0.375)]},
        {
            "value": {"u0": 0},
            "conditions": [
                iga_nn.Flux("nx > 0.99 and y < 0.5", 0.375),
                iga_nn.Flux("nx > 0.99 and y > 0.5", 0.375),
            ],
        },
        {"value": {"u0": 0}, "conditions": [iga_nn.Flux("nx > 0.99", 0.3), iga_nn.Flux("u1", 0.075)]},
        {"value": {"u0": 0}, "exchange": {"nx > 0.99": (0.375, 2)}},
    ],
    ids=["values", "inflow", "two halves", "overlap", "exchange"],
)
def test_data_on_regions_give_the_solution_of_a_bar(conditions):
    """(1 + u) u' = 3/8 with u(0) = 0 has u + u^2 / 2 = 3 x / 8, so u(4) = 1 and u(2) = sqrt(5/2) - 1."""
    assert thawing(**conditions).probe([[2.0, 0.5, 0.5]])[0] == pytest.approx(np.sqrt(2.5) - 1.0, abs=2e-5)


@pytest.mark.parametrize(
    ("conditions", "says"),
    [
        ({"value": "u0", "conditions": [iga_nn.Flux("x > 9", 1)]}, "flux 'x > 9': no part of the boundary lies there"),
        ({"value": {"u0": 0}, "exchange": {"x > 9": (1, 2)}}, "exchange 'x > 9': no part of the boundary lies there"),
        ({"value": "u0", "conditions": [iga_nn.Flux("nx < -0.99", 1)]}, "flux 'nx < -0.99' acts where value 'u0'"),
        ({"conditions": [iga_nn.Flux("u0", 1), iga_nn.Flux("u1", -1)]}, "fluxes alone do not determine the solution"),
    ],
)
def test_data_on_regions_that_are_not_taken_are_refused(conditions, says):
    with pytest.raises(ValueError, match=says):
        thawing(**conditions)
