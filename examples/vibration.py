r"""Vibration modes
===============

The lowest modes of an elastic body, clamped at one end.

.. math:: K \varphi = (2 \pi f)^2 M \varphi

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

import iga_nn

FREE = ("u1", "v0", "v1", "w0", "w1")
NOTHING = ("0", "0", "0")


def main(file: str | Path | None = None, out: str | Path = "out/vibration") -> Path:
    """Print frequencies and residuals; returns the picture of the first mode."""
    volume = iga_nn.load_volume(file) if file else beam(8).refined()
    body = iga_nn.Elasticity(body_force=NOTHING, traction=dict.fromkeys(FREE, NOTHING), young=YOUNG)
    found = iga_nn.modes(volume, body, density=1.0, n=4)
    for frequency, residual in zip(found.frequencies, found.residuals, strict=True):
        print(f"frequency {frequency:.5g}  relative residual {residual:.1e}")
    if not file:
        known = 1.8751**2 / (2.0 * np.pi) * np.sqrt(YOUNG * THICKNESS**2 / 12.0) / LENGTH**2
        print(f"beam theory {known:.5g}")
    first = found.shapes[0]
    size = np.ptp(volume.control_points.reshape(-1, 3), axis=0).max()
    return draw(out, volume, first, "first mode", exaggerate=0.2 * size / np.abs(first.coefficients).max())


if __name__ == "__main__":
    main(*sys.argv[1:2])
