"""What the scripts on PDEs share: the volume they solve on, and the picture they leave."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.figures.render import can_draw
from iga_nn.figures.solution import draw_values


def twisted_column(n: int = 6) -> iga_nn.BSplineVolume:
    """A square column of height 2 on n^3 control points, that turns by 60 degrees and becomes thinner."""
    u, v, w = np.meshgrid(*[np.linspace(0.0, 1.0, n)] * 3, indexing="ij")
    angle, size = np.pi / 3.0 * w, 1.0 - 0.3 * w
    x, y = size * (u - 0.5), size * (v - 0.5)
    points = [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, 2.0 * w]
    return iga_nn.BSplineVolume.uniform(np.stack(points, axis=-1))


def load(file: str | Path | None) -> iga_nn.BSplineVolume:
    """The volume of a file, such as the volume.npz of a run; without one the column."""
    return iga_nn.load_volume(file) if file else twisted_column()


def draw(out: str | Path, volume: iga_nn.BSplineVolume, field: iga_nn.SplineField, title: str, **how: float) -> Path:
    """Save a volume and a field on it, and draw them, where that is possible; returns the picture's path."""
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    volume.save(folder / "volume.npz")
    field.save(folder / "solution.npz")
    if can_draw():
        draw_values(folder / "picture.png", volume, field, title, **how)
    return folder / "picture.png"
