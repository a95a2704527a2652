"""Corners of your own
===================

The cube's eight corners on the surface are given, instead of chosen by the method (the paper's Fig. 13).

The corners come in the order (0,0,0), (0,0,1), (0,1,0), ..., (1,1,1) of the parameters u, v, w: as points, which take
their nearest vertices, or as vertex numbers. On the command line: `iga-nn parameterize MESH --corners corners.json`.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.figures.map import draw_faces
from iga_nn.figures.render import can_draw


def main(name: str = "ellipsoid", config: object = None, out: str | Path = "out/given_corners") -> Path:
    """Corners at 0.55 of the half box, with the top turned by a sixth of a right angle; returns the picture."""
    surface = iga_nn.sample(name)
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    signs = 2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0  # (8, 3)
    angle = np.where(signs[:, 2] > 0.0, np.pi / 12.0, 0.0)
    turned = np.stack(
        [
            np.cos(angle) * signs[:, 0] - np.sin(angle) * signs[:, 1],
            np.sin(angle) * signs[:, 0] + np.cos(angle) * signs[:, 1],
            signs[:, 2],
        ],
        axis=1,
    )
    corners = (low + high) / 2.0 + 0.55 * turned * (high - low) / 2.0
    result = iga_nn.parameterize(surface, config, corners=corners)
    print(result.quality)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "corners.json").write_text(json.dumps(corners.tolist(), indent=1), encoding="utf-8")
    result.volume.save(folder / "volume.npz")
    if can_draw():
        nearest = [np.linalg.norm(surface.vertices - corner, axis=1).argmin() for corner in corners]
        draw_faces(folder / "faces.png", result.volume, marks=surface.vertices[nearest])
    return folder / "faces.png"


if __name__ == "__main__":
    main()
