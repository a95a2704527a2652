"""Draws surface patches by VTK, off screen, where this machine can draw."""

import logging
import subprocess
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from threading import local
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from parameterize.arrays import Array, ends_of

from . import probe
from .palette import rgb
from .probe import choose_window

log = logging.getLogger(__name__)

LARGER = 1.1  # times the box of principal axes
TILT = 0.45  # radians: shows more than one side of a solid
FINER = 2  # times as many pixels each way as the picture has: their means smooth edges, in half the time of VTK's way
LINE_WIDTH, BALL = 2.0, 39  # pixels of VTK's window, as are LETTERS
NEARER_LINES, NEARER_MARKS = 0.003, 0.01  # of the scene's size, towards the viewer: keeps them before a surface
NAMELESS: Mapping[str, Array] = MappingProxyType({})
LETTERS = 18
ROOM = 1.3  # of the picture's scale, for axes and their numbers
PLACE, SHADE = 2e-5, 1e-2  # of the scene's size, and of red, green or blue: less is not seen
REMEDY = "apt-get install --no-install-recommends libegl1 libgl1-mesa-dri"
CANNOT_DRAW = f"VTK cannot draw on this machine; remedy: {REMEDY}"


class _Plotters(local):
    """Hold a thread's plotters by size of window: a window of EGL draws in the thread that opens it."""

    def __init__(self) -> None:
        self.of_size: dict[tuple[int, int], Any] = {}


_PLOTTERS = _Plotters()


@dataclass(frozen=True, eq=False)
class Patch:
    """Hold a surface patch given by samples on a tensor grid, or k of them.

    points: (m, n, 3), of several (k, m, n, 3). colors: red, green, blue in 0..1 there, shown without shading where
    `lit` is false. every: samples from one parameter line to the next in both directions; 0 draws none. opacity: below
    1 the patch is transparent.
    """

    points: Array
    colors: Array
    lit: bool = True
    every: int = 0
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class View:
    """Hold the orthonormal directions of a camera: to the right, up, and towards the viewer."""

    right: Array
    up: Array
    towards: Array

    def turned(self) -> Self:
        """Return the view from behind."""
        return replace(self, right=-self.right, towards=-self.towards)


@cache
def can_draw() -> bool:
    """Return whether VTK can draw here, tried in a child process: without a graphics library it crashes."""
    choose_window()
    program = [sys.executable, "-P", str(Path(probe.__file__))]
    try:
        done = subprocess.run(program, capture_output=True, timeout=120, check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        done = False
    if not done:
        log.warning("no figures: %s", CANNOT_DRAW)
    return done


def check_drawable(what: str, known: Collection[str]) -> None:
    """Raise ValueError where there is no such figure, RuntimeError where this machine cannot draw it."""
    if what not in known:
        raise ValueError(f"no figure {what!r}: choose one of {', '.join(known)}")
    if not can_draw():
        raise RuntimeError(CANNOT_DRAW)


def widest_view(points: Array, tilt: float = 0.0) -> View:
    """Return the view that shows most of a point cloud (k, 3), along its thinnest axis with the longest one horizontal.

    tilt: radians that the viewer is moved up and sideways, so that a solid shows more than one side.
    """
    right, up, towards = longest_first(points)
    towards = np.cos(tilt) * towards + np.sin(tilt) * (0.8 * up + 0.6 * right)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return View(right, np.cross(towards, right), towards)


def longest_first(points: Array) -> Array:
    """Return the axes (3, 3) of a point cloud (k, 3), right-handed, from its longest side to its thinnest.

    They are principal axes, or x, y and z where these enclose the cloud in a box that is hardly larger.
    """
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred.T @ centred)
    sides, own = (high - low for low, high in (ends_of(points), ends_of(centred @ axes.T)))
    if sides.prod() <= LARGER * own.prod():
        axes = np.eye(3)[np.argsort(-np.round(sides / (sides.max() or 1.0), 3), kind="stable")]
    right, up = axes[0], axes[1]
    right = right * np.sign(right[np.argmax(np.abs(right))])  # the sign of a principal axis is arbitrary: fix it
    up = up * np.sign(up[np.argmax(np.abs(up))])
    return np.stack([right, up, np.cross(right, up)])


