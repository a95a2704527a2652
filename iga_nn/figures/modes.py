"""Draws the shapes of vibrations: the body displaced by each, coloured by its displacement."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from parameterize.spline.body import BodyLike, as_body, size_of
from solve import Modes

from .evaluate import all_grids, flat, outer_faces
from .ranges import ColorRange
from .render import Patch, draw, view_of
from .style import PANEL, colors, panels_of, save

MOST, COLUMNS = 6, 3
SAMPLES = 61  # a direction of a face
SWING = 0.15  # of the body's size: the largest displacement as drawn


def draw_modes(path: str | Path | None, body: BodyLike, modes: Modes) -> Figure:
    """Draw the first modes, displacements, and their frequencies; the size of each is free, and the same in all."""
    shown = list(zip(modes.frequencies, modes.shapes, strict=True))[:MOST]
    figure, axes = panels_of(-(-len(shown) // COLUMNS), min(COLUMNS, len(shown)))
    volumes, grids = as_body(body).patches, all_grids(SAMPLES)
    size = size_of(volumes)
    faces = [(k // len(grids), grids[k % len(grids)]) for k in outer_faces(body)]
    still = [flat(volumes[number].grid(*grid)) for number, grid in faces]
    for panel, (frequency, shape) in zip(axes.flat, shown, strict=False):
        moved = [shape.patches[number].grid(*grid) for number, grid in faces]
        far = [flat(np.linalg.norm(by, axis=-1)) for by in moved]
        largest = max(float(values.max()) for values in far)
        limits = ColorRange(0.0, largest)
        patches = [
            Patch(points + SWING * size / largest * flat(by), colors(values, limits), every=SAMPLES - 1)
            for points, by, values in zip(still, moved, far, strict=True)
        ]
        panel.imshow(draw(patches, view_of(patches), PANEL))
        panel.set_title(f"{frequency:.4g} Hz", fontsize=13)
    return save(figure, path, "The lowest modes, coloured by their displacement")
