"""Gives the rendered views of a figure, its heading, legend and colour bar their places."""

import io
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray
from PIL import Image

PANEL = (440, 342)  # pixels of one view
DPI = 110
VIEW = (PANEL[0] / DPI, PANEL[1] / DPI)  # inches of one view
GAP, TITLE, HEADING, LINE, ROW, BAR = 0.15, 0.32, 0.4, 0.32, 0.28, 1.7  # inches; ROW of a legend
BAR_PLACE = (0.3, 0.2)  # inches of a colour bar: its distance from the views, its width
BAR_LENGTH = 0.85  # of the views' height
LETTER, SWATCH = 8.2e-3, 0.6  # inches, at most: of a letter a point of its size; of a legend's patch and what is around
NOTEBOOK_DPI = 72  # in a notebook a figure is as wide as the text


class Picture(Figure):
    """A figure outside pyplot, which need not be closed; a notebook shows it as the last value of a cell."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=NOTEBOOK_DPI)
        return stream.getvalue()


class Rendered(Artist):
    """A picture (height, width, 3) that fills axes; matplotlib's own is sampled anew, which takes as long as VTK."""

    def __init__(self, axes: Axes, pixels: NDArray[np.uint8]) -> None:
        super().__init__()
        self.pixels = pixels
        axes.add_artist(self)

    def get_window_extent(self, renderer: RendererBase | None = None) -> Bbox:
        """Return the place of the axes on the figure."""
        assert self.axes is not None
        return self.axes.get_window_extent(renderer)

    def draw(self, renderer: RendererBase) -> None:
        """Draw the pixels as they are, or, at another number of dots an inch, resized."""
        place, finer = self.get_window_extent(renderer), renderer.get_image_magnification()
        size = round(finer * place.width), round(finer * place.height)
        picture = Image.fromarray(self.pixels).convert("RGBA")
        if picture.size != size:
            picture = picture.resize(size)
        renderer.draw_image(renderer.new_gc(), place.x0, place.y0, np.asarray(picture)[::-1])


class Panels(Picture):
    """A figure of rendered views in rows and columns, each below its title.

    The views have one size in all figures: a heading, a legend, a line of text or a colour bar makes the figure larger.
    Matplotlib's own layouts measure every text several times, which takes as long as the views.
    """

    def __init__(self, rows: int, columns: int) -> None:
        super().__init__(dpi=DPI)
        self.panels = self.subplots(rows, columns, squeeze=False)
        self.rows_of_legend, self.legend_width = 0, 0.0
        self.heading: Any = None
        self.line: Any = None  # of text, below all
        self.bar: Any = None  # the axes of the colour bar
        for panel in self.panels.flat:
            panel.set_axis_off()

    def arrange(self) -> None:
        """Give the figure its size, and everything on it its place. Call this once all is drawn."""
        rows, columns = self.panels.shape
        views, down = columns * (VIEW[0] + GAP) - GAP, rows * (VIEW[1] + TITLE)
        above, line = HEADING * (self.heading is not None), LINE * (self.line is not None)
        below, beside = GAP + line + ROW * self.rows_of_legend, BAR if self.bar is not None else 0.0
        lengths = [width_of(text) for text in (self.heading, self.line) if text is not None]
        aside = max(GAP, 0.5 * (max([self.legend_width, *lengths]) - views))
        width, height = aside + views + max(aside, beside), above + down + below
        self.set_size_inches(width, height)
        for (row, column), panel in np.ndenumerate(self.panels):
            left, low = aside + column * (VIEW[0] + GAP), below + (rows - 1 - row) * (VIEW[1] + TITLE)
            panel.set_position((left / width, low / height, VIEW[0] / width, VIEW[1] / height))
        if self.bar is not None:
            left, length = aside + views + BAR_PLACE[0], BAR_LENGTH * down
            low = below + 0.5 * (down - length)
            self.bar.set_position((left / width, low / height, BAR_PLACE[1] / width, length / height))
            label = self.bar.yaxis.label
            label.set_fontsize(float(label.get_fontsize()) * down / max(width_of(label), down))
        middle = (aside + 0.5 * views) / width
        for legend in self.legends:
            legend.set_bbox_to_anchor((middle, (0.5 * GAP + line) / height))
        for text, inches in ((self.heading, height - 0.5 * HEADING), (self.line, 0.5 * (GAP + LINE))):
            if text is not None:
                text.set(x=middle, y=inches / height, horizontalalignment="center", verticalalignment="center")


def width_of(text: Text) -> float:
    """Return an upper bound of the inches of a line of text."""
    return LETTER * float(text.get_fontsize()) * len(text.get_text())


def panels_of(rows: int, columns: int) -> tuple[Panels, Any]:
    """Return a figure of empty panels for rendered views, and its axes (rows, columns)."""
    figure = Panels(rows, columns)
    return figure, figure.panels
