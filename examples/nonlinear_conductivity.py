r"""A nonlinear conductivity
========================

The conductivity depends on the solution: Newton's method.

.. math:: -\nabla \cdot ((1 + u^2) \nabla u) = 0

`python examples/nonlinear_conductivity.py [volume.npz]`. The law is written as it stands, and its derivative follows
from it. The answer is known on every volume: :math:`w = u + u^3 / 3` (Kirchhoff) has :math:`\Delta w = 0`, a linear
problem, which is solved beside it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw, load

import iga_nn

GIVEN = "sin(2*X+Y)+Z"  # u on the boundary


class Conductor(iga_nn.Form):
    """The law; its derivative is not symmetric, for the conductivity has one, too."""

    linear = symmetric = False

    def flux(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return (1 + u^2) grad u."""
        return (1.0 + u[0] ** 2) * grad


def main(file: str | Path | None = None, out: str | Path = "out/nonlinear_conductivity") -> Path:
    """Print the residual of every step, and the distance to Kirchhoff's answer; returns the picture of u."""
    volume, middle = load(file), np.linspace(0.1, 0.9, 9)
    u = iga_nn.newton(volume, iga_nn.Problem(Conductor(), source="0", boundary=GIVEN), refine=1)
    for step, residual in enumerate(u.report.residuals):
        print(f"step {step}: residual {residual:.1e}")
    w = iga_nn.solve(volume, iga_nn.Poisson(source="0", boundary=f"({GIVEN})+({GIVEN})**3/3"), refine=1)
    found, known = u.grid(middle, middle, middle), w.grid(middle, middle, middle)
    print(f"largest |u + u^3/3 - w|: {np.abs(found + found**3 / 3.0 - known).max():.1e} of {np.abs(known).max():.2f}")
    return draw(out, volume, u, "temperature")


if __name__ == "__main__":
    main(*sys.argv[1:2])
