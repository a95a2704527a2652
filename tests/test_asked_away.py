import numpy as np
import pytest

import iga_nn
from solve.ask import Ask
from solve.asked.away import away
from solve.asked.functional import functional

ROD = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), control_points=7)
HELD = iga_nn.Elasticity(fix="u0", load={"u1": (0, 0, 1)}, young=1000.0)  # infinite at the rim of u0


@pytest.fixture(scope="module")
def bent():
    return iga_nn.solve(ROD, HELD)


def made(text, solution):
    return away(functional(Ask(text), HELD, ROD), solution)


def test_the_largest_stress_lies_farther_than_two_spans_from_the_rim(bent):
    asked = made("von_mises max", bent)
    value, at = asked.found(bent)
    near = functional(Ask("von_mises max"), HELD, ROD).value(bent)
    assert value < near and not bent.singular.is_near([at])[0]
    radius = max(place.radius for place in bent.singular)
    assert f"farther than 2 spans (at most {radius:.3g}) from the rim of fix 'u0'" in asked.answer(bent).said
    assert value == pytest.approx(bent.extremes("von_mises").largest, rel=1e-3)


def test_a_part_near_to_the_rim_has_a_smaller_radius_or_none(bent):
    for part, said in {
        "x < 0.1": "farther than 1 span (",
        "x < 0.1 and y < 0.2": "farther than 0.5 spans (",
        "x < 0.02 and y < 0.05": "without meaning",
    }.items():
        assert said in made(f"von_mises max over {part}", bent).said


def test_displacements_and_means_have_no_such_place(bent):
    for text in ("uz max", "magnitude max over x < 0.1", "mean von_mises", "von_mises at (2, 0.5, 0.5)"):
        assert "infinite" not in made(text, bent).said


def test_a_stress_at_a_singular_place_says_so(bent):
    assert "within 2 spans of the rim of fix 'u0', where it is infinite" in made("von_mises at (0, 0, 0.5)", bent).said


@pytest.mark.slow
def test_another_solution_has_the_same_radius(bent):
    asked = made("von_mises max", bent)
    finer = iga_nn.solve(ROD, HELD, degree=4)
    point = asked.found(finer)[1]
    assert not bent.singular.is_near([point])[0]
    assert np.isfinite(asked.value(finer))
