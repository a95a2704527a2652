import numpy as np
import pytest

import iga_nn
from solve.ask import Ask
from solve.asked.functional import functional

BOX = iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 * u, v, w), control_points=4)  # 2 x 1 x 1
HEAT = iga_nn.Poisson(exact="x*x+3*y+x*z")  # in the trial space: every number below is exact
PULLED = iga_nn.Elasticity(  # sigma_xx = 1: u = (x / 10, 0, 0)
    young=10.0,
    poisson_ratio=0.0,
    conditions=[iga_nn.Roller("u0"), iga_nn.Roller("v0"), iga_nn.Roller("w0"), iga_nn.Load("u1", (1, 0, 0))],
)


@pytest.fixture(scope="module")
def heat():
    return iga_nn.solve(BOX, HEAT, tolerance=1e-13)


@pytest.fixture(scope="module")
def pulled():
    return iga_nn.solve(BOX, PULLED, tolerance=1e-13)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("u at (1, 0.5, 0.5)", 3.0),
        ("T at (1, 0.5, 0.5)", 3.0),
        ("gradient_x at (1, 0.5, 0.5)", 2.5),
        ("u max", 9.0),
        ("min u", 0.0),
        ("u max over x < 1.3", 1.3**2 + 3 + 1.3),  # the largest value lies at the cut
        ("u max over box(0, 0, 0, 1.3, 0.4, 0.2)", 1.3**2 + 1.2 + 1.3 * 0.2),
        ("u min over x > 0.7 and y > 0.2", 0.49 + 0.6),
        ("mean u", 4 / 3 + 1.5 + 0.5),
        ("integral u over x < 1.3", 1.3**3 / 3 + 1.3 * 1.5 + 1.3**2 / 4),
        ("mean u over u1", 4 + 1.5 + 1),
        ("max u over u1", 9.0),
        ("max u over nz > 0.9 and x < 1.3", 1.3**2 + 3 + 1.3),
        ("u mean over nz > 0.9 and x < 1.3", 1.3**2 / 3 + 1.5 + 1.3 / 2),
        ("flow over nx > 0.9", 4.5),
        ("flow over nx > 0.9 and y < 0.5", 2.25),
        ("energy", None),
    ],
)
def test_values_are_those_computed_by_hand(heat, text, value):
    if value is None:  # half the integral of |(2 x + z, 3, x)|^2
        value = 0.5 * (4 * 8 / 3 + 2 * 2 * 1 + 2 / 3 + 18 + 8 / 3)
    found = functional(Ask(text), HEAT, BOX).value(heat)
    assert found == pytest.approx(value, rel=2e-6, abs=2e-6)


def test_a_part_with_edges_is_cut_into_smaller_and_smaller_cells(heat):
    mean = 1.3**2 / 3 + 1.35 / 2 * 3 + 1.3 / 4
    assert functional(Ask("mean u over y > 0.35 and x < 1.3"), HEAT, BOX).value(heat) == pytest.approx(mean, rel=1e-4)
    ball = functional(Ask("integral u over (x - 1)**2 + (y - 0.5)**2 + (z - 0.5)**2 < 0.16"), HEAT, BOX).value(heat)
    volume = 4 / 3 * 3.14159265 * 0.4**3
    assert ball == pytest.approx(volume * (1 + 1.5 + 0.5 + 0.16 / 5), rel=1e-3)


@pytest.mark.parametrize(
    ("text", "value", "dimension"),
    [
        ("ux at (1.7, 0.2, 0.3)", 0.17, "length"),
        ("von_mises max", 1.0, "stress"),
        ("stress_xx mean over x > 0.5", 1.0, "stress"),
        ("reaction x of u0", -1.0, "force"),
        ("reaction x of nx < -0.9", -1.0, "force"),
        ("reaction z of w0", 0.0, "force"),
        ("flow x over u1", 1.0, "force"),
        ("energy", 0.1, "energy"),
    ],
)
def test_a_bar_under_tension(pulled, text, value, dimension):
    found = functional(Ask(text), PULLED, BOX)
    assert found.value(pulled) == pytest.approx(value, abs=1e-8)
    assert found.dimension == dimension


@pytest.mark.parametrize(
    "text", ["u at (1, 0.5, 0.5)", "mean u over x < 1.3", "flow over nx > 0.9 and y < 0.5", "gradient_x mean over w0"]
)
def test_samples_of_a_linear_functional_give_its_value(heat, text):
    found = functional(Ask(text), HEAT, BOX)
    samples = found.samples(heat)
    assert (samples.patches == 0).all()
    (patch,) = heat.patches
    u, grad = patch.quantity("u", samples.places), patch.quantity("gradient", samples.places)  # (m, 1), (m, 1, 3)
    total = np.einsum("cm,mc->", samples.of_u, u) + np.einsum("cdm,mcd->", samples.of_grad, grad)
    assert total == pytest.approx(found.value(heat), rel=1e-8)


