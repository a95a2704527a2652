"""Draws the shapes of vibrations: the body displaced by each, coloured by its displacement."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from parameterize.spline.volume import BSplineVolume
from solve import Modes

from .evaluate import all_grids, flat
from .render import Patch, draw, view_of
from .style import PANEL, ColorRange, colors, panels_of, save

MOST, COLUMNS = 6, 3
SAMPLES = 61  # a direction of a face
SWING = 0.15  # of the body's size: the largest displacement as drawn


def draw_modes(path: str | Path | None, volume: BSplineVolume, modes: Modes) -> Figure:
    """Draw the first modes, displacements, and their frequencies; the size of each is free, and the same in all."""
    shown = list(zip(modes.frequencies, modes.shapes, strict=True))[:MOST]
    figure, axes = panels_of(-(-len(shown) // COLUMNS), min(COLUMNS, len(shown)))
    size = float(np.ptp(volume.control_points.reshape(-1, 3), axis=0).max())
    faces = all_grids(SAMPLES)[:6]
    still = [flat(volume.grid(*grid)) for grid in faces]
    for panel, (frequency, shape) in zip(axes.flat, shown, strict=False):
        moved = [shape.grid(*grid) for grid in faces]
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
