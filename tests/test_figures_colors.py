"""Ranges of colours, of fields with a peak as well."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import iga_nn
from iga_nn.figures.colors import even_range, joint_range, range_up_to
from iga_nn.figures.fields import fields_of
from iga_nn.figures.style import color_bar
from iga_nn.report.viewer import scene_of
from parameterize.spline.volume import BSplineVolume

VALUES = [np.array([0.0, 1.0, 2.0]), np.array([9.0])]


def test_a_range_without_its_peak():
    shown = range_up_to(2.0, VALUES)
    assert (shown.low, shown.high, shown.beyond) == (0.0, 2.0, 9.0)
    assert shown.whole == even_range(VALUES)
    np.testing.assert_allclose(shown.shares(np.array([0.0, 1.0, 9.0])), [0.0, 0.5, 1.0])
    for high in (-1.0, 9.0, 12.0):
        assert range_up_to(high, VALUES) == even_range(VALUES)


def test_fields_of_several_frames_have_one_range():
    assert joint_range([even_range(VALUES)], VALUES) == even_range(VALUES)
    assert joint_range([range_up_to(1.0, VALUES), range_up_to(2.0, VALUES)], VALUES) == range_up_to(2.0, VALUES)


def test_an_arrow_at_the_bar_says_that_values_lie_beyond():
    for limits, extend in ((even_range(VALUES), "neither"), (range_up_to(2.0, VALUES), "max")):
        figure = Figure()
        color_bar(figure, figure.subplots(), limits, "stress")
        assert figure.axes[-1]._colorbar.extend == extend
        assert ("up to 9" in figure.axes[-1].get_ylabel()) == (extend == "max")


@pytest.mark.parametrize("support", ["fix", "roller"])
def test_stress_is_coloured_as_it_is_outside_of_singular_places(support):
    """A beam clamped at one end, and one that slides there, in uniform tension."""
    beam = BSplineVolume.from_function(lambda u, v, w: (8.0 * u, v, w), (11, 4, 4))
    supports = {"fix": {"fix": "u0"}, "roller": {"roller": "u0 or v0 or w0"}}[support]
    solution = iga_nn.solve(beam, iga_nn.Elasticity(load={"u1": (1, 0, 0)}, **supports))
    limits = fields_of(solution)[0].limits
    scene = SimpleNamespace(**scene_of(beam, solution)["fields"][0])
    if support == "roller":
        assert limits.beyond is None and scene.shown == scene.high
    else:
        assert limits.high < limits.beyond == scene.high
        assert scene.shown == limits.high == pytest.approx(1.0, abs=0.05)
