"""The first rounds on few control points: how many, and that the map is carried to the fine knots as it is."""

from dataclasses import replace

import numpy as np
import pytest

from parameterize.coarse import coarse_knots, interpolated
from parameterize.config import preset
from parameterize.spline.bspline import evaluate_grid, greville, open_uniform_knots

FAST = preset("fast")


@pytest.mark.parametrize(
    ("control_points", "degree", "shaping", "growth"),
    [(30, 3, 18, 12), (60, 3, 35, 22), (6, 3, 5, 4), (4, 3, 4, 4), (30, 2, 18, 11)],
)
def test_the_first_rounds_have_a_share_of_the_spans(control_points, degree, shaping, growth):
    spline = replace(FAST.spline, control_points=control_points, degree=degree)
    for share, count in ((5 / 9, shaping), (1 / 3, growth)):
        for knots in coarse_knots(spline, share):
            assert np.array_equal(knots, open_uniform_knots(count, degree))


@pytest.mark.parametrize("degree", [2, 3])
def test_a_map_on_every_third_knot_is_carried_exactly(degree):
    """The fine knots contain the coarse ones: the fine space contains the map."""
    knots, finer = ((open_uniform_knots(degree + spans, degree),) * 3 for spans in (2, 6))
    control = np.random.default_rng(0).normal(size=(3, *[degree + 2] * 3))
    carried = interpolated(control, knots, finer, degree)
    places = [np.linspace(0.0, 1.0, 7)] * 3
    values = [
        evaluate_grid((degree,) * 3, row, np.moveaxis(points, 0, -1), places)
        for row, points in ((knots, control), (finer, carried))
    ]
    assert values[0] == pytest.approx(values[1], abs=1e-12)


def test_a_linear_map_is_carried_to_any_knots():
    knots, finer = ((open_uniform_knots(3 + spans, 3),) * 3 for spans in (3, 7))
    cube = np.stack(np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij"))
    carried = interpolated(cube, knots, finer, 3)
    places = [np.linspace(0.0, 1.0, 5)] * 3
    values = evaluate_grid((3,) * 3, finer, np.moveaxis(carried, 0, -1), places)
    assert values == pytest.approx(np.stack(np.meshgrid(*places, indexing="ij"), axis=-1), abs=1e-12)
