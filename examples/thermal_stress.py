r"""Thermal stress
==============

A temperature loads an elastic body.

.. math:: \sigma = C \varepsilon - b\,T\,I, \qquad b = \frac{E\,\alpha}{1 - 2 \nu}

`python examples/thermal_stress.py [volume.npz]`: heat flows in through the face u1 and out through u0, where
:math:`T = 0` and the body is clamped. By default a beam: its tip moves by :math:`\alpha\,T_\mathrm{tip} L / 2`, nearly,
for it is free to expand but near the clamp. The coupling is a law of components :math:`(u, T)`: its product with the
vector :math:`(0, T)` holds the integrals of :math:`-b\,T\,\nabla \cdot v`, the load with its sign changed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw
from elasticity import LENGTH, beam
from scipy.sparse.linalg import cg

import iga_nn

EXPANSION, FLOW, YOUNG, NU = 0.01, 0.5, 1000.0, 0.3  # a, heat through u1 per area, E, nu
FREE, NOTHING = ("u1", "v0", "v1", "w0", "w1"), ("0", "0", "0")


class Coupling(iga_nn.Form):
    """Fluxes of (u, T): stress -b T I, and the gradients, which make the law one that can be inverted."""

    components = 4
    symmetric = False

    def flux(self, u: np.ndarray, grad: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return the four fluxes (4, 3, ...)."""
        pressure = YOUNG * EXPANSION / (1.0 - 2.0 * NU) * u[3]
        return np.stack([*(grad[i] - np.stack([pressure * (i == j) for j in range(3)]) for i in range(3)), grad[3]])


def main(file: str | Path | None = None, out: str | Path = "out/thermal_stress") -> Path:
    """Print temperature and displacement of the middle of face u1; returns the picture of the body, expanded."""
    volume = iga_nn.load_volume(file) if file else beam(8).refined()
    heat = iga_nn.Poisson(source="0", neumann=dict.fromkeys(FREE, "0") | {"u1": str(FLOW)})
    temperature = iga_nn.solve(volume, heat).field
    body = iga_nn.Elasticity(body_force=NOTHING, traction=dict.fromkeys(FREE, NOTHING), young=YOUNG, poisson_ratio=NU)
    system = iga_nn.discretize(volume, body)
    four = iga_nn.Problem(Coupling(), source=("0",) * 4, neumann=dict.fromkeys(FREE, ("0",) * 4))
    coupling = iga_nn.discretize(volume, four)
    hot = iga_nn.discretize(volume, heat).vector(temperature)
    pushed = (coupling.operator @ np.concatenate([0.0 * system.load, hot]))[: len(system.load)]
    found, failed = cg(system.operator, system.load - pushed, rtol=1e-8, M=system.preconditioner)
    assert not failed, "conjugate gradients did not converge"
    displacement, tip = system.field(found), np.array([[1.0, 0.5, 0.5]])
    moved, at_tip = displacement(tip)[0], temperature(tip)[0]
    print(f"T = {at_tip:.4f}, moved by {moved[0]:.5f}, {moved[1]:.5f}, {moved[2]:.5f}")
    if not file:
        print(f"free expansion {EXPANSION * at_tip * LENGTH / 2.0:.5f}")
    return draw(out, volume, displacement, "displacement by heat, drawn 5 times too large", exaggerate=5.0)


if __name__ == "__main__":
    main(*sys.argv[1:2])
