"""A volume from elsewhere
=======================

G+Smo XML, an MFEM NURBS mesh, a GeoPDEs geometry file, splinepy's JSON, or volume.npz, certified and solved on.

`python examples/load_volume.py yeti.mesh` reads yours; without a file, a twisted column is written as G+Smo XML first.
JSON needs the extra `interop`: `pip install iga-nn[interop]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.figures.render import can_draw
from iga_nn.figures.solution import draw_error


def write_column(folder: Path, n: int = 10) -> Path:
    """A square column, three units high, that twists by a right angle."""
    u, v, w = np.meshgrid(*[np.linspace(0.0, 1.0, n)] * 3, indexing="ij")
    angle, size = np.pi / 2.0 * w, 1.0 - 0.4 * w
    x, y = size * (u - 0.5), size * (v - 0.5)
    points = np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, 3.0 * w], axis=-1)
    iga_nn.BSplineVolume.uniform(points).save(folder / "column.npz")
    return iga_nn.export(folder / "column.npz", "gismo", folder / "column.xml", force=True)


def main(file: str | Path | None = None, out: str | Path = "out/load_volume") -> Path:
    """Print the certificate and the errors; returns the picture of the error."""
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    volume = iga_nn.load_volume(file or write_column(folder))
    print("degrees", volume.degrees, "control points", volume.shape)
    certificate = iga_nn.certify(volume)
    print("certificate:", certificate.verdict)
    problem = iga_nn.Poisson(exact="sin(2*x)*cos(2*y)*exp(z/3)")
    solution = iga_nn.solve(volume, problem, refine=1, certified=certificate.verdict)
    print(solution.report)
    if can_draw():
        draw_error(folder / "error.png", volume, solution, problem)
    return folder / "error.png"


if __name__ == "__main__":
    main(*sys.argv[1:2])
