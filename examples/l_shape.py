r"""An L of three patches
=====================

Three cubes around an edge that points inward. There the gradient of the solution is infinite, and no degree helps: the
error falls by the edge alone, like h to the power 4/3.

.. math:: u = r^{2/3} \sin(2 \varphi / 3)

`python examples/l_shape.py`. The angle is taken from the edge's first wall; u is zero on both walls beside the edge.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from common import draw

import iga_nn

PLACES = ((0, 0), (-1, 0), (-1, -1))  # least corners of the cubes in x and y; the edge is the z axis


def singular(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the solution, which is zero on the walls y = 0 and x = 0 beside the edge."""
    angle = np.mod(np.arctan2(y, x), 2.0 * np.pi)  # 0 to 270 degrees inside
    return np.hypot(x, y) ** (2.0 / 3.0) * np.sin(2.0 * angle / 3.0) + 0.0 * z


def main(out: str | Path = "out/l_shape") -> Path:
    """Print errors and rates for the singular and for a smooth solution; returns the picture of u."""
    cubes = [
        iga_nn.BSplineVolume.from_function(lambda u, v, w, x=x, y=y: (x + u, y + v, 0.5 * w), control_points=5)
        for x, y in PLACES
    ]
    body = iga_nn.Body.from_patches(cubes)
    ends = {"w0": "0", "w1": "0"}
    edge = iga_nn.Poisson(exact=singular, source="0", neumann=ends)
    for name, law in (("singular", edge), ("smooth", iga_nn.Poisson(exact="sin(x)*exp(y)"))):
        print(name)
        for row in iga_nn.convergence(body, law, refine=range(3)):
            print(row)
    return draw(out, body, iga_nn.solve(body, edge, refine=2), "u near an edge that points inward")


if __name__ == "__main__":
    main()
