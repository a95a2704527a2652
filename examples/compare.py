"""Two maps of one solid
=====================

Their distortion, and what it costs the solver.

`python examples/compare.py A/volume.npz B/volume.npz` compares two results of yours, say of two seeds. Without files:
a twisted cube, and the same with its inner control points pushed aside. The boundary is the same, the map is worse.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import iga_nn
from parameterize.quality.distortion import arap_grid
from solve.study import benchmark_volume

PROBLEM = iga_nn.Poisson(exact="exp(x+z)*sin(y)")


def disturbed(volume: iga_nn.BSplineVolume, amplitude: float = 0.12) -> iga_nn.BSplineVolume:
    """The same boundary, the inside moved along x by a wave."""
    waves = [np.sin(k * np.pi * np.linspace(0.0, 1.0, n)) for k, n in zip((1, 2, 2), volume.shape, strict=True)]
    points = volume.control_points.copy()
    points[..., 0] += amplitude * np.einsum("i,j,k->ijk", *waves)
    return iga_nn.BSplineVolume(volume.degrees, volume.knots, points)


def main(files: tuple[str, ...] = (), out: str | Path = "out/compare", refine: int = 1) -> Path:
    """Print a row a map, and draw which share of the cube is distorted less than what; returns the picture."""
    if files:
        volumes = {name: iga_nn.load_volume(name) for name in files}
    else:
        good = benchmark_volume(5)
        volumes = {"twisted cube": good, "inside pushed aside": disturbed(good)}
    figure = Figure(figsize=(6.4, 4.2), dpi=110, layout="constrained")
    axes = figure.subplots()
    print(f"{'':24s} certificate  ARAP mean      max  iterations  relative L2      L2  relative H1      H1")
    for name, volume in volumes.items():
        _, (values,), weights = arap_grid(volume)
        report = iga_nn.solve(volume, PROBLEM, refine=refine).report
        mean = float(np.sum(weights * values) / np.sum(weights))
        errors = f"{report.l2_relative:13.2e}{report.l2:10.2e}{report.h1_relative:11.2e}{report.h1_seminorm:10.2e}"
        numbers = f"{mean:9.4f}{values.max():9.3f}{report.iterations:12d}{errors}"
        print(f"{name:24s} {iga_nn.certify(volume).verdict:11s} {numbers}")
        order = np.argsort(values, axis=None)
        share = np.cumsum(weights.ravel()[order]) / np.sum(weights)
        label = f"{name}: mean {mean:.3f}, relative L2 error {report.l2_relative:.1e}"
        axes.plot(values.ravel()[order], share, label=label)
    axes.set(xscale="log", xlabel="ARAP distortion", ylabel="share of the cube below it", title="Two maps of one solid")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper left", fontsize=9)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "compare.png")
    return folder / "compare.png"


if __name__ == "__main__":
    main(tuple(sys.argv[1:]))
