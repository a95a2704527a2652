"""Shapes of vibrations as pictures."""

import pytest
from matplotlib.image import imread

import iga_nn
from iga_nn.figures.render import can_draw
from iga_nn.figures.solution import draw_modes


@pytest.mark.pictures
@pytest.mark.skipif(not can_draw(), reason="VTK cannot draw here")
def test_a_picture_for_each_of_the_first_modes(tmp_path):
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (3 * u, v, w), control_points=4)
    free = dict.fromkeys(("u1", "v0", "v1", "w0", "w1"), ["0"] * 3)
    found = iga_nn.modes(volume, iga_nn.Elasticity(traction=free), n=2)
    figure = draw_modes(tmp_path / "modes.png", volume, found)
    titles = [panel.get_title() for panel in figure.axes]
    assert titles == [f"{frequency:.4g} Hz" for frequency in found.frequencies]
    assert imread(tmp_path / "modes.png").std() > 0.05
