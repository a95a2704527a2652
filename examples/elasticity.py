r"""Linear elasticity
=================

A beam, clamped at one end, bends under its own weight; beside beam theory.

A straight beam of length :math:`L` and square section :math:`h` under the load :math:`f` per volume sinks at its tip by

.. math:: \frac{12 f L^4}{8 E h^2}

(Euler and Bernoulli, who leave out the shear: some percent at :math:`L = 8 h`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.figures.render import can_draw
from iga_nn.figures.solution import draw_values

LENGTH, THICKNESS, YOUNG, WEIGHT = 8.0, 1.0, 1000.0, 0.05


def beam(n: int = 5) -> iga_nn.BSplineVolume:
    """A box of n control points along the beam and 4 across."""
    axes = (np.linspace(0.0, LENGTH, n), np.linspace(0.0, THICKNESS, 4), np.linspace(0.0, THICKNESS, 4))
    return iga_nn.BSplineVolume.uniform(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))


def main(out: str | Path = "out/elasticity") -> Path:
    """Print the tip's displacement beside beam theory; returns the picture of the bent beam."""
    volume = beam()
    free = dict.fromkeys(("u1", "v0", "v1", "w0", "w1"), ("0", "0", "0"))
    problem = iga_nn.Elasticity(body_force=("0", "0", str(-WEIGHT)), traction=free, young=YOUNG, poisson_ratio=0.3)
    solution = iga_nn.solve(volume, problem, refine=2)
    print(solution.report)
    tip = solution(np.array([[1.0, 0.5, 0.5]]))[0, 2]
    print(f"tip sinks by {-tip:.4f}, beam theory {1.5 * WEIGHT * LENGTH**4 / (YOUNG * THICKNESS**2):.4f}")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    volume.save(folder / "volume.npz")
    solution.save(folder / "solution.npz")
    if can_draw():
        draw_values(folder / "beam.png", volume, solution, "displacement, drawn 4 times too large", exaggerate=4.0)
    return folder / "beam.png"


if __name__ == "__main__":
    main()
