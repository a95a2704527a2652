r"""Convection and diffusion
========================

A law that is not symmetric: GMRES solves it.

.. math:: -\nabla \cdot (k \nabla u) + b \cdot \nabla u = f \qquad \text{with the wind } b

`python examples/convection_diffusion.py [volume.npz]`. The solution is given, and :math:`f` follows from law and
solution.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw, load

import iga_nn

DIFFUSION, SOLUTION = 0.1, "sin(X+2*Y)*exp(Z)"


class Transport(iga_nn.Form):
    """Air that turns around the z axis and rises."""

    symmetric = False

    def flux(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return what diffuses (1, 3, ...)."""
        return DIFFUSION * grad

    def react(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return what the wind (-y, x, 1) carries (1, ...)."""
        return x[0] * grad[:, 1] - x[1] * grad[:, 0] + grad[:, 2]


def main(file: str | Path | None = None, out: str | Path = "out/convection_diffusion") -> Path:
    """Print iterations and errors on finer and finer meshes, with their rates; returns the picture of u."""
    volume = load(file)
    problem = iga_nn.Problem(Transport(), exact=SOLUTION, neumann={"w1": None})  # outflow at the top
    for row in iga_nn.convergence(volume, problem, refine=range(3), tolerance=1e-10):
        print(f"{row.report.iterations} iterations of GMRES: {row}")
    return draw(out, volume, iga_nn.solve(volume, problem, refine=2), "u, carried by the wind")


if __name__ == "__main__":
    main(*sys.argv[1:2])
