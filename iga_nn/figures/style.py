"""Holds the parts that figures share: the blank figure of matplotlib, rendered views on it, colours, the file."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.files import replacing

from .evaluate import MAP, Body
from .palette import color_labels
from .render import NAMELESS, Patch, draw, view_of, widest_view

PANEL = (720, 560)  # pixels of one view
NOTEBOOK_DPI = 72  # in a notebook a figure is as wide as the text
DECADES = 1e-4  # lower end of a logarithmic range over the largest error of the best mesh
SMALLEST = 1e-200  # smaller fields have no ticks on their colour bar
ROUNDING = 1e-14  # values whose relative difference is smaller count as one


class Picture(Figure):
    """A figure outside pyplot, which need not be closed; a notebook shows it as the last value of a cell."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=NOTEBOOK_DPI)
        return stream.getvalue()


def blank(rows: int, columns: int, inches: tuple[float, float], **grid: Any) -> tuple[Figure, Any]:
    """Return an empty figure and its axes, outside pyplot: it asks for no window system."""
    figure = Picture(figsize=inches, dpi=110, layout="constrained")
    return figure, figure.subplots(rows, columns, **grid)


def panels_of(rows: int, columns: int) -> tuple[Figure, Any]:
    """Return a figure of empty panels for rendered views, and its axes (rows, columns)."""
    figure, axes = blank(rows, columns, (4.6 * columns, 3.8 * rows + 0.8), squeeze=False)
    for panel in axes.flat:
        panel.set_axis_off()
        for axis in (panel.xaxis, panel.yaxis):  # else the layout measures the ticks that are not drawn
            axis.set_visible(False)
    return figure, axes


def show_around(
    panels: Any, patches: list[Patch], marks: Array | None = None, names: Mapping[str, Array] = NAMELESS
) -> None:
    """Draw the same patches from the front and from behind on two panels. marks, names: as in `draw`."""
    view = view_of(patches)
    for panel, title, direction in zip(panels, ("front", "back"), (view, view.turned()), strict=True):
        panel.imshow(draw(patches, direction, PANEL, marks, names))
        panel.set_title(title, fontsize=13)


def show_section(panel: Any, title: str, points: Array, colors: Array) -> None:
    """Draw points (m, n, 3) on a section in colours (m, n, 3), without shading, as the reader sees most of it."""
    patch = Patch(points, colors, lit=False)
    panel.imshow(draw([patch], widest_view(points.reshape(-1, 3)), PANEL))
    panel.set_title(title, fontsize=13)


def name_colors(figure: Figure, body: Body) -> None:
    """Write the legend of the colours of a volume's faces, or of several patches, below the panels."""
    swatches = [Swatch(color=color, label=label) for color, label in color_labels(body)]
    figure.legend(
        handles=swatches,
        loc="outside lower center",
        ncols=6 if len(swatches) <= 6 else 10,
        frameon=False,
        fontsize=12,
        columnspacing=1.2,
        handlelength=1.4,
    )


@dataclass(frozen=True)
class ColorRange:
    """Hold the limits of a colour scale.

    remark: stands in place of ticks where the field has one value, such as "0 everywhere".
    """

    low: float
    high: float
    logarithmic: bool = False
    remark: str = ""

    def norm(self) -> Normalize:
        """Return the range as a new object of matplotlib, which maps values to 0..1; colour bars change theirs."""
        kind = LogNorm if self.logarithmic else Normalize
        return kind(self.low, self.high, clip=True)

    def shares(self, values: Array) -> Array:
        """Return the places of values in the range, 0..1; 0.5 where the field has one value."""
        if self.remark:
            return np.full(np.shape(values), 0.5)
        return np.asarray(self.norm()(np.ravel(values))).reshape(np.shape(values))

    @property
    def labels(self) -> tuple[str, str]:
        """Return the texts at the two ends of a legend; a logarithmic one has all smaller values at its lower end."""
        if self.remark:
            return self.remark, ""
        if self.logarithmic:
            return f"≤ {self.low:.1e}", f"{self.high:.1e}"
        return f"{self.low:.3g}", f"{self.high:.3g}"


def even_range(values: Sequence[Array]) -> ColorRange:
    """Return the range from the lowest to the highest of all values."""
    low, high = min(float(patch.min()) for patch in values), max(float(patch.max()) for patch in values)
    size = max(abs(low), abs(high))
    if size < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(size))
    if high - low <= ROUNDING * size:
        return ColorRange(0.0, 1.0, remark=f"{high:.4g} everywhere")
    return ColorRange(low, high)


def error_range(meshes: Sequence[Sequence[Array]]) -> ColorRange:
    """Return a logarithmic range: from four decades below the largest error of the best mesh to that of the worst."""
    tops = [max(float(error.max()) for error in errors) for errors in meshes]
    if max(tops) < SMALLEST:
        return ColorRange(0.0, 1.0, remark=_smaller(max(tops)))
    return ColorRange(DECADES * min(top for top in tops if top >= SMALLEST), max(tops), logarithmic=True)


def _smaller(size: float) -> str:
    return f"below {size:.0e} everywhere" if size > 0.0 else "0 everywhere"


def colors(values: Array, limits: ColorRange) -> Array:
    """Return red, green, blue (m, n, 3) of values (m, n)."""
    return np.asarray(colormaps[MAP](limits.shares(values)))[..., :3]


def with_unit(title: str, unit: str | None) -> str:
    """Return the title of a colour bar with its unit; a dollar in it begins no formula of matplotlib."""
    return title if unit is None else title + " [" + unit.replace("$", r"\$") + "]"


def color_bar(figure: Figure, panels: Any, limits: ColorRange, title: str) -> None:
    """Draw one colour bar to the right of all panels; for a field of one value it has one colour and says the value."""
    shades = ListedColormap([colormaps[MAP](0.5)]) if limits.remark else MAP
    extend = "min" if limits.logarithmic else "neither"  # smaller values have the lowest colour
    bar = figure.colorbar(ScalarMappable(limits.norm(), shades), ax=panels, shrink=0.85, aspect=28, extend=extend)
    if limits.remark:
        bar.set_ticks([0.5], labels=[limits.remark])
    bar.set_label(title, fontsize=13)


def positive(values: NDArray[Any]) -> Array:
    """Return the values that a logarithmic axis can show, NaN for the others."""
    numbers = np.asarray(values, dtype=np.float64)
    return np.where(numbers > 0.0, numbers, np.nan)


def save(figure: Figure, path: str | Path | None, title: str = "") -> Figure:
    """Write the figure as PNG or PDF, by the ending of the path, and return it; atomic. None: only return it."""
    if title:
        figure.suptitle(title, fontsize=14)
    if path is not None:
        with replacing(Path(path)) as temporary:
            figure.savefig(temporary)
    return figure
