r"""Vibration modes
===============

The lowest modes of an elastic body, clamped at one end, by SciPy's lobpcg.

.. math:: A x = (2 \pi f)^2 M x

`python examples/vibration.py [volume.npz]`, such as that of `iga-nn run poisson conch`; by default a beam, whose first
frequency stands beside that of beam theory for a length :math:`L`, a section of area :math:`A_s` and the density
:math:`\varrho`,

.. math:: f_1 = \frac{1.8751^2}{2 \pi L^2} \sqrt{\frac{E I}{\varrho A_s}}.

The density is 1; the body is clamped at the face u0.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw
from elasticity import LENGTH, THICKNESS, YOUNG, beam
from scipy.sparse.linalg import lobpcg

import iga_nn

FREE = ("u1", "v0", "v1", "w0", "w1")
NOTHING = ("0", "0", "0")
MODES, SPARE = 4, 4  # lobpcg iterates on more vectors than are wanted: it converges faster


def modes(volume: iga_nn.BSplineVolume) -> tuple[iga_nn.System, np.ndarray, np.ndarray, np.ndarray]:
    """Return the system, eigenvalues (k,), vectors (N, k) and relative residuals |A x - s M x| / |A x| (k,)."""
    body = iga_nn.Elasticity(force=NOTHING, traction=dict.fromkeys(FREE, NOTHING), young=YOUNG)
    system = iga_nn.discretize(volume, body)
    a, mass = system.operator, system.mass
    start = np.random.default_rng(0).standard_normal((len(system.load), MODES + SPARE))
    values, vectors = lobpcg(a, start, mass, system.preconditioner, tol=1e-6, maxiter=100, largest=False)
    values, vectors = values[:MODES], vectors[:, :MODES]
    forces = a @ vectors
    residuals = np.linalg.norm(forces - values * (mass @ vectors), axis=0) / np.linalg.norm(forces, axis=0)
    return system, values, vectors, residuals


def main(file: str | Path | None = None, out: str | Path = "out/vibration") -> Path:
    """Print frequencies and residuals; returns the picture of the first mode."""
    volume = iga_nn.load_volume(file) if file else beam(8).refined()
    system, values, vectors, residuals = modes(volume)
    for value, residual in zip(values, residuals, strict=True):
        print(f"frequency {np.sqrt(value) / (2.0 * np.pi):.5g}  relative residual {residual:.1e}")
    if not file:
        known = 1.8751**2 / (2.0 * np.pi) * np.sqrt(YOUNG * THICKNESS**2 / 12.0) / LENGTH**2
        print(f"beam theory {known:.5g}")
    mode = system.field(vectors[:, 0])
    size = np.ptp(volume.control_points.reshape(-1, 3), axis=0).max()
    return draw(out, volume, mode, "first mode", exaggerate=0.2 * size / np.abs(mode.coefficients).max())


if __name__ == "__main__":
    main(*sys.argv[1:2])
