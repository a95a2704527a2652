"""Ranges of colours, of fields with a peak as well."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex

import iga_nn
from iga_nn.figures import palette
from iga_nn.figures.colors import ColorRange, even_range, joint_range, range_of_most
from iga_nn.figures.fields import fields_of
from iga_nn.figures.panels import panels_of
from iga_nn.figures.style import color_bar
from iga_nn.report.viewer import scene_of
from parameterize.spline.volume import BSplineVolume

PEAK = [np.concatenate([np.linspace(0.0, 1.0, 1000), [9.0]])]
EVEN = [np.linspace(0.0, 1.0, 1000)]


def most(values, **how):
    return range_of_most(values, np.ones_like(values[-1]), **how)


def test_a_range_without_its_peak():
    shown = most(PEAK)
    assert (shown.low, shown.beyond, shown.below) == (0.0, 9.0, None) and shown.high == pytest.approx(0.995, abs=2e-3)
    assert shown.whole == even_range(PEAK) and most(EVEN) == even_range(EVEN)
    np.testing.assert_allclose(shown.shares(np.array([0.0, 0.5 * shown.high, 9.0])), [0.0, 0.5, 1.0])
    sunk = most([-PEAK[0]])
    assert (sunk.high, sunk.below, sunk.beyond) == (0.0, -9.0, None)


def test_volumes_weigh_and_singular_samples_do_not_count():
    heavy = range_of_most(PEAK, np.where(PEAK[0] == 9.0, 1000.0, 1.0))
    assert not heavy.is_part
    near = np.linspace(0.0, 9.0, 100)
    assert most([near], counted=near < 3.0).high == pytest.approx(3.0, abs=0.1)


def test_the_legend_says_the_share_and_the_peak_with_units():
    shown = replace(most(PEAK), places=((1e-17, 2.0, 3.0), None), without=True)
    assert shown.said("MPa", "mm") == "99 % of the body away from singular places; largest 9 MPa at (0, 2, 3) mm"
    assert most(EVEN).said("MPa") == ""


def test_fields_of_several_frames_have_one_range():
    assert joint_range([even_range(EVEN)], EVEN) == even_range(EVEN)
    joint = joint_range([most(PEAK), most(EVEN)], PEAK + EVEN)
    assert (joint.high, joint.beyond) == (1.0, 9.0)


def test_an_arrow_at_the_bar_says_that_values_lie_beyond():
    for limits, extend in ((even_range(EVEN), "neither"), (most(PEAK), "max"), (most([-PEAK[0]]), "min")):
        figure, _ = panels_of(1, 1)
        color_bar(figure, limits, "stress", limits.said())
        assert figure.axes[-1]._colorbar.extend == extend
        assert ("99 % of the body" in figure.get_supxlabel()) == limits.is_part


@pytest.mark.parametrize("support", ["fix", "roller"])
def test_stress_is_coloured_as_it_is_outside_of_singular_places(support):
    """A beam clamped at one end, and one that slides there, in uniform tension."""
    beam = BSplineVolume.from_function(lambda u, v, w: (8.0 * u, v, w), (11, 4, 4))
    supports = {"fix": {"fix": "u0"}, "roller": {"roller": "u0 or v0 or w0"}}[support]
    solution = iga_nn.solve(beam, iga_nn.Elasticity(load={"u1": (1, 0, 0)}, **supports))
    limits = fields_of(solution)[0].limits
    scene = SimpleNamespace(**scene_of(beam, solution)["fields"][0])
    if support == "roller":
        assert not limits.is_part and scene.shown == [scene.low, scene.high] and scene.said == ""
    else:
        assert limits.high < limits.beyond == scene.high
        assert scene.shown[1] == limits.high == pytest.approx(1.0, abs=0.05)
        assert scene.said.startswith("99 % of the body away from singular places; largest")
    assert not any(field.limits.without for field in fields_of(solution)[1:])  # displacements are finite everywhere


def test_the_palette_and_the_shares_are_those_of_matplotlib():
    assert list(palette.TWENTY) == [to_hex(color) for color in colormaps["tab20"].colors]
    assert list(palette.TEN) == [to_hex(color) for color in colormaps["tab10"].colors]
    values = np.geomspace(1e-9, 10.0, 500)
    for limits in (ColorRange(1e-3, 4.0), ColorRange(1e-6, 1.0, logarithmic=True)):
        expected = limits.norm()(values)
        np.testing.assert_allclose(limits.shares(values), expected, atol=1e-15)
        np.testing.assert_allclose(limits.colors(values), colormaps[palette.MAP](expected)[:, :3], atol=0.002)
