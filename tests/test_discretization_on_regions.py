"""Data on regions: Nitsche's terms are coercive and consistent, supports are judged, reactions balance the loads."""

import numpy as np
import pytest
from volumes import mapped

import iga_nn
from iga_nn import Fix, Flux
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import Elasticity, Form, Poisson, Problem, benchmark_volume, discretize, solve_problem

WAVE = "exp(x+z)*sin(y)"
BODY = ("0.1*x*y", "sin(z)*0.1", "0.2*x")
BAR = BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), 5)
TWISTED, COARSE = benchmark_volume(3), benchmark_volume(2)
QUADRATIC = benchmark_volume(2, degree=2)  # 192 displacements: a matrix of all its columns takes a second


@pytest.mark.parametrize(
    "text", ["z < 0.2", "x + y < 0.3 or nz > 0.5", "x > -9", "(x-0.4)**2 + z*z < 0.02", "ny < -0.9"]
)
@pytest.mark.parametrize("problem", ["poisson", "elasticity"])
def test_the_matrix_is_symmetric_and_positive_on_any_region(text, problem):
    scalar = problem == "poisson"
    volume, given = (
        (COARSE, Poisson(exact=WAVE, value=text)) if scalar else (QUADRATIC, Elasticity(exact=BODY, fix=text))
    )
    system = discretize(volume, given)
    matrix = system.operator @ np.eye(len(system.load))
    assert np.abs(matrix - matrix.T).max() < 1e-12 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    if scalar:
        diagonal = np.stack([system.patches[0].matrix.diagonal()])
        assert np.diag(matrix).reshape(system.right.shape) == pytest.approx(
            diagonal[:, *system.patches[0].space.window]
        )


def test_the_block_of_a_component_has_the_diagonal_of_the_matrix(coarse_regions):
    system = discretize(QUADRATIC, Elasticity(exact=BODY, roller="x + y < 0.3 or nz > 0.5", fix="z < 0"))
    matrix = (system.operator @ np.eye(len(system.load))).diagonal().reshape(system.right.shape)
    blocks = [system.patches[0].matrix.block(i).diagonal()[system.patches[0].space.window] for i in range(3)]
    assert matrix == pytest.approx(np.stack(blocks), rel=1e-8)


@pytest.mark.parametrize("degree", [2, 3])
def test_rates_beside_those_of_whole_faces(degree):
    errors = {
        text: [
            solve_problem(TWISTED, Poisson(exact=WAVE, value=text), refine=level, degree=degree).report
            for level in (1, 2)
        ]
        for text in ("u0", "x + y < 0.3 or nz > 0.5")
    }
    (whole, cut) = errors.values()
    assert np.log2(cut[0].l2 / cut[1].l2) > degree + 0.7
    assert [found.l2 for found in cut] == pytest.approx([found.l2 for found in whole], rel=0.25)
    assert all(b.iterations <= 2.0 * max(a.iterations, 20) for a, b in zip(whole, cut, strict=True))


def test_a_displacement_of_the_space_is_met_exactly_with_parts_of_components(coarse_regions):
    linear = ("0.1*x + 0.2*y", "0.3*z", "0.1*x - 0.1*z")
    for supports in (
        {"fix": "x < 0.7 and nz > 0.5"},
        {"fix": {"x < 0.7": (None, None, "0.1*x - 0.1*z"), "nx > 0.5": ("0.1*x + 0.2*y", "0.3*z", None)}},
        {"roller": ["nx < -0.5", "ny < -0.5 and x > 1.3", "nz > 0.5 and y < 0.4"]},
    ):
        found = solve_problem(BAR, Elasticity(exact=linear, **supports), tolerance=1e-13)
        assert found.report.l2_relative < 1e-10, supports


def test_a_law_of_ones_own_without_symmetry_is_held_on_a_region(coarse_regions):
    class Wind(Form):
        symmetric = False

        def flux(self, u, grad, x):
            return grad

        def react(self, u, grad, x):
            return grad[:, 0]

    found = [
        solve_problem(TWISTED, Problem(Wind(), exact=WAVE, value={text: None}), refine=1).report.l2
        for text in ("u0", "x + y < 0.3 or nz > 0.5")
    ]
    assert found[1] == pytest.approx(found[0], rel=0.2)


def test_an_exchange_and_an_inflow_on_regions_are_those_of_faces():
    on_faces = Poisson(source="1", boundary="2", neumann={"u1": "x"}, robin={"v0": ("3", "6"), **{}})
    free = Poisson(
        source="1", value={"u0 or v1 or w0 or w1": "2"}, conditions=[Flux("u1", "x")], exchange={"v0": ("3", "2")}
    )
    one, other = (solve_problem(TWISTED, problem, refine=1) for problem in (on_faces, free))
    assert one.coefficients == pytest.approx(other.coefficients, abs=1e-7)


