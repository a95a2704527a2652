r"""The heat equation
=================

By BDF2 in time, with the system of one time step used again and again.

.. math:: \frac{\partial u}{\partial t} - \Delta u = f

`python examples/heat.py [volume.npz]`. With :math:`A` the matrix of :math:`-\Delta`, :math:`M` that of mass, and
:math:`b(t)` source and flux,

.. math:: \left(A + \frac{3}{2\,\Delta t} M\right) u^{n+1} = b(t^{n+1}) + M\,\frac{4 u^n - u^{n-1}}{2\,\Delta t}.

The exact solution :math:`u = x \cos t` is a spline on every volume, for :math:`x` is: the error is that of time alone,
of order 2.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw, load
from scipy.sparse.linalg import cg

import iga_nn

FACES = ("u0", "u1", "v0", "v1", "w0", "w1")
END = 1.0  # time


def march(volume: iga_nn.BSplineVolume, steps: int) -> tuple[iga_nn.System, np.ndarray, float]:
    """Return the system, the coefficients of u at the end, and their relative error in L2."""
    dt = END / steps
    step = iga_nn.Poisson(source="0", reaction=str(1.5 / dt), neumann=dict.fromkeys(FACES, "0"))
    system = iga_nn.discretize(volume, step)
    mass, x = system.mass, volume.control_points[..., 0].ravel()
    flux = system.operator @ x - 1.5 / dt * (mass @ x)  # A x: what u = x sends through the boundary
    old, u = x, np.cos(dt) * x  # the first step, which BDF2 does not give, from the exact solution
    for time in dt * np.arange(2, steps + 1):
        load = np.cos(time) * flux + mass @ (-np.sin(time) * x + (4.0 * u - old) / (2.0 * dt))
        found, failed = cg(system.operator, load, u, rtol=1e-10, M=system.preconditioner)
        assert not failed, "conjugate gradients did not converge"
        old, u = u, found
    wrong = u - np.cos(END) * x
    return system, u, float(np.sqrt(wrong @ (mass @ wrong) / (x @ (mass @ x))))


def main(file: str | Path | None = None, out: str | Path = "out/heat") -> Path:
    """Print the errors of smaller and smaller steps, and their order; returns the picture of the temperature."""
    volume, before = load(file), None
    for steps in (5, 10, 20, 40):
        system, u, error = march(volume, steps)
        order = f"{np.log2(before / error):.2f}" if before else "-"
        print(f"{steps:3} steps  relative L2 error {error:.3e}  order {order}")
        before = error
    return draw(out, volume, system.field(u), "temperature at the end")


if __name__ == "__main__":
    main(*sys.argv[1:2])
