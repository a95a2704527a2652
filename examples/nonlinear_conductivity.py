r"""A nonlinear conductivity
========================

The conductivity depends on the solution: Picard's iteration.

.. math:: -\nabla \cdot ((1 + u^2) \nabla u) = 0

`python examples/nonlinear_conductivity.py [volume.npz]`. Every step solves a linear law whose conductivity comes from
the last solution's field. The answer is known on every volume: :math:`w = u + u^3 / 3` (Kirchhoff) has
:math:`\Delta w = 0`, a linear problem, which is solved beside it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw, load

import iga_nn

TOLERANCE, MOST = 1e-8, 50  # largest change of u in the last step; steps
GIVEN = "sin(2*X+Y)+Z"  # u on the boundary


class Frozen(iga_nn.Form):
    """The law with the conductivity of the last solution."""

    def __init__(self, last: iga_nn.SplineField) -> None:
        self.last = last

    def flux(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return (1 + last^2) grad u."""
        return (1.0 + self.last.at(x) ** 2) * grad


def main(file: str | Path | None = None, out: str | Path = "out/nonlinear_conductivity") -> Path:
    """Print the change of u in every step, and the distance to Kirchhoff's answer; returns the picture of u."""
    volume, change, middle = load(file), 1.0, np.linspace(0.1, 0.9, 9)
    u = iga_nn.solve(volume, iga_nn.Poisson(source="0", boundary=GIVEN), refine=1)
    for step in range(1, MOST + 1):
        law = iga_nn.Problem(Frozen(u.field), source="0", boundary=GIVEN)
        new = iga_nn.solve(volume, law, refine=1, start=u.field, tolerance=1e-10, estimate=False)
        change = float(np.abs(new.coefficients - u.coefficients).max())
        print(f"step {step:2}: u changes by {change:.1e}")
        u = new
        if change < TOLERANCE:
            break
    w = iga_nn.solve(volume, iga_nn.Poisson(source="0", boundary=f"({GIVEN})+({GIVEN})**3/3"), refine=1)
    found, known = u.grid(middle, middle, middle), w.grid(middle, middle, middle)
    print(f"largest |u + u^3/3 - w|: {np.abs(found + found**3 / 3.0 - known).max():.1e} of {np.abs(known).max():.2f}")
    return draw(out, volume, u, "temperature")


if __name__ == "__main__":
    main(*sys.argv[1:2])
