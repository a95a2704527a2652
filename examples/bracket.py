r"""A bracket under load
====================

A steel bracket: screwed to a wall at its back, loaded on a part of its top. Millimetres, newtons and MPa.

Where it is held and loaded is said by conditions on the position and the outward normal (regions): neither ends at an
edge of the mesh. The stress in the flat arm stands beside that of beam theory, for an arm :math:`a` of the force
:math:`F`, a width :math:`b` and a thickness :math:`t`:

.. math:: \sigma = \frac{6 F a}{b t^2}
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from common import draw

import iga_nn

WIDTH, THICKNESS, BEND, LEG = 40.0, 8.0, 20.0, 50.0  # BEND: the outer radius; LEG: the length of each flat plate
PRESSURE, HELD, LOADED = 1.25, "nx < -0.99 and z < -30", "nz > 0.99 and x > 40 and x < 60"  # 40 x 20 mm: 1000 N
PLACE = (30.0, 20.0, -7.99)  # below the flat arm


def bracket(n: int = 24) -> iga_nn.BSplineVolume:
    """Two plates that meet in a bend, on n control points along: the wall is at x = 0, the top at z = 0."""

    def place(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        along = u * (2.0 * LEG + BEND * np.pi / 2.0) - LEG  # of the outer side; 0 where the bend begins
        angle = np.clip(along / BEND, 0.0, np.pi / 2.0)
        straight = along - BEND * angle  # negative below the bend, positive beyond it
        depth = BEND - THICKNESS * w
        x = BEND - depth * np.cos(angle) + np.maximum(straight, 0.0)
        z = depth * np.sin(angle) - BEND + np.minimum(straight, 0.0)
        return x, WIDTH * v, z

    return iga_nn.BSplineVolume.from_function(place, (n, 6, 5))


def main(out: str | Path = "out/bracket") -> Path:
    """Print displacement, stresses and reactions; returns the picture of the bent bracket."""
    volume = bracket()
    body = iga_nn.Elasticity(young=210000.0, poisson_ratio=0.3, fix=HELD, pressure={LOADED: PRESSURE})
    solution = iga_nn.solve(volume, body, refine=1)
    print(solution.report)
    print("displacement", solution.extremes("magnitude"))
    print("von Mises", solution.extremes("von_mises"))
    force = -solution.report.balance.load[2]
    (stress,) = solution.quantity("stress", volume.locate([PLACE]))
    theory = -6.0 * force * (50.0 - PLACE[0]) / (WIDTH * THICKNESS**2)
    print(f"stress below the arm {stress[0, 0]:.1f} MPa, beam theory {theory:.1f} MPa")
    return draw(out, volume, solution, "displacement, drawn 50 times too large", exaggerate=50.0)


if __name__ == "__main__":
    main()
