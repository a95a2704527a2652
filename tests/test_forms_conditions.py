"""A condition is one object; the keywords of a problem are short forms that make it."""

import dataclasses

import numpy as np
import pytest

import iga_nn
from solve import benchmark_volume, discretize
from solve.forms import conditions

BODY = benchmark_volume(2)


def load_of(problem):
    return discretize(BODY, problem).load


@pytest.mark.parametrize(
    ("short", "objects"),
    [
        ({"value": {"u0": 2}}, [iga_nn.Value("u0", 2)]),
        ({"value": "u0 or v1"}, [iga_nn.Value("u0 or v1")]),
        ({"exchange": {"u1": ("3", "x")}}, [iga_nn.Exchange("u1", "3", "x")]),
    ],
)
def test_a_short_form_makes_the_object_of_a_scalar_law(short, objects):
    one, other = iga_nn.Poisson(source="1", **short), iga_nn.Poisson(source="1", conditions=objects)
    assert one.conditions == other.conditions
    assert np.array_equal(load_of(one), load_of(other))


def test_short_forms_make_the_objects_of_an_elastic_body():
    short = iga_nn.Elasticity(
        fix={"u0": (0, None, 0)},
        roller="v0",
        symmetry={"w0": 0.1},
        load={"u1": (0, 0, "x")},
        pressure={"w1": 2},
        spring={"v1": (3, (0, 0, 1)), "nx > 0.9": 4},
    )
    objects = [
        iga_nn.Fix("u0", (0, None, 0)),
        iga_nn.Roller("v0"),
        iga_nn.Symmetry("w0", 0.1),
        iga_nn.Load("u1", (0, 0, "x")),
        iga_nn.Pressure("w1", 2),
        iga_nn.Spring("v1", 3, (0, 0, 1)),
        iga_nn.Spring("nx > 0.9", 4),
    ]
    body = iga_nn.Elasticity(conditions=objects)
    assert short.conditions == body.conditions
    assert np.array_equal(load_of(short), load_of(body))
    assert [one.text for one in body.conditions] == ["0;free;0", "0", "0.1", "0;0;x", "2", "3, outside 0;0;1", "4"]


def test_a_problem_that_is_replaced_has_its_conditions_once():
    first = iga_nn.Poisson(value="u0", neumann={}, conditions=[iga_nn.Flux("u1", "1")])
    again = dataclasses.replace(first, source="x")
    assert again.conditions == first.conditions and len(again.conditions) == 2
    faces = dataclasses.replace(iga_nn.Poisson(source="0", neumann={"u0": "1"}), source="x")
    assert [one.role for one in faces.faces] == ["neumann u0", "boundary"]


def test_a_keyword_of_faces_makes_conditions_on_whole_faces():
    problem = iga_nn.Poisson(source="0", boundary="1", neumann={"u1": "x"}, robin={"p1_w0": ("2", "3")})
    assert [(type(one), one.faces) for one in problem.faces] == [
        (conditions.Flux, ("u1",)),
        (conditions.Robin, ("p1_w0",)),
        (conditions.Value, ("u0", "v0", "v1", "w0", "w1")),
    ]
    patch = problem.on_patch(1, ("u1", "w0", "w1"))
    assert [(type(one).__name__, one.faces) for one in patch.faces] == [
        ("Flux", ("u1",)),
        ("Robin", ("w0",)),
        ("Value", ("w1",)),
    ]
    assert patch.dirichlet == ("w1",) and problem.on_patch(0, ("w0",)).dirichlet == ("w0",)


