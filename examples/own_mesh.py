"""A mesh of your own
==================

All the way: what the gate says of a file, the run, the output folder with report.html.

`python examples/own_mesh.py bracket.stl` does what `iga-nn run poisson bracket.stl` does; without a file, a sample is
written to one first.
"""

from __future__ import annotations

import sys
from pathlib import Path

import iga_nn
from iga_nn.samples import write_obj


def main(
    mesh: str | Path | None = None, out: str | Path = "out/own_mesh", mapping: iga_nn.MapOptions | None = None
) -> Path:
    """Print the gate's verdict and the numbers of the report; returns the picture of the distortion."""
    folder = Path(out)
    if mesh is None:
        folder.mkdir(parents=True, exist_ok=True)
        mesh = folder / "bumpy_ball.obj"
        write_obj(iga_nn.sample("bumpy_ball"), mesh)
    try:
        surface = iga_nn.load_surface(mesh)
    except iga_nn.MeshError as error:  # open, not manifold, in pieces, ...: one line that says what and where
        sys.exit(str(error))
    print(f"{len(surface.vertices)} vertices, {len(surface.faces)} faces, volume {surface.volume:.4g}")
    for notice in surface.notices:  # what was mended
        print(notice)
    report = iga_nn.run("poisson", mesh, folder, mapping=mapping, force=True).report
    print("certificate:", report["parameterization"]["bijective"])
    for level in report["poisson"]["levels"]:
        relative = f"relative error {level['l2_relative']:.3e} in L2, {level['h1_relative']:.3e} in H1"
        print(f"{level['dofs']} unknowns, {relative} ({level['l2']:.3e}, {level['h1_seminorm']:.3e} absolute)")
    print("open", folder / "report.html")
    return folder / "distortion.png"


if __name__ == "__main__":
    main(*sys.argv[1:2])
