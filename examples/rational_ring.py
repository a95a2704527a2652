r"""Rational ring
=============

A quarter of a thick pipe under inner pressure, its circles exact; beside Lamé's solution.

Circles are no polynomials: a rational spline (NURBS) has them exactly, a quarter by three control points with the
weights :math:`1, \sqrt{1/2}, 1`. At the radius :math:`r` between :math:`a` and :math:`b`, under the pressure :math:`p`
inside and held along the axis (plane strain), the pipe moves outward by

.. math:: \frac{(1 + \nu)\, p\, a^2}{E\, (b^2 - a^2)} \left( (1 - 2 \nu)\, r + \frac{b^2}{r} \right)

and the stress around it is :math:`p\, (a^2 + b^2) / (b^2 - a^2)` inside.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from common import draw

import iga_nn

INNER, OUTER, HEIGHT = 1.0, 2.0, 1.0
YOUNG, NU, PRESSURE = 1000.0, 0.3, 10.0
FACTOR = (1.0 + NU) * PRESSURE * INNER**2 / (YOUNG * (OUTER**2 - INNER**2))
LINE, ARC = [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]  # knots of degree 1 and 2


def quarter_pipe() -> iga_nn.BSplineVolume:
    """A quarter of the pipe: u runs along the radius, v along the angle from x to y, w along the axis."""
    corner = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    points = np.empty((2, 3, 2, 3))
    points[..., :2] = np.array([INNER, OUTER])[:, None, None, None] * corner[:, None]
    points[..., 2] = [0.0, HEIGHT]
    weights = np.broadcast_to(np.array([1.0, np.sqrt(0.5), 1.0])[:, None], (2, 3, 2))
    return iga_nn.BSplineVolume((1, 2, 1), (LINE, ARC, LINE), points, weights)


def main(out: str | Path = "out/rational_ring") -> Path:
    """Print the volume, rates, and the stress inside, beside the formulas; returns the picture of the widened pipe."""
    volume = quarter_pipe()
    formula = np.pi / 4.0 * (OUTER**2 - INNER**2) * HEIGHT
    print(f"certificate: {iga_nn.certify(volume).verdict}")
    print(f"volume {iga_nn.integrate(volume):.14f}, by the formula {formula:.14f}")
    outward = f"{FACTOR} * ({1.0 - 2.0 * NU} + {OUTER**2} / (x**2 + y**2))"  # over the radius
    pipe = iga_nn.Elasticity(
        exact=(f"{outward} * x", f"{outward} * y", "0"),
        pressure={"u0": str(PRESSURE)},
        symmetry=["v0", "v1", "w0", "w1"],
        young=YOUNG,
        poisson_ratio=NU,
    )
    print(iga_nn.convergence(volume, pipe, degree=3, refine=range(1, 5)))
    solution = iga_nn.solve(volume, pipe, degree=3, refine=3)
    stress = solution.quantity("stress", [[0.0, 0.0, 0.5]])[0, 1, 1]  # y is along the circle there
    known = PRESSURE * (INNER**2 + OUTER**2) / (OUTER**2 - INNER**2)
    print(f"stress around the pipe, inside: {stress:.4f}, by Lamé {known:.4f}")
    return draw(out, volume, solution.field, "displacement, drawn 10 times too large", exaggerate=10.0)


if __name__ == "__main__":
    main()
