r"""The heat equation
=================

In time by BDF2, with data that change from step to step.

.. math:: \frac{\partial u}{\partial t} - \Delta u = f

`python examples/heat.py [volume.npz]`. The exact solution :math:`u = x \cos t` is a spline on every volume, for
:math:`x` is: the error is that of time alone, of order 2. `out/heat/heat.pvd` is a film for ParaView.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from common import draw, load

import iga_nn

END = 1.0  # time


def problem(time: float) -> iga_nn.Poisson:
    """The data of a time: the source f = -x sin t, and u on the boundary."""
    return iga_nn.Poisson(source=f"-x*sin({time})", boundary=f"x*cos({time})")


def main(file: str | Path | None = None, out: str | Path = "out/heat") -> Path:
    """Print the errors of smaller and smaller steps, and their order; returns the picture of the temperature."""
    volume, before = load(file), None
    exact = np.cos(END) * volume.control_points[..., 0]
    for steps in (5, 10, 20, 40):
        found = iga_nn.march(volume, problem, "x", dt=END / steps, steps=steps, every=5)
        wrong = found.fields[-1].coefficients - exact
        error = np.sqrt((wrong**2).sum() / (exact**2).sum())
        order = f"{np.log2(before / error):.2f}" if before else "-"
        print(f"{steps:3} steps  relative error {error:.3e}  order {order}")
        before = error
    picture = draw(out, volume, found.fields[-1], "temperature at the end")
    found.save_pvd(Path(out) / "heat.pvd")
    return picture


if __name__ == "__main__":
    main(*sys.argv[1:2])
