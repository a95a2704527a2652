"""Files for other programs
========================

ParaView, MFEM and G+Smo, with the solution; the view, cut open.

On the command line: `iga-nn export volume.npz --to view --solution solution.npz`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import iga_nn
from iga_nn.figures.render import can_draw
from solve.study import benchmark_volume


def main(volume: str | Path | None = None, out: str | Path = "out/export_files") -> Path:
    """Write one file a format and print their names; returns the picture."""
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    if volume is None:
        volume = folder / "volume.npz"
        benchmark_volume(5).save(volume)
    solution = iga_nn.solve(iga_nn.load_volume(volume), iga_nn.Poisson(exact="sin(3*x)*sin(3*y)*sin(3*z)"))
    solution.save(folder / "solution.npz")
    names = {"vtk": "exact_bezier.vtu", "view": "samples_view.vtu", "mfem": "mfem.mesh", "gismo": "gismo.xml"}
    for to, name in names.items():
        print(iga_nn.export(volume, to, folder / name, solution=folder / "solution.npz", force=True))
    if can_draw():
        draw_cut(folder / "samples_view.vtu", folder / "cut.png")
    return folder / "cut.png"


def draw_cut(view: Path, picture: Path) -> None:
    """The solution inside: slices and clips are right on the view's linear cells alone, not on the exact ones."""
    import pyvista

    whole = pyvista.read(view)
    plotter = pyvista.Plotter(off_screen=True, window_size=[900, 700])
    plotter.set_background("white")
    bar = {"title": "u\n", "vertical": True, "position_x": 0.87, "position_y": 0.2, "height": 0.6, "fmt": "%.2f"}
    shown = {"scalars": "u", "cmap": "viridis", "ambient": 0.5, "diffuse": 0.5}
    plotter.add_mesh(whole.clip("-x"), **shown, scalar_bar_args={**bar, "color": "black"})
    plotter.add_mesh(whole.outline(), color="grey")
    plotter.view_vector((-1.0, -0.7, 0.5))
    plotter.screenshot(picture)
    plotter.close()


if __name__ == "__main__":
    main(*sys.argv[1:2])
