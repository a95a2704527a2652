"""Holds what figures share: rendered views on their panels, legends and colour bars, the file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch
from numpy.typing import NDArray
from PIL import Image

from parameterize.arrays import Array
from parameterize.files import replacing
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import FACE_NAMES

from .colors import FACE_COLORS, ColorRange, color_labels
from .cutaway import Painted, beyond, visible
from .fields import SECTIONS, Samples
from .outline import is_by_face
from .palette import MAP
from .panels import PANEL, SWATCH, Panels, Rendered, width_of
from .render import NAMELESS, Patch, View, draw, plain_patch, view_of, widest_view
from .ticks import show_powers

PACKED = 2  # of 9: 6 % larger files than by 6 in half of the time
UP, ASIDE = 0.4, 0.25  # of a viewer in front of a cut: shows more than one side of what is left


def show(
    panel: Any,
    title: str,
    patches: Sequence[Patch],
    view: View,
    marks: Array | None = None,
    names: Mapping[str, Array] = NAMELESS,
    unit: str | None = None,
) -> None:
    """Draw patches on a panel under a title. marks, names, unit: as in `draw`."""
    (picture,) = draw(patches, [view], PANEL, marks, names, unit)
    _fill(panel, title, picture)


def _fill(panel: Any, title: str, picture: NDArray[np.uint8]) -> None:
    """Fill a panel with a picture, and write its title."""
    Rendered(panel, picture)
    panel.set_title(title, fontsize=13, y=1.0)  # a given place is not looked for


def draws() -> bool:
    """Return whether a picture of a square has more than one colour. Its window is the one that panels are drawn in."""
    u, v = np.meshgrid([0.0, 1.0], [0.0, 1.0])
    square = plain_patch(np.stack([u, v, np.zeros_like(u)], axis=-1)[None], FACE_COLORS[0])
    return bool(draw([square], [View(*np.eye(3))], PANEL)[0].std() > 1.0)


def show_around(
    panels: Any,
    patches: list[Patch],
    marks: Array | None = None,
    names: Mapping[str, Array] = NAMELESS,
    unit: str | None = None,
    view: View | None = None,
) -> None:
    """Draw the same patches from the front and from behind on two panels. marks, names, unit: as in `draw`.

    view: from the front; by default the widest one.
    """
    view = view or view_of(patches)
    pictures = draw(patches, (view, view.turned()), PANEL, marks, names, unit)
    for panel, title, picture in zip(panels, ("front", "back"), pictures, strict=True):
        _fill(panel, title, picture)


def show_inside(panels: Any, body: BodyLike, points: Samples, painted: Painted) -> None:
    """Draw the inside of a body on three panels. points: of the body at rest.

    Of a volume these are its mid-sections, without shading, as the reader sees most of each. Several patches are drawn
    without the octants on the far side of x, of y and of z, as one sees them from there.
    """
    if as_body(body).is_single:
        for number, (panel, title) in enumerate(zip(panels, SECTIONS, strict=True)):
            (patch,) = painted.at(np.array([len(FACE_NAMES) + number]))
            flat = Patch(patch.points, patch.colors, lit=False)
            show(panel, title, [flat], widest_view(patch.points.reshape(-1, 3)))
        return
    for panel, name, towards in zip(panels, "xyz", np.eye(3), strict=True):
        show(panel, f"cut across {name}", visible(body, painted, beyond(points, towards)), _alignment(towards))


def _alignment(direction: Array) -> View:
    """Return the view of a viewer who looks against an axis of space, a little from above and aside."""
    up = np.array([0.0, 1.0, 0.0]) if direction[2] else np.array([0.0, 0.0, 1.0])
    towards = direction + UP * up + ASIDE * np.cross(up, direction)
    towards /= np.linalg.norm(towards)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return View(right, np.cross(towards, right), towards)


def name_colors(figure: Panels, body: BodyLike) -> None:
    """Write the legend of the colours of a volume's faces, or of several patches, below the panels."""
    swatches = [Swatch(color=color, label=label) for color, label in color_labels(body)]
    if is_by_face(body):
        said = f"{len(as_body(body)):,} patches: each colour is a face between sharp edges"
        figure.line = figure.supxlabel(said, fontsize=12)
    if swatches:
        name_below(figure, swatches, 6 if len(swatches) <= 6 else 10)


def name_below(figure: Panels, swatches: Sequence[Swatch], columns: int) -> None:
    """Write a legend below the panels, in so many columns."""
    legend = figure.legend(
        handles=swatches,
        loc="lower center",
        ncols=columns,
        frameon=False,
        fontsize=12,
        columnspacing=1.2,
        handlelength=1.4,
        borderpad=0.0,
    )
    figure.rows_of_legend = -(-len(swatches) // columns)
    figure.legend_width = min(columns, len(swatches)) * (SWATCH + max(map(width_of, legend.get_texts())))


EXTEND = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}


def color_bar(figure: Panels, limits: ColorRange, title: str, said: str = "") -> None:
    """Draw one colour bar to the right of all panels; for a field of one value it has one colour and says the value.

    Arrows say that values outside of the range have the colours of its ends. said: a line of text on the range.
    """
    shades = ListedColormap([colormaps[MAP](0.5)]) if limits.remark else MAP
    below = limits.logarithmic or limits.below is not None  # smaller values have the lowest colour
    extend = EXTEND[below, limits.beyond is not None]
    if said:
        figure.line = figure.supxlabel(f"colours: {said}", fontsize=11)
    figure.bar = figure.add_axes((0.9, 0.1, 0.1, 0.8))  # `arrange` gives it its place
    bar = figure.colorbar(ScalarMappable(limits.norm(), shades), cax=figure.bar, extend=extend)
    if limits.logarithmic:
        show_powers(bar.ax.yaxis)
    if limits.remark:
        bar.set_ticks([0.5], labels=[limits.remark], rotation="vertical", verticalalignment="center")
    bar.set_label(title, fontsize=13)


def positive(values: NDArray[Any]) -> Array:
    """Return the values that a logarithmic axis can show, NaN for the others."""
    numbers = np.asarray(values, dtype=np.float64)
    return np.where(numbers > 0.0, numbers, np.nan)


def save(figure: Figure, path: str | Path | None, title: str = "") -> Figure:
    """Write the figure as PNG or PDF, by the ending of the path, and return it; atomic. None: only return it.

    Raises ValueError where the path has no ending.
    """
    if isinstance(figure, Panels):
        figure.heading = figure.suptitle(title, fontsize=14) if title else None
        figure.arrange()
    if path is not None:
        if not Path(path).suffix:
            raise ValueError(f"{path}: the name of a figure ends with .png or .pdf")
        with replacing(Path(path)) as temporary:
            if Path(path).suffix == ".png":
                canvas = FigureCanvasAgg(figure)  # `savefig` draws it twice
                canvas.draw()  # type: ignore[no-untyped-call]
                picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")  # type: ignore[no-untyped-call]
                picture.save(temporary, format="PNG", compress_level=PACKED)
            else:
                figure.savefig(temporary)
    return figure
