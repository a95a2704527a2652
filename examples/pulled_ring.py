r"""A ring in tension
=================

A closed mesh with a handle becomes blocks along its skeleton, and a body on which supports and loads act.

A ring of radius :math:`R` with a round section of radius :math:`c` is held at its lowest point and pulled upward at its
highest one by a force :math:`P`. No cube is mapped onto it: four blocks are, glued end to end. Half-way between, at the
distance :math:`r` from the axis, the stress along the ring stands beside that of Winkler's theory of curved beams,

.. math:: \sigma = \frac{P}{2 A} + \frac{M}{A e} \left( \frac{n}{r} - 1 \right), \qquad
          M = \frac{P R}{2} \left( 1 - \frac{2}{\pi} + \frac{2 e}{\pi R} \right),

with :math:`A = \pi c^2`, the neutral radius :math:`n = (R + \sqrt{R^2 - c^2}) / 2` and :math:`e = R - n`: the moment of
a thick ring, *Roark's Formulas for Stress and Strain*, 7th edition, table 9.2, case 1. In the theory sections stay
plane and loads act at points, so it is not exact for so thick a ring.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from common import draw

import iga_nn
from iga_nn.figures.map import draw_blocks
from iga_nn.figures.render import can_draw
from parameterize import surface_from_arrays

RADIUS, SECTION = 1.0, 0.35
HELD, PULLED = "y < -1.33", "y > 1.33"  # of 1.35: small spots


def ring(around: int = 60, across: int = 20) -> iga_nn.Surface:
    """Return the surface of the ring, triangles on a grid of its two angles."""
    along, turn = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    angle, tilt = 2.0 * np.pi * along / around, 2.0 * np.pi * turn / across
    out = RADIUS + SECTION * np.cos(tilt)
    points = np.stack([out * np.cos(angle), out * np.sin(angle), SECTION * np.sin(tilt)], axis=-1)
    number = along * across + turn
    ahead = np.roll(number, -1, axis=0)
    corners = number, ahead, np.roll(ahead, -1, axis=1), np.roll(number, -1, axis=1)
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return surface_from_arrays(points.reshape(-1, 3), faces, "ring")


def thick_ring(radii: np.ndarray) -> np.ndarray:
    """Return the stress along a ring that is pulled by a force of 1, a quarter of a turn away from the force."""
    area, neutral = np.pi * SECTION**2, (RADIUS + np.sqrt(RADIUS**2 - SECTION**2)) / 2.0
    offset = RADIUS - neutral
    moment = RADIUS / 2.0 * (1.0 - 2.0 / np.pi + 2.0 * offset / (np.pi * RADIUS))
    return 1.0 / (2.0 * area) + moment / (area * offset) * (neutral / radii - 1.0)


def main(out: str | Path = "out/pulled_ring", config: object = None) -> Path:
    """Print what is proved, and the stress beside the formula; returns the picture of the pulled ring."""
    result = iga_nn.parameterize(ring(), config)
    body = result.volume
    print(f"{len(body)} blocks, {len(body.interfaces)} interfaces")
    print(result.quality)
    law = iga_nn.Elasticity(young=1000.0, poisson_ratio=0.3, fix=HELD, load={PULLED: (0.0, 1.0, 0.0)})
    solution = iga_nn.solve(body, law, refine=0)
    print(solution.report)
    force = solution.report.balance.load[1]
    radii = np.array([0.66, 0.8, 1.2, 1.34])
    stress = solution.quantity("stress", np.stack([radii, 0.0 * radii, 0.0 * radii], axis=1))[:, 1, 1] / force
    for radius, found, theory in zip(radii, stress, thick_ring(radii), strict=True):
        print(f"stress at r = {radius:.2f}: {found:.2f} times the force, thick ring {theory:.2f}")
    picture = draw(out, body, solution, "displacement of a pulled ring", exaggerate=100.0)
    if can_draw():
        draw_blocks(picture.with_name("blocks.png"), body)
    return picture


if __name__ == "__main__":
    main()