def test_a_pressure_acts_against_the_normal_and_a_spring_pulls_back():
    found = solve_problem(BAR, Elasticity(spring={"nx < -0.5": 50.0}, pressure={"nx > 0.5": 2.0}, young=1e4))
    assert found.report.balance.load == pytest.approx((-2.0, 0.0, 0.0), abs=1e-9)
    assert found.report.balance.reactions["spring 'nx < -0.5'"] == pytest.approx((2.0, 0.0, 0.0), abs=1e-7)
    assert found([[0.0, 0.5, 0.5]])[0, 0] == pytest.approx(-2.0 / 50.0, rel=1e-2)


@pytest.mark.parametrize(
    "supports",
    [{"fix": "u0"}, {"fix": "x < 0.31"}, {"fix": {"u0": (0, 0, 0), "nx > 0.5 and z > 0.4": (0, None, 0.01)}}],
)
def test_reactions_balance_what_acts_on_the_body(supports, coarse_regions):
    law = Elasticity(body_force=(0, 0, -1), load={"nz > 0.5 and x > 2": (0, "x", 0)}, young=100.0, **supports)
    found = solve_problem(BAR, law).report.balance
    assert found.load == pytest.approx((0.0, 6.0, -4.0), abs=1e-9)
    assert np.sum([found.load, *found.reactions.values()], axis=0) == pytest.approx(0.0, abs=1e-8)
    assert found.imbalance < 1e-8


def test_heat_that_comes_in_goes_out(coarse_regions):
    found = solve_problem(BAR, Poisson(value={"x < 0.3": 100.0}, exchange={"x > 1": (2.0, 20.0)}, kappa="10"))
    out, into = found.report.balance.reactions.values()
    assert out[0] == pytest.approx(-into[0], rel=1e-7) and out[0] > 0.0 and found.report.balance.imbalance < 1e-8


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fix": "x > 5", "load": {"u1": (1, 0, 0)}}, r"fix 'x > 5': no part of the boundary lies there; the body"),
        ({"fix": "x < 1", "load": {"x < 2": (1, 0, 0)}}, r"acts where fix 'x < 1' holds .*write 'x < 2 and not"),
        ({"load": {"u1": (1, 0, 0)}}, "no support holds the body"),
        ({"roller": "nx < -0.5", "load": {"u1": (1, 0, 0)}}, "leave the body free to move"),
        ({"roller": ["nx < -0.5", "ny < -0.5"], "load": {"u1": (1, 0, 0)}}, r"\(0, 0, -?1, 0, 0, 0\) is not held"),
        ({"fix": {"x < 1": (0, 0, 0), "x < 2": (1, 0, 0)}}, "overlap and contradict each other at"),
        (
            {"fix": {"u0": 0, "x < 0.1": (0, 0, 1)}},
            r"fix 'x < 0.1' and fix 'u0' overlap and contradict each other at \(0,",
        ),
        ({"fix": {"u0": 0, "u0 or v0": (0, 0, 1)}}, "fix 'u0 or v0' and fix 'u0' overlap and contradict"),
        ({"fix": "u0", "conditions": [Fix("u0", (0, 0, 1))]}, "fix 'u0' and fix 'u0' overlap and contradict"),
        ({"fix": "u0", "roller": {"x < 1": 0.1}}, "roller 'x < 1' and fix 'u0' overlap and contradict"),
        ({"fix": "u0", "load": {"x < 1": (0, 0, -1)}}, r"where fix 'u0' holds .*write 'x < 1 and not \(u0\)'"),
        ({"fix": "u0", "pressure": {"nx < -0.9 and y < 0.05": 1}}, "acts where fix 'u0' holds the body"),
        ({"fix": "u0", "load": {"u0": (0, 0, -1)}}, "load 'u0' acts where fix 'u0' holds .*: give one of them$"),
        (
            {"fix": "u0", "spring": {"nx < -0.9": 1}},
            "no part of the boundary lies there but what fix 'u0' may hold;",
        ),
        ({"fix": "u0", "displacement": (0, 0, 0)}, "not both"),
        ({"fix": "u0", "load": {"u1": None}}, "load 'u1' has no data"),
        ({"fix": {"u0": (None, None, None)}}, "gives no component"),
        ({"fix": "u0", "spring": {"x > 3": -1.0}}, "must be zero or positive"),
    ],
)
def test_what_cannot_hold_a_body_is_refused_in_one_line(given, says, coarse_regions):
    with pytest.raises(ValueError, match=says) as caught:
        solve_problem(BAR, Elasticity(**given))
    assert "\n" not in str(caught.value)