def test_robin_and_exchange_are_one_condition():
    """flux . n + 2 u = 6 is flux . n = 2 (3 - u)."""
    held = iga_nn.Value("u0", 1)
    robin = iga_nn.Poisson(source="0", conditions=[held, iga_nn.Robin("u1", 2, 6)])
    exchange = iga_nn.Poisson(source="0", conditions=[held, iga_nn.Exchange("u1", 2, 3)])
    one, other = (iga_nn.solve(BODY, problem) for problem in (robin, exchange))
    assert np.allclose(one.coefficients, other.coefficients, rtol=1e-9)
    assert [one.role for one in robin.conditions] == ["value 'u0'", "robin 'u1'"]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: iga_nn.Poisson(neumann={"u0": "1"}, conditions=[iga_nn.Value("u1")]), "not both"),
        (lambda: iga_nn.Poisson(source="1", conditions=[iga_nn.Flux("u1")]), "flux 'u1' has no data"),
        (lambda: iga_nn.Elasticity(conditions=[iga_nn.Fix("u0", (None,) * 3)]), "fix 'u0': gives no component"),
        (lambda: iga_nn.Elasticity(conditions=[iga_nn.Load("u0", (0, 1))]), "load 'u0' must have three entries"),
        (lambda: iga_nn.Value(3), "a region must be text"),
        (lambda: iga_nn.Fix(["u0", "u1"]), "a condition has one region, such as 'u0 or u1', got"),
        (lambda: iga_nn.Exchange("u0", None, 0), "exchange 'u0': the factor must be a number, .* got None"),
        (lambda: iga_nn.Spring("u0", None), "spring 'u0': the factor must be a number, .* got None"),
        (lambda: iga_nn.Robin("u0", None), "robin 'u0': the alpha must be a number, .* got None"),
        (lambda: iga_nn.Elasticity(fix={"u0": (0, 0, np.nan)}), r"fix 'u0' must be finite, got \(0, 0, nan\)"),
        (lambda: iga_nn.Poisson(value={"u0": np.inf}), "value 'u0' must be finite, got inf"),
        (
            lambda: iga_nn.Poisson(conditions=[iga_nn.Roller("u0")]),
            "roller 'u0' acts along the normal: u must have three",
        ),
        (lambda: iga_nn.Poisson(conditions=[iga_nn.Symmetry("u0")]), "symmetry 'u0' acts along the normal"),
        (lambda: iga_nn.Poisson(conditions=[iga_nn.Pressure("u0", 1)]), "pressure 'u0' acts along the normal"),
    ],
)
def test_conditions_that_mean_nothing_are_refused(make, says):
    with pytest.raises(ValueError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: iga_nn.Poisson(conditions=["u0"]), r"conditions must be objects such as iga_nn.Value\('u0', 1\)"),
        (lambda: iga_nn.Poisson(conditions=[iga_nn.Value]), "conditions must be objects such as"),
        (lambda: iga_nn.Elasticity(conditions=iga_nn.Fix("u0")), "conditions must be a list of conditions .* got Fix"),
        (lambda: iga_nn.Elasticity(conditions=None), "conditions must be a list of conditions .* got None"),
        (lambda: iga_nn.Elasticity(conditions="u0"), "conditions must be a list of conditions .* got 'u0'"),
        (lambda: iga_nn.Poisson(conditions=3), "conditions must be a list of conditions .* got 3"),
        (lambda: conditions.Condition("u0", 1), "Condition is a base class"),
        (lambda: iga_nn.Load("u1", (0, 0, 1), factor=3), "factor"),
        (lambda: iga_nn.Fix("u1", factor=3), "factor"),
        (lambda: iga_nn.Elasticity(fix="u0").on_surface(3), "must be a part's surface mesh, .* got 3"),
    ],
)
def test_objects_of_a_wrong_type_are_refused(make, says):
    with pytest.raises(TypeError, match=says) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.filterwarnings("ignore:force")
def test_a_former_keyword_beside_the_new_one_is_refused():
    with pytest.raises(ValueError, match="force is the former name of body_force: give body_force alone"):
        iga_nn.Elasticity(fix="u0", force=("0", "0", "1"), body_force=("0", "0", "5"))


def test_former_keywords_work_and_say_their_new_form():
    with pytest.warns(DeprecationWarning, match=r"^inflow: write conditions=\[iga_nn.Flux") as caught:
        flux = iga_nn.Poisson(source="0", value="u0", inflow={"u1": "1"})
    assert caught[0].filename == __file__
    assert flux.conditions == iga_nn.Poisson(conditions=[iga_nn.Value("u0"), iga_nn.Flux("u1", "1")]).conditions
    with pytest.warns(DeprecationWarning, match="^force: write body_force="):
        body = iga_nn.Elasticity(force=("0", "0", "1"))
    assert body.body_force == ("0", "0", "1") and body.force is None


class Hinge(iga_nn.Value):
    """Hold a body along z alone."""

    entries = 1

    def directions(self, components, normal):
        """Return z."""
        return [np.eye(3)[2][:, None] * np.ones(normal.shape[1])]


def test_a_support_of_ones_own_is_a_class():
    """A bar that is pulled along x and held along z at its ends, on rollers elsewhere."""
    bar = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), control_points=4)
    supports = [iga_nn.Roller("u0"), iga_nn.Roller("v0"), Hinge("w0"), iga_nn.Load("u1", (2, 0, 0))]
    solution = iga_nn.solve(bar, iga_nn.Elasticity(young=10, conditions=supports))
    assert solution.probe([[4, 0, 0]]) == pytest.approx(np.array([[0.8, 0, 0]]), abs=1e-8)
    assert "hinge 'w0'" in solution.report.balance.reactions
