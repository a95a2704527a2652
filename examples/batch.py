"""Many surfaces
=============

In worker processes: a folder of results each, one table and a chart; what is refused stops nothing.

`python examples/batch.py part1.stl "parts/*.obj" ...`; without files, three samples (`pip install 'iga-nn[batch]'`).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

import iga_nn
from iga_nn.batch.table import Row

TITLES = {
    "arap_mean": "ARAP, unit volume",
    "distance_rms": "distance to the surface over the diagonal, rms",
    "l2_relative": "relative L2 error",
}


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Distortion, distance and error of each surface that was taken; bars of what is not certified are pale."""
    figure = Figure(figsize=(9, 3.2), dpi=110, layout="constrained")
    for axes, (column, title) in zip(figure.subplots(1, 3), TITLES.items(), strict=True):
        for row in rows:
            alpha = 1.0 if row.state == "certified" else 0.35
            axes.bar(row.entry.folder.name, row.figures()[column], color="#4477aa", alpha=alpha)
        axes.set_title(title, fontsize=10)
        axes.tick_params(axis="x", rotation=20)
    figure.savefig(path)


def main(
    surfaces: Sequence[str] = ("bean", "bumpy_ball", "ellipsoid"),
    out: str | Path = "out/batch",
    mapping: iga_nn.MapOptions | None = None,
) -> Path:
    """Run what is not finished yet, print the table's lines, and return the chart."""
    batch = iga_nn.run_batch(surfaces, out, mapping=mapping)
    print(*(row.as_line() for row in batch.rows), batch.summary, sep="\n")
    draw(batch.folder / "batch.png", [row for row in batch.rows if row.report is not None])
    return batch.folder / "batch.png"


if __name__ == "__main__":  # workers import this file, too
    main(sys.argv[1:]) if sys.argv[1:] else main()
