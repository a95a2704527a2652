r"""Eight patches around a hole
===========================

A plate with a round hole, pulled along x, is no image of one cube. Eight patches by a formula, glued along their faces,
make it, and the stress at the hole is that of Kirsch's infinite plate: three times the pull. The outer edge, face u1 of
every patch, moves as that plate does.

`python examples/plate_with_hole.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from common import draw

import iga_nn

HALF = 4.0  # of the plate's edge; the hole has the radius 1
THICKNESS = 0.5
PARTS = 8  # of the full circle
RATIO = 0.3  # Poisson's


def sector(number: int) -> iga_nn.BSplineVolume:
    """Return the part of the plate between the ray at 45 degrees times `number` and the next ray."""

    def place(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, ...]:
        angle = (number + v) * 2.0 * np.pi / PARTS
        x, y = np.cos(angle), np.sin(angle)
        outer = HALF / np.maximum(abs(x), abs(y))  # where the ray leaves the plate
        radius = 1.0 + (outer - 1.0) * 0.5 * (u + u**2)  # shorter spans near the hole
        return radius * x, radius * y, THICKNESS * w

    return iga_nn.BSplineVolume.from_function(place, control_points=(11, 9, 4))


def displacement(x: np.ndarray, y: np.ndarray, along: int) -> np.ndarray:
    """Return a component of the displacement of Kirsch's infinite plate, pulled along x by 1, in plane strain."""
    radius, angle, kappa = np.hypot(x, y), np.arctan2(y, x), 3.0 - 4.0 * RATIO
    wave, sign = (np.cos, 1.0) if along == 0 else (np.sin, -1.0)
    far = radius * (kappa + 1.0 if along == 0 else kappa - 3.0) * wave(angle)
    near = 2.0 / radius * ((1.0 + sign * kappa) * wave(angle) + wave(3.0 * angle))
    return (far + near - 2.0 / radius**3 * wave(3.0 * angle)) * (1.0 + RATIO) / 4.0  # 1 / (8 mu), Young's modulus 1


def main(out: str | Path = "out/plate_with_hole") -> Path:
    """Print the stress at the hole beside Kirsch's; returns the picture of the displacement."""
    plate = iga_nn.Body.from_patches([sector(number) for number in range(PARTS)])
    pulled = [lambda x, y, z: displacement(x, y, 0), lambda x, y, z: displacement(x, y, 1), "0"]
    law = iga_nn.Elasticity(poisson_ratio=RATIO, fix={"u1": pulled}, symmetry="w0 or w1")
    solution = iga_nn.solve(plate, law)
    print(f"{len(plate)} patches, {len(plate.interfaces)} interfaces: {solution.report}")
    top = solution.patches[2].quantity("stress", [[0.0, 0.0, 0.5]])[0]  # at (0, 1)
    side = solution.patches[0].quantity("stress", [[0.0, 0.0, 0.5]])[0]  # at (1, 0)
    print(f"stress along the hole: {top[0, 0]:.3f} at its top (Kirsch: 3), {side[1, 1]:.3f} at its side (-1)")
    return draw(out, plate, solution, "displacement of a pulled plate", exaggerate=0.1)


if __name__ == "__main__":
    main()
