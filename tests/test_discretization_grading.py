"""Gradings: breakpoints that are finer at some places of a body, the same on both sides of every interface."""

import json

import numpy as np
import pytest
from bodies import ring
from cube_grids import box, plate, two
from test_linear_low_order import rod

import iga_nn
from iga_nn import Grading
from solve.discretization.space import embedded, trial_space


def towards(body, sheet, levels):
    """Return a grading whose first span of a sheet is halved so many times."""
    found = Grading.of(body)
    for _ in range(levels):
        found = found.refined({sheet: [1] + [0] * (found.spans[sheet] - 1)})
    return found


def test_halving_the_first_span_again_and_again_grades_geometrically():
    found = towards(box((0, 0, 0)), 0, 3)
    assert found.rows[0].tolist() == [0, 0.125, 0.25, 0.5, 1, 2]
    assert found.spans == (5, 2, 2)
    assert found.refined({0: [False, False, False, True, False]}).rows[0].tolist() == [0, 0.125, 0.25, 0.5, 0.75, 1, 2]


def test_uniform_is_refine_to_the_last_bit():
    volume = iga_nn.BSplineVolume.uniform(np.random.default_rng(1).random((6, 5, 4, 3)), 3)
    places = Grading.of(volume).uniform(3).places(0)
    for degree in (None, 4):
        ours, theirs = trial_space(volume, degree=degree, places=places), trial_space(volume, 3, degree)
        assert all(map(np.array_equal, ours.knots, theirs.knots))


def test_refine_halves_graded_spans_and_new_knots_are_simple():
    volume, grading = box((0, 0, 0), 1, 2), Grading.of(box((0, 0, 0), 1, 2)).refined({2: [1]})
    space = trial_space(volume, 1, 3, places=grading.places(0))
    assert space.knots[2].tolist() == [0, 0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1, 1]
    assert space.knots[0].tolist() == [0, 0, 0, 0, 0.5, 1, 1, 1, 1]


def test_a_solution_of_a_quadratic_is_exact_on_patches_that_run_all_ways():
    body = rod(3, 1.0)  # the second patch is reversed and exchanged
    grading = Grading.of(body)
    for sheet in (1, 2, 3):
        grading = grading.refined({sheet: np.arange(grading.spans[sheet]) == 0})
        grading = grading.refined({sheet: 2 * (np.arange(grading.spans[sheet]) == 0)})
    report = iga_nn.solve(body, iga_nn.Poisson(exact="x**2 + y*z"), grading=grading).report
    assert report.l2_relative < 1e-9
    assert report.elements == sum(np.prod([len(row) - 1 for row in grading.places(i)]) for i in range(3))


def test_a_sheet_that_is_tied_to_itself_in_reverse_stays_symmetric():
    body = ring(3, twist=1.0)
    grading = towards(body, 1, 3)
    row = grading.rows[1]
    assert np.array_equal(row, row[-1] - row[::-1])
    assert iga_nn.solve(body, iga_nn.Poisson(exact="x*y"), grading=grading).report.converged
    ones = [tuple(np.arange(len(row) - 1.0) for row in grading.places(patch)) for patch in range(3)]
    assert np.ptp(grading.collected(ones)[1]) == 0.0  # 0, 1, 2.. and its reverse


def test_a_solution_is_the_start_on_a_finer_grading():
    body = plate()
    coarse = towards(body, 1, 2)
    fine = coarse.refined({1: np.arange(coarse.spans[1]) < 2, 0: [1, 0]})
    assert fine.contains(coarse) and not coarse.contains(fine)
    problem = iga_nn.Poisson(source="1")
    first = iga_nn.solve(body, problem, grading=coarse)
    for i, own in enumerate(first.field.patches):
        space = trial_space(body.patches[i], places=fine.places(i))
        assert np.isfinite(embedded(own.coefficients, own.degrees, own.knots, space)).all()
    again = iga_nn.solve(body, problem, grading=fine, start=first.field)
    assert again.report.residuals[0] < 0.5


def test_json_gives_the_same_grading_and_refuses_that_of_another_body():
    body = plate()
    grading = towards(body, 2, 4)
    again = Grading.from_dict(body, json.loads(json.dumps(grading.as_dict)))
    assert all(map(np.array_equal, again.rows, grading.rows))
    with pytest.raises(ValueError, match="no grading of this body"):
        Grading.from_dict(two(), grading.as_dict)
    with pytest.raises(ValueError, match="another body"):
        iga_nn.solve(two(), iga_nn.Poisson(source="1"), grading=grading)


@pytest.mark.parametrize("given", [{9: [1, 0]}, {0: [1]}, {0: [-1, 0]}, {0: [60, 0]}])
def test_marks_that_fit_no_sheet_are_refused(given):
    with pytest.raises(ValueError, match="sheet"):
        Grading.of(box((0, 0, 0))).refined(given)
