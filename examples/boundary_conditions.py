r"""Boundary conditions
===================

Heat in a quarter of a pipe, hot inside, cooled by the air outside.

.. math::

    -\Delta u = 0, \qquad u = 1 \text{ on the inner wall (face u0)}, \qquad
    \frac{\partial u}{\partial n} + 2 u = 0 \text{ on the outer one (u1)},

and no flux goes through the cuts. Along a radius the answer is known: :math:`u = 1 + a \log r`, with :math:`a` from the
outer condition.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.figures.render import can_draw
from iga_nn.figures.solution import draw_values
from parameterize.spline.bspline import greville, open_uniform_knots

OUTER, COOLING = 2.0, 2.0  # radius of the outer wall, that of the inner one being 1; heat transfer to the air


def quarter_pipe(n: int = 12) -> iga_nn.BSplineVolume:
    """Control points on cylinders, the walls a little inside of these: u along the radius, v the angle, w the axis."""
    points = greville(open_uniform_knots(n, 3), 3)  # (n,)
    u, v, w = np.meshgrid(points, points, points, indexing="ij")
    radius, angle = 1.0 + (OUTER - 1.0) * u, np.pi / 2.0 * v
    return iga_nn.BSplineVolume.uniform(np.stack([radius * np.cos(angle), radius * np.sin(angle), 1.5 * w], axis=-1))


def main(n: int = 12, out: str | Path = "out/boundary_conditions") -> Path:
    """Print the temperature half-way through the wall beside the formula's; returns the picture."""
    volume = quarter_pipe(n)
    problem = iga_nn.Poisson(
        source="0",
        boundary="1",  # on every face that is not named below
        neumann={"v0": "0", "v1": "0", "w0": "0", "w1": "0"},
        robin={"u1": (str(COOLING), "0")},
    )
    solution = iga_nn.solve(volume, problem)
    print(solution.report)
    middle = np.array([[0.5, 0.5, 0.5]])
    print(f"half-way: {solution(middle)[0]:.5f}, by the formula {exact(np.hypot(*volume(middle)[0, :2])):.5f}")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    volume.save(folder / "volume.npz")
    solution.save(folder / "solution.npz")
    if can_draw():
        draw_values(folder / "temperature.png", volume, solution, "temperature")
    return folder / "temperature.png"


def exact(radius: float) -> float:
    """The temperature of a round pipe."""
    slope = -COOLING / (1.0 / OUTER + COOLING * np.log(OUTER))
    return float(1.0 + slope * np.log(radius))


if __name__ == "__main__":
    main()
