"""The first rounds on few control points: how many, and that the map is carried to the fine knots as it is."""

from dataclasses import replace

import numpy as np
import pytest

from parameterize.config import preset
from parameterize.optimization.rounds import coarse_knots
from parameterize.spline.bspline import open_uniform_knots

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
