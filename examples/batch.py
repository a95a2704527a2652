"""Many surfaces
=============

One after the other: a folder of results each, a table and a chart; what is refused does not stop it.

`python examples/batch.py part1.stl part2.obj ...`; without files, three samples.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

import iga_nn

ERRORS = ("l2_relative", "l2", "h1_relative", "h1_seminorm")
COLUMNS = ("surface", "bijective", "arap", "boundary_rms", *ERRORS, "seconds")


def row_of(name: str, folder: Path, mapping: iga_nn.MapOptions | None) -> dict[str, Any]:
    """The numbers of one run, or why there are none."""
    try:
        report = iga_nn.run("poisson", name, folder, mapping=mapping, force=True).report
    except (iga_nn.MeshError, iga_nn.InputError) as error:
        print(error)
        return {"surface": Path(name).stem, "bijective": "refused"}
    quality = report["parameterization"]
    return {
        "surface": Path(name).stem,
        "bijective": quality["bijective"],
        "arap": quality["arap"]["unit_volume"]["mean"],
        "boundary_rms": quality["boundary"]["unit_volume"]["rms"],
        **{name: report["poisson"]["levels"][-1][name] for name in ERRORS},
        "seconds": report["seconds"]["total"],
    }


def draw(path: Path, rows: list[dict[str, Any]]) -> None:
    """Distortion, distance and error of each surface that was taken; bars of what is not certified are pale."""
    figure = Figure(figsize=(9, 3.2), dpi=110, layout="constrained")
    titles = {"arap": "ARAP, unit volume", "boundary_rms": "boundary distance, unit volume"}
    titles |= {"l2_relative": "relative L2 error"}
    for axes, (column, title) in zip(figure.subplots(1, 3), titles.items(), strict=True):
        for row in rows:
            alpha = 1.0 if row["bijective"] == "certified" else 0.35
            axes.bar(row["surface"], row[column], color="#4477aa", alpha=alpha)
        axes.set_title(title, fontsize=10)
        axes.tick_params(axis="x", rotation=20)
    figure.savefig(path)


def main(
    names: tuple[str, ...] = ("bean", "bumpy_ball", "ellipsoid"),
    out: str | Path = "out/batch",
    mapping: iga_nn.MapOptions | None = None,
) -> Path:
    """Write batch.csv and batch.png; returns the picture."""
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    rows = [row_of(name, folder / Path(name).stem, mapping) for name in names]
    with (folder / "batch.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    draw(folder / "batch.png", [row for row in rows if row["bijective"] != "refused"])
    return folder / "batch.png"


if __name__ == "__main__":
    main(tuple(sys.argv[1:])) if sys.argv[1:] else main()