def plain_patch(points: Array, color: str, **look: Any) -> Patch:
    """Return a patch in a colour such as "#4477aa". points: as in Patch."""
    return Patch(points, np.broadcast_to(rgb(color), points.shape), **look)


def view_of(patches: Sequence[Patch]) -> View:
    """Return the view that shows most of the patches, a little from above."""
    return widest_view(np.concatenate([patch.points.reshape(-1, 3) for patch in patches]), tilt=TILT)


def draw(
    patches: Sequence[Patch],
    views: Sequence[View],
    pixels: tuple[int, int],
    marks: Array | None = None,
    names: Mapping[str, Array] = NAMELESS,
    unit: str | None = None,
) -> list[NDArray[np.uint8]]:
    """Return pictures (height, width, 3) of the patches in parallel projections that fill `pixels` = (width, height).

    marks: points (k, 3), drawn as black balls. names: texts that are written at points (3,), where these are seen.
    unit: of the axes that are drawn around the patches, "" for none; without it there are no axes.
    """
    import pyvista

    plotter = _empty_plotter(pixels)
    cloud = np.concatenate([patch.points.reshape(-1, 3) for patch in patches])
    size = float(np.linalg.norm(np.subtract(*ends_of(cloud))))
    fewer = [thinned(patch, size) for patch in patches]
    for lit, opacity in dict.fromkeys((patch.lit, patch.opacity) for patch in patches):
        plotter.add_mesh(
            _mesh([patch for patch in fewer if (patch.lit, patch.opacity) == (lit, opacity)]),
            scalars="rgb",
            rgb=True,
            smooth_shading=lit,
            lighting=lit,
            ambient=0.5,
            diffuse=0.55,
            opacity=opacity,
        )
    plotter.add_light(pyvista.Light(light_type="headlight", intensity=0.9))
    pictures = []
    for view in views:
        nearer, before = size * view.towards, []  # what is drawn before the patches
        before += _add_lines(plotter, patches, NEARER_LINES * nearer)
        if marks is not None:
            look = {"color": "black", "point_size": BALL, "render_points_as_spheres": True}
            before.append(plotter.add_points(marks + NEARER_MARKS * nearer, **look))
        _aim(plotter, cloud if unit is None else _corners(cloud), view, pixels)
        if names:
            before.append(_add_names(plotter, names, NEARER_MARKS * nearer))
        if unit is not None:
            _add_axes(plotter, cloud, unit)
        plotter.suppress_rendering = False
        plotter.render()
        pictures.append(np.asarray(Image.fromarray(plotter.screenshot(return_img=True)).reduce(FINER)))
        plotter.suppress_rendering = True
        plotter.remove_actor(before, render=False)
    return pictures


def _empty_plotter(pixels: tuple[int, int]) -> Any:
    """Return a plotter with an empty scene, one for each size: a new window costs more than its picture."""
    import pyvista

    plotters = _PLOTTERS.of_size
    if pixels not in plotters:
        window = [FINER * side for side in pixels]
        plotters[pixels] = pyvista.Plotter(off_screen=True, window_size=window, lighting="none")
        plotters[pixels].disable_anti_aliasing()
        plotters[pixels].set_background("white")
    plotters[pixels].suppress_rendering = True  # until the scene is complete
    plotters[pixels].clear()
    return plotters[pixels]


def thinned(patch: Patch, size: float) -> Patch:
    """Return a patch without samples that its others show as well: the time of a picture is that of its triangles.

    size: of the scene.
    """
    both = np.concatenate([patch.points / (PLACE * size or 1.0), patch.colors / SHADE], axis=-1)
    down = _step(np.moveaxis(both, -3, 0))
    both = both[..., ::down, :, :]
    across = _step(np.moveaxis(both, -2, 0))
    return replace(patch, points=patch.points[..., ::down, ::across, :], colors=patch.colors[..., ::down, ::across, :])


def _step(rows: Array) -> int:
    """Return the step in which rows (m, ...) are as good as all of them: those between are met within 1."""
    step, left = 1, 1.0
    while len(rows) > 2 and len(rows) % 2:
        left -= float(np.abs(rows[1::2] - 0.5 * (rows[:-2:2] + rows[2::2])).max())
        if not left > 0.0:
            break
        rows, step = rows[::2], 2 * step
    return step


