"""First run
=========

A sample surface, parameterized and solved: the package in ten lines of Python, and a picture.
"""

from __future__ import annotations

from pathlib import Path

import iga_nn
from iga_nn.figures.map import draw_faces
from iga_nn.figures.render import can_draw


def main(name: str = "bean", config: object = None, levels: int = 2, out: str | Path = "out/first_run") -> Path:
    """Print quality, errors and convergence; `config` (see iga_nn.preset) shortens the run. Returns the picture."""
    surface = iga_nn.sample(name)  # or iga_nn.load_surface("conch.obj")
    result = iga_nn.parameterize(surface, config, seed=0)
    print(result.quality)
    problem = iga_nn.Poisson(exact="exp(X+Z)*sin(Y)")  # X: x scaled to volume 1; source and boundary data follow
    solution = iga_nn.solve(result.volume, problem, certified=result.certificate.verdict)
    print(solution.report)
    for row in iga_nn.convergence(result.volume, problem, refine=range(levels)):
        print(row)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    result.volume.save(folder / "volume.npz")
    if can_draw():
        draw_faces(folder / "faces.png", result.volume)
    return folder / "faces.png"


if __name__ == "__main__":
    main()
