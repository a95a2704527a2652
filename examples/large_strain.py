r"""Large strains
=============

A beam of a neo-Hookean material bends far under a load at its end, beside small strains.

With :math:`F = 1 + \nabla u` and :math:`J = \det F` the first Piola stress is

.. math:: P = \mu F + (\lambda \ln J - \mu) F^{-T}.

The load is dead: it keeps its direction, and the beam does not become longer, so that its end comes back.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from common import draw
from elasticity import YOUNG, beam

import iga_nn

NOTHING = ("0", "0", "0")
LOAD = 1.5  # per area of the end
LOADED = {**dict.fromkeys(("v0", "v1", "w0", "w1"), NOTHING), "u1": ("0", "0", str(-LOAD))}


class NeoHookean(iga_nn.Form):
    """A compressible material of Lame's constants lambda (`first`) and mu (`shear`); u is the displacement."""

    components = 3
    linear = False

    def __init__(self, first: float, shear: float) -> None:
        self.first, self.shear = first, shear

    def flux(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the first Piola stress (3, 3, ...), with F^-T from the cofactors."""
        f = [[grad[i, j] + float(i == j) for j in range(3)] for i in range(3)]
        ring = (0, 1, 2, 0, 1)
        minor = [
            [f[ring[i + 1]][ring[j + 1]] * f[ring[i + 2]][ring[j + 2]]
             - f[ring[i + 1]][ring[j + 2]] * f[ring[i + 2]][ring[j + 1]] for j in range(3)]
            for i in range(3)
        ]  # fmt: skip
        det = sum(f[0][j] * minor[0][j] for j in range(3))
        factor = (self.first * np.log(det) - self.shear) / det
        return np.stack([np.stack([self.shear * f[i][j] + factor * minor[i][j] for j in range(3)]) for i in range(3)])


def main(out: str | Path = "out/large_strain") -> Path:
    """Print Newton's residuals and where the end goes; returns the picture of the bent beam."""
    volume, end = beam(8), [[1.0, 0.5, 0.5]]
    small = iga_nn.Elasticity(traction=LOADED, young=YOUNG)
    law = iga_nn.Problem(NeoHookean(*small.constants), source=NOTHING, neumann=LOADED)
    bent = iga_nn.newton(volume, law)
    print("residuals " + ", ".join(f"{residual:.0e}" for residual in bent.report.residuals))
    for name, field in {"small": iga_nn.solve(volume, small), "large": bent}.items():
        along, _, down = field(end)[0]
        print(f"{name} strains: the end sinks by {-down:.3f}, and comes back by {-along:z.3f}")
    return draw(out, volume, bent, "displacement, as it is", exaggerate=1.0)


if __name__ == "__main__":
    main()