def _mesh(patches: Sequence[Patch]) -> Any:
    """Return all patches as one mesh, which VTK draws faster than many; they share no points, so edges stay sharp."""
    import pyvista

    quads, first = [], 0
    for patch in patches:
        *_, m, n, _ = patch.points.shape
        starts = first + np.arange(0, patch.points.size // 3, m * n)
        corner = (starts[:, None, None] + np.arange(m - 1)[:, None] * n + np.arange(n - 1)).ravel()
        quads.append(np.stack([np.full_like(corner, 4), corner, corner + n, corner + n + 1, corner + 1], axis=1))
        first += patch.points.size // 3
    mesh = pyvista.PolyData(np.concatenate([patch.points.reshape(-1, 3) for patch in patches]), np.concatenate(quads))
    flat = np.concatenate([patch.colors.reshape(-1, 3) for patch in patches])
    mesh["rgb"] = np.round(255.0 * flat).astype(np.uint8)
    return mesh


def _add_lines(plotter: Any, patches: Sequence[Patch], shift: Array) -> list[Any]:
    """Draw the parameter lines of the patches, moved by `shift`, and return the actor, if there are lines."""
    import pyvista

    drawn = []  # lines of equally many points, (k, m, 3)
    for patch in patches:
        if patch.every:
            for points in (patch.points, patch.points.swapaxes(-3, -2)):  # first the lines of constant first parameter
                drawn.append(points[..., :: patch.every, :, :].reshape(-1, *points.shape[-2:]))
    if not drawn:
        return []
    starts = np.cumsum([0, *(rows.size // 3 for rows in drawn)])
    cells = [_cells(rows, start) for rows, start in zip(drawn, starts, strict=False)]
    drawn = [rows.reshape(-1, 3) for rows in drawn]
    lines = pyvista.PolyData(np.concatenate(drawn) + shift, lines=np.concatenate(cells))
    return [plotter.add_mesh(lines, color="black", line_width=LINE_WIDTH, lighting=False)]


def _cells(rows: Array, start: int) -> NDArray[np.int64]:
    """Return lines (k, m, 3) as VTK lists cells: the number of points before each. start: the first point's number."""
    numbers = start + np.arange(rows.size // 3).reshape(rows.shape[:2])
    return np.insert(numbers, 0, rows.shape[1], axis=1).ravel()


def _add_names(plotter: Any, names: Mapping[str, Array], shift: Array) -> Any:
    """Write texts at their points, moved by `shift`, where these are seen, and return the actor."""
    return plotter.add_point_labels(
        np.stack(list(names.values())) + shift,
        list(names),
        font_size=LETTERS,
        show_points=False,
        shape_color="white",
        shape_opacity=0.7,
        margin=1,
    )


def _corners(points: Array) -> Array:
    """Return the corners (8, 3) of the box of points."""
    return np.stack(np.meshgrid(*ends_of(points).T, indexing="ij"), axis=-1).reshape(-1, 3)


def _add_axes(plotter: Any, points: Array, unit: str) -> None:
    """Draw axes with numbers along the edges of the box of points, and make room for them."""
    titles = {f"{axis}title": f"{axis} [{unit}]" if unit else axis for axis in "xyz"}
    bounds = ends_of(points).T.ravel()
    look = {"font_size": LETTERS - 3, "n_xlabels": 3, "n_ylabels": 3, "n_zlabels": 3, "fmt": "%.4g", "color": "black"}
    plotter.show_bounds(bounds=bounds.tolist(), location="outer", ticks="outside", use_3d_text=False, **titles, **look)
    plotter.camera.parallel_scale *= ROOM


def _aim(plotter: Any, points: Array, view: View, pixels: tuple[int, int]) -> None:
    """Place the camera so that it shows the whole cloud with a margin of 4 %."""
    frame = np.stack([view.right, view.up, view.towards], axis=1)  # (3, 3), columns
    low, high = ends_of(points @ frame)
    width, height, _ = high - low
    focus = frame @ ((low + high) / 2.0)
    size = float(np.linalg.norm(high - low))
    camera = plotter.camera
    camera.enable_parallel_projection()
    camera.focal_point, camera.position, camera.up = focus, focus + 2.0 * size * view.towards, view.up
    camera.parallel_scale = 0.54 * max(height, width * pixels[1] / pixels[0])
    camera.clipping_range = (size, 3.0 * size)
