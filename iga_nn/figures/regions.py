"""Draws regions of a boundary, each in its colour and named: on a solid, and on the surface of a part."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import BodyLike, as_body
from parameterize.surface.geometry import normals_and_areas
from parameterize.surface.surface import Surface
from solve.forms.conditions import Condition
from solve.forms.region import Region

from .colors import region_colors
from .fields import outer_faces, points_of
from .first_view import best_sides, shown_from
from .outline import edge_patch, outline_of
from .panels import panels_of
from .region_numbers import first_of, numbers_of
from .render import Patch, View
from .style import name_below, save, show, show_around

MOST_PANELS, COLUMNS = 9, 3  # pictures of regions
GLASS = 0.18  # opacity of a body around a region that is hidden
CELLS = 40_000  # of a surface: large triangles are divided into as many
FINEST = 100  # cells along a side of a triangle
LINES_UP_TO = 3_000  # triangles: surfaces with more are drawn without outlines
LONGEST = 60  # letters of a name
FITTING = 36  # letters that are as wide as a panel


def draw_conditions(path: str | Path | None, body: BodyLike, conditions: Sequence[Condition]) -> Figure:
    """Draw where a problem's conditions hold on the body: a picture of each region, from its best side.

    conditions: with their regions placed. Where two meet, the first is shown. A region that is hidden from all sides,
    as that of a cavity, is seen through the rest. Of more than MOST_PANELS conditions two pictures show all.
    """
    palette, glued, points = region_colors(len(conditions)), as_body(body), points_of(body).on(outer_faces(body))
    numbers, edges = numbers_of(body, conditions), edge_patch(points.reshape(-1, 3), outline_of(body).edges)
    names = [f"{condition.kind}: {condition.region}" for condition in conditions]
    if len(conditions) > MOST_PANELS:
        view = shown_from(glued)
        return _draw(path, [Patch(points, palette[numbers]), edges], palette, names, "Where data are given", view=view)
    columns = min(COLUMNS, len(conditions))
    figure, axes = panels_of(-(-len(conditions) // columns), columns)
    sides, labels = best_sides(body, conditions), list(map(_short, names))
    size = 13 * min(1.0, FITTING / max(map(len, labels)))
    for number, (panel, label, (view, is_seen)) in enumerate(zip(axes.flat, labels, sides, strict=False)):
        patches = [Patch(points, palette[numbers])] if is_seen else _through(points, numbers, number, palette)
        show(panel, "", [*patches, edges], view)
        swatch = Swatch(color=palette[number], label=label)
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "borderpad": 0.0, "borderaxespad": 0.2}
        panel.legend(handles=[swatch], frameon=False, fontsize=size, **place)
    return save(figure, path)


def _through(points: Array, numbers: IntArray, number: int, palette: Array) -> list[Patch]:
    """Return the cells of one region, and the rest of the body as glass."""
    own = numbers == number
    cells = (own[:, :-1, :-1] & own[:, 1:, 1:]).nonzero()
    face, i, j = cells
    corners = [points[face, i + a, j + b] for a in (0, 1) for b in (0, 1)]
    squares = np.stack(corners, axis=1).reshape(-1, 2, 2, 3)
    glass = Patch(points, np.broadcast_to(palette[-1], points.shape), opacity=GLASS)
    return [Patch(squares, np.broadcast_to(palette[number], squares.shape)), glass]


def draw_regions(path: str | Path | None, surface: Surface, regions: Sequence[Region]) -> Figure:
    """Draw regions on a surface with its sharp edges and axes, from the front and from behind.

    Where two regions meet, the first is shown.
    """
    palette, (normals, areas) = region_colors(len(regions)), normals_and_areas(surface.vertices, surface.faces)
    sides = np.clip(np.sqrt(CELLS * areas / areas.sum()).astype(int), 1, FINEST)
    grids = [_grid(triangle, side) for triangle, side in zip(surface.vertices[surface.faces], sides, strict=True)]
    counts = (sides + 1) ** 2
    points = np.concatenate([grid.reshape(-1, 3) for grid in grids]).T
    first = first_of(regions, points, np.repeat(normals, counts, axis=0).T)
    parts = np.split(palette[first], np.cumsum(counts)[:-1])
    outlined = len(sides) <= LINES_UP_TO and not surface.brep  # triangles of a solid model are its reader's
    patches = [
        Patch(grid, part.reshape(grid.shape), every=int(side) if outlined else 0)
        for grid, part, side in zip(grids, parts, sides, strict=True)
    ]
    if len(surface.features) and not outlined:
        patches.append(edge_patch(surface.vertices, surface.features.edges))
    names = list(map(str, regions))
    return _draw(path, patches, palette, names, "Regions of the surface", surface.unit)


def _grid(triangle: Array, side: int) -> Array:
    """Return points (side + 1, side + 1, 3) of a triangle (3, 3), whose first corner takes the place of a side."""
    along = np.linspace(0.0, 1.0, side + 1)
    a, b, c = triangle
    return np.asarray(a + along[:, None, None] * (b - a + along[None, :, None] * (c - b)))


def _short(name: str) -> str:
    """Return a name for a legend, in which a dollar begins no formula of matplotlib."""
    return (name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…").replace("$", r"\$")


def _draw(
    path: str | Path | None,
    patches: list[Patch],
    palette: Array,
    names: Sequence[str],
    title: str,
    unit: str | None = None,
    view: View | None = None,
) -> Figure:
    figure, (panels,) = panels_of(1, 2)
    show_around(panels, patches, unit=unit, view=view)
    swatches = [Swatch(color=color, label=_short(name)) for color, name in zip(palette, names, strict=False)]
    name_below(figure, swatches, 2)
    return save(figure, path, title)