def test_samples_of_a_stress_are_its_derivative():
    problem = iga_nn.Elasticity(exact=("x*y", "y*z", "x+z*z"), young=3.0)
    one = iga_nn.solve(BOX, problem)
    found = functional(Ask("von_mises at (1, 0.5, 0.5)"), problem, BOX)
    samples = found.samples(one)
    grad = one.only.quantity("gradient", samples.places)
    total = np.einsum("cdm,mcd->", samples.of_grad, grad)
    assert total == pytest.approx(found.value(one), rel=1e-6)  # von Mises is homogeneous of degree one


def test_an_excluded_place_has_no_largest_value(heat):
    found = functional(Ask("u max"), HEAT, BOX, is_excluded=lambda x: x[:, 0] > 1.5)
    value, at = found.found(heat)
    assert value == pytest.approx(1.5**2 + 3 + 1.5, rel=1e-5) and at[0] <= 1.5
    found = functional(Ask("u max over w1"), HEAT, BOX, is_excluded=lambda x: x[:, 0] > 1.5)
    assert found.value(heat) == pytest.approx(1.5**2 + 3 + 1.5, rel=1e-5)


def test_several_patches_are_one_body():
    halves = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v, w), 4) for a in (0, 1)]
    rod = iga_nn.Body.from_patches(halves)
    solution = iga_nn.solve(
        rod, HEAT, ask=["u at (1.5, 0.5, 0.5)", "u max over x < 1.3", "mean u over p1_u1", "flow over u1"]
    )
    values = [answer.value for answer in solution.answers]
    assert values == pytest.approx([1.5**2 + 1.5 + 0.75, 1.3**2 + 4.3, 6.5, 4.5], rel=1e-5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ux max", "gives no 'ux'; it gives u, T, gradient"),
        ("u at (3, 0.5, 0.5)", r"outside of the body, 1 from it; its nearest point is \(2, 0.5, 0.5\)"),
        ("u mean over nz > 2", "no part of the boundary lies there"),
        ("u mean over z > 2", "no part of the body lies in 'z > 2'"),
        ("u max over z > 2", r"no part of the body lies in 'z > 2'; the body lies between \(0, 0, 0\) and"),
        ("gradient max", "gradient has 3 numbers a point; ask for one: gradient_x"),
        ("gradient_xy max", "there is no gradient_xy"),
        ("reaction z of u0", "write reaction without a direction"),
        ("reaction of z > 2", "no support lies in 'z > 2'"),
        ("u max over p0_u0", "p0_u0 is no outer face"),
        ("frequency 1", "frequencies are those of modes"),
    ],
)
def test_an_ask_that_the_problem_does_not_have_is_refused(text, message):
    with pytest.raises(ValueError, match=message) as refused:
        functional(Ask(text), HEAT, BOX)
    assert str(refused.value).startswith("ask ")


def test_asks_of_a_body_are_refused_before_the_solve():
    for text, message in {
        "u max": "u has 3 numbers a point; ask for one: ux, uy, uz, magnitude",
        "principal max": "first_principal",
        "stress max": "such as stress_xx",
        "reaction of u0": "write reaction x, y or z",
        "reaction x of u1": "no support lies in 'u1'; the supports are on 'u0', 'v0', 'w0'",
        "reaction x of x < 1": "of roller 'v0' lies in 'x < 1': ask for the reaction of all of",
    }.items():
        with pytest.raises(ValueError, match=message):
            iga_nn.solve(BOX, PULLED, ask=text)


def test_a_law_without_symmetry_has_no_energy():
    class Wind(iga_nn.Form):
        symmetric = False

        def flux(self, u, grad, x):
            return grad

        def react(self, u, grad, x):
            return grad[:, 0]

    with pytest.raises(ValueError, match="Wind is not symmetric"):
        iga_nn.solve(BOX, iga_nn.Problem(Wind(), exact="x"), ask="energy")


def test_a_solution_without_such_a_number_has_the_reason():
    broken = iga_nn.solve(BOX, HEAT)
    broken.only.coefficients[:] = np.nan
    found = functional(Ask("u max"), HEAT, BOX).answer(broken)
    assert np.isnan(found.value) and found.lower is None and found.why.startswith("extremes are of finite numbers")


def test_a_report_shows_answers_first(heat):
    solution = iga_nn.solve(BOX, HEAT, ask=[iga_nn.Ask("u max"), "mean u"])
    assert str(solution.report).startswith("u max = 9 at (2, 1, 1)")
    entry = solution.report.as_dict()["asked"][0]
    assert entry["ask"] == "u max" and entry["value"] == pytest.approx(9.0)
    assert heat.answers == ()
