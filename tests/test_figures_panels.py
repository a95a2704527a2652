"""Places of views, texts and colour bars on a figure."""

import numpy as np
import pytest
from matplotlib.patches import Patch as Swatch

from iga_nn.figures.colors import ColorRange
from iga_nn.figures.panels import VIEW, Rendered, panels_of
from iga_nn.figures.style import color_bar, name_below, save

WIDE = ColorRange(-123456.789, 234567.8, beyond=1e6)
EVEN = ColorRange(0.0, 1.0, remark="below 1e-200 everywhere")
HEADINGS = (
    "The deformed body: displacements, at most 0.04, are drawn 8 times as large",
    "The lowest modes, coloured by their displacement",
)
MANY = ColorRange(1e-12, 1e-3, logarithmic=True)


@pytest.mark.parametrize("name", ["p3, p23", "Open CASCADE STEP translator 7.8 5.1"])
def test_a_legend_of_long_names_fits_on_the_figure(name):
    figure, _ = panels_of(1, 2)
    name_below(figure, [Swatch(label=name)] * 12, 4)
    save(figure, None, HEADINGS[0])
    drawn, (width, _) = figure.get_tightbbox(), figure.get_size_inches()
    assert drawn.x0 >= 0.0 and drawn.x1 <= width


@pytest.mark.parametrize("heading", HEADINGS)
@pytest.mark.parametrize("limits", [None, WIDE, EVEN, MANY])
@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 2), (2, 3)])
def test_no_text_leaves_the_figure_and_no_view_changes_its_size(rows, columns, limits, heading):
    figure, panels = panels_of(rows, columns)
    for panel in panels.flat:
        Rendered(panel, np.zeros((56, 72, 3), dtype=np.uint8))
        panel.set_title("front", fontsize=13, y=1.0)
    name_below(figure, [Swatch(label=f"p{k}, p{k + 20}") for k in range(3 * columns)], 3)
    if limits is not None:
        color_bar(figure, limits, "mean of tanh(√ARAP / 2), each in its own box", limits.said("N/mm²"))
    save(figure, None, heading)
    width, height = figure.get_size_inches()
    drawn = figure.get_tightbbox()
    assert drawn.x0 >= 0.0 and drawn.y0 >= 0.0 and drawn.x1 <= width and drawn.y1 <= height
    places = [panel.get_position() for panel in panels.flat]
    assert np.allclose([(place.width * width, place.height * height) for place in places], VIEW)


def test_a_figure_without_an_ending_is_refused(tmp_path):
    figure, _ = panels_of(1, 1)
    with pytest.raises(ValueError, match=r"\.png or \.pdf"):
        save(figure, tmp_path / "figure")
