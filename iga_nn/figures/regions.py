"""Draws regions of a boundary, each in its colour and named: on a solid, and on the surface of a part."""

from collections.abc import Sequence
from itertools import cycle, islice
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch as Swatch

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.orientation import hands_of
from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.geometry import normals_and_areas
from parameterize.surface.surface import Surface
from solve.forms.conditions import Condition
from solve.forms.region import Region

from .fields import FEW, LINED, PER_PATCH, maps_of, on_planes, outer_faces, sizes_of, slopes_of
from .render import Patch
from .style import panels_of, save, show_around

REST = "0.82"  # the grey of the surface outside of all regions
SAMPLES = 161  # a direction of a face of the body
CELLS = 40_000  # of a surface: large triangles are divided into as many
FINEST = 100  # cells along a side of a triangle
LINES_UP_TO = 3_000  # triangles: surfaces with more are drawn without outlines
LONGEST = 60  # letters of a name


def draw_conditions(path: str | Path | None, body: BodyLike, conditions: Sequence[Condition]) -> Figure:
    """Draw where a problem's conditions hold on the body, from the front and from behind.

    conditions: with their regions placed. Where two meet, the first is shown.
    """
    palette, glued = _palette(len(conditions)), as_body(body)
    places = outer_faces(glued)
    samples = SAMPLES if len(glued) <= FEW else sizes_of(glued)[0]
    points, normals = on_planes(maps_of(glued), places, samples), _normals(glued, places, samples)
    first = _first_of_faces([condition.region for condition in conditions], glued, points, normals)
    names = [f"{condition.kind}: {condition.region}" for condition in conditions]
    every = samples - 1 if len(glued) <= LINED else 0
    return _draw(path, [Patch(points, palette[first], every=every)], palette, names, "Where data are given")


def _normals(body: Body, places: IntArray, samples: int) -> Array:
    """Return the outward unit normals (k, samples, samples, 3) of outer faces (k,)."""
    patches, faces = np.divmod(places, PER_PATCH)
    slopes = on_planes(slopes_of(body), places, samples)
    normals, hands = np.empty(slopes.shape[:-1]), hands_of(body.groups)
    for number in range(len(FACE_NAMES)):
        axis, side = divmod(number, 2)
        b, c = (slopes[faces == number][..., (axis + step) % 3] for step in (1, 2))
        normals[faces == number] = np.cross(b, c) if side else np.cross(c, b)
    return normals * (hands[patches, None, None] / np.linalg.norm(normals, axis=-1))[..., None]


def _first_of_faces(regions: Sequence[Region], body: Body, points: Array, normals: Array) -> IntArray:
    """Return the number (k, m, m) of the first region that holds at points of the outer faces, -1 where none does."""
    found = np.empty(points.shape[:-1], dtype=np.int64)
    names, x, n = body.outer_faces, np.moveaxis(points, -1, 0), np.moveaxis(normals, -1, 0)
    kinds = np.array([face for _, face in names])
    for face in FACE_NAMES:
        own = kinds == face
        found[own] = _first(regions, x[:, own], n[:, own], face)
    named = {face for region in regions for face in region.patch_faces}
    for number, (patch, face) in enumerate(names):
        if (name := body.face_name(patch, face)) in named:
            found[number] = _first(regions, x[:, number], n[:, number], name)
    return found


def draw_regions(path: str | Path | None, surface: Surface, regions: Sequence[Region]) -> Figure:
    """Draw regions on a surface with its sharp edges and axes, from the front and from behind.

    Where two regions meet, the first is shown.
    """
    palette, (normals, areas) = _palette(len(regions)), normals_and_areas(surface.vertices, surface.faces)
    sides = np.clip(np.sqrt(CELLS * areas / areas.sum()).astype(int), 1, FINEST)
    grids = [_grid(triangle, side) for triangle, side in zip(surface.vertices[surface.faces], sides, strict=True)]
    counts = (sides + 1) ** 2
    points = np.concatenate([grid.reshape(-1, 3) for grid in grids]).T
    first = _first(regions, points, np.repeat(normals, counts, axis=0).T)
    parts = np.split(palette[first], np.cumsum(counts)[:-1])
    outlined = len(sides) <= LINES_UP_TO and not surface.brep  # triangles of a solid model are its reader's
    patches = [
        Patch(grid, part.reshape(grid.shape), every=int(side) if outlined else 0)
        for grid, part, side in zip(grids, parts, sides, strict=True)
    ]
    if len(surface.features) and not outlined:
        patches.append(_sharp_edges(surface))
    names = list(map(str, regions))
    return _draw(path, patches, palette, names, "Regions of the surface", surface.unit)


def _sharp_edges(surface: Surface) -> Patch:
    """Return the sharp edges as patches without width, of which the lines alone are seen."""
    ends = surface.vertices[surface.features.edges]
    points = np.stack([ends, ends], axis=1)  # (e, 2, 2, 3)
    return Patch(points, np.zeros_like(points), every=1)


def _grid(triangle: Array, side: int) -> Array:
    """Return points (side + 1, side + 1, 3) of a triangle (3, 3), whose first corner takes the place of a side."""
    along = np.linspace(0.0, 1.0, side + 1)
    a, b, c = triangle
    return np.asarray(a + along[:, None, None] * (b - a + along[None, :, None] * (c - b)))


def _first(regions: Sequence[Region], points: Array, normals: Array, face: str = "") -> IntArray:
    """Return the number of the first region that holds at each of the points (3, ...), -1 where none does."""
    found = np.full(points.shape[1:], -1)
    for number in reversed(range(len(regions))):
        found[regions[number].holds(points, normals, face)] = number
    return found


def _palette(count: int) -> Array:
    """Return `count` colours, and last the colour of the rest, (count + 1, 3)."""
    chosen = islice(cycle(colormaps["tab10"].colors), count)  # type: ignore[attr-defined]
    return np.array([*map(to_rgb, chosen), to_rgb(REST)])


def _draw(
    path: str | Path | None,
    patches: list[Patch],
    palette: Array,
    names: Sequence[str],
    title: str,
    unit: str | None = None,
) -> Figure:
    figure, (panels,) = panels_of(1, 2)
    show_around(panels, patches, unit=unit)
    labels = [name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…" for name in names]
    swatches = [
        Swatch(color=color, label=label.replace("$", r"\$")) for color, label in zip(palette, labels, strict=False)
    ]
    figure.legend(handles=swatches, loc="outside lower center", ncols=2, frameon=False, fontsize=12)
    return save(figure, path, title)
