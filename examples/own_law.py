r"""A law of your own
=================

With an exact solution, the errors fall with the rates of the degree.

.. math:: -\nabla \cdot ((1 + x^2) \nabla u) + 2 u = f

The rates are :math:`p + 1` in :math:`L^2` and :math:`p` in :math:`H^1`.
`python examples/own_law.py [volume.npz]`. The source, the flux on the face u1, the preconditioner and the errors follow
from law and solution.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw, load

import iga_nn


class Law(iga_nn.Form):
    """-div flux + react = source; arrays or jets u (1, ...), grad (1, 3, ...), at points x (3, ...)."""

    def flux(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return a conductivity that grows along x, times the gradient."""
        return (1 + x[0] ** 2) * grad

    def react(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return a loss in proportion to u."""
        return 2 * u


def main(file: str | Path | None = None, out: str | Path = "out/own_law") -> Path:
    """Print errors and rates; returns the picture of u."""
    volume = load(file)
    problem = iga_nn.Problem(Law(), exact="sin(2*X)*exp(Y)*cos(Z)", neumann={"u1": None})
    for row in iga_nn.convergence(volume, problem, refine=range(3)):
        print(row)
    return draw(out, volume, iga_nn.solve(volume, problem, refine=2), "solution of your own law")


if __name__ == "__main__":
    main(*sys.argv[1:2])