def test_conditions_that_agree_may_overlap_on_a_whole_face():
    held = {"u0": 0, "x < 0.5": (0, None, "x")}
    law = Elasticity(fix=held, conditions=[Fix("u0 or u0")], load={"nx > 0.5": (0, 0, 1)}, spring={"z < 0.5": 1.0})
    assert discretize(BAR, law).patches[0].space.dirichlet == ("u0",)


def test_a_whole_face_of_one_patch_and_a_region_that_contradict_are_refused():
    pair = iga_nn.Body.from_patches(
        [BSplineVolume.from_function(lambda u, v, w, i=i: (i + u, v, w), 4) for i in range(2)]
    )
    for faces, region in (("p1_u1", "x > 1.9"), ("v0", "p1_v0")):
        with pytest.raises(ValueError, match="overlap and contradict each other"):
            solve_problem(pair, Poisson(value={faces: 1, region: 2}))
    assert solve_problem(pair, Poisson(value={"p0_u0": 1, "p1_u1": 2})).report.converged


def test_tiny_regions_stay_coercive_or_are_refused():
    for size in (0.3, 0.1, 0.03, 0.01, 1e-5):
        law = Elasticity(fix=f"nx < -0.5 and y < {size} and z < {size}", load={"nx > 0.5": (0, 0, 1)})
        try:
            system = discretize(BAR, law)
        except ValueError as error:
            assert "no part of the boundary" in str(error) and size < 0.02
            continue
        matrix = system.operator @ np.eye(len(system.load))
        assert np.linalg.eigvalsh(matrix)[0] > 0.0


def test_regions_of_a_left_handed_volume_give_the_same_solution(coarse_regions):
    turned = BSplineVolume(BAR.degrees, BAR.knots, BAR.control_points[::-1])
    law = Elasticity(fix="x < 0.7", load={"nx > 0.5": (0, 0, 1)}, pressure={"nz > 0.5 and x > 2": 0.5})
    one, other = solve_problem(BAR, law), solve_problem(turned, law)
    assert one([[1.0, 0.5, 0.5]]) == pytest.approx(other([[0.0, 0.5, 0.5]]), rel=1e-6, abs=1e-5)


def test_few_iterations_where_all_of_a_curved_boundary_is_a_region():
    volume = mapped(lambda u, v, w: (u + 0.3 * v * v, v + 0.2 * u * w, w + 0.2 * u * v), (12, 12, 12))
    strong, weak = (
        solve_problem(volume, Poisson(exact=WAVE, **how)).report for how in ({}, {"value": {"x > -9": None}})
    )
    assert weak.iterations <= 2 * strong.iterations and weak.l2 == pytest.approx(strong.l2, rel=0.1)


def test_scaled_regions_mean_the_same_in_other_units(coarse_regions):
    large = BAR.transformed(1000.0, np.array([5.0, 6.0, 7.0]))
    one, other = (
        solve_problem(volume, Poisson(value={"X < -0.7 and Z < 0.1": 1.0}, exchange={"nx > 0.5": (alpha, 0.0)}))
        for volume, alpha in ((BAR, 1.0), (large, 1e-3))
    )
    assert one([[0.7, 0.3, 0.2]]) == pytest.approx(other([[0.7, 0.3, 0.2]]), rel=1e-6)


def test_a_region_of_the_cube_is_held_by_the_space_itself():
    strong = discretize(TWISTED, Poisson(exact=WAVE, value="u0 or w1"))
    assert strong.patches[0].space.dirichlet == ("u0", "w1")
    weak = discretize(TWISTED, Poisson(exact=WAVE, value="u0 and x > -9"))
    assert weak.patches[0].space.dirichlet == () and [*weak.patches[0].matrix.faces] == list(FACE_NAMES)


def test_modes_of_a_body_on_rollers_leave_its_free_motions_out():
    found = iga_nn.modes(BAR, Elasticity(roller="nx < -0.5", young=100.0, poisson_ratio=0.0), n=1)
    assert found.rigid == 3  # two shifts along the plane and a turn in it


@pytest.mark.parametrize("thickness", [1e-3, 2e-5])
def test_a_foil_that_is_held_along_its_edge_is_held(thickness):
    """Pulled across at its other end it bends by F L^3 / (3 E I); turned about the edge, the edge hardly moves."""
    foil = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, thickness * w), (5, 4, 4))
    load = {"nx > 0.99": (0, 0, thickness**2)}
    law = iga_nn.Elasticity(young=1.0, poisson_ratio=0.0, fix="nx < -0.99", load=load)
    down = iga_nn.solve(foil, law, max_iterations=3000)([[1.0, 0.5, 0.5]])[0, 2]
    assert down == pytest.approx(4.0, rel=1e-3)
    with pytest.raises(ValueError, match=r"free to move: of its shifts along and turns about x, y, z, \("):
        iga_nn.solve(foil, iga_nn.Elasticity(young=1.0, roller="nx < -0.99", load={"nx > 0.99": (1, 0, 0)}))
