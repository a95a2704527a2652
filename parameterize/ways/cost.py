"""Counts the work of ways, in pieces whose time a machine can measure, and their memory.

A pass takes 1000 points through the network, forward and backward. A product is one with the second derivative of the
distortion of a cube's spline. The numbers were measured on conch and duck, and for hard surfaces on bone and homer.
"""

import math
from dataclasses import dataclass

from ..config import Config
from ..refinement import GROWTH

NEWTON_VERTEX = 6e-4  # passes for each vertex of the surface in a Newton step
NEWTON_STEP, CERTIFICATE, FIT = 55.0, 270.0, 500.0  # products
EASY, HARD = (5, 13), (15, 20)  # rounds, and Newton steps a round, on all control points
LAID_PATCH, LAID_POINT, POINTS_OF_PATCH = 1.5e-3, 1.3e-4, 64  # seconds of certificate and distances of laid blocks
EASY_ROUNDS, EASY_POINT = (8, 18), 4.5e-4  # rounds of blocks, and seconds of a round for each control point
HARD_ROUNDS, HARD_POINT = (12, 24), 1.4e-3  # the same where the surface has long sharp edges
HARD_AFTER = (3, 14)  # rounds, and Newton steps a round, after each insertion of knots


@dataclass(frozen=True)
class Cost:
    """Hold the passes and the products of a map: those of an easy and of a hard surface; and megabytes of its own.

    control_points: of the finished map, at most, those at interfaces for each of the blocks. patches: its blocks.
    seconds: of other work, for an easy and a hard surface, on the machine that they were measured on
    (iga_nn/workflow/pace.py).
    """

    passes: tuple[float, float]
    products: tuple[float, float]
    control_points: float
    memory_mb: float = 0.0
    patches: int = 1
    seconds: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def of_certificate(cls, control_points: float, patches: int) -> "Cost":
        """Return the cost of a map that is certified and left as it is.

        control_points: of all blocks, those at interfaces for each of them.
        """
        seconds = LAID_PATCH * patches + LAID_POINT * max(0.0, control_points - POINTS_OF_PATCH * patches)
        return cls((0.0, 0.0), (0.0, 0.0), control_points, patches=patches, seconds=(seconds, seconds))

    @classmethod
    def of_blocks(cls, control_points: float, patches: int, is_sharp: bool) -> "Cost":
        """Return the cost of the rounds of blocks that are drawn to the surface; sharp edges take many rounds."""
        rounds, point = (HARD_ROUNDS, HARD_POINT) if is_sharp else (EASY_ROUNDS, EASY_POINT)
        low, high = (count * point * control_points for count in rounds)
        return cls((0.0, 0.0), (0.0, 0.0), control_points, patches=patches, seconds=(low, high))

    @classmethod
    def of_cube(cls, config: Config, vertices: int) -> "Cost":
        """Return the cost of the rounds of one cube for a surface with so many vertices, and of its refinement."""
        spline, most = config.spline, config.spline.control_points
        (low, few), (high, many) = (_rounds(config, *effort) for effort in (EASY, HARD))
        if config.refinement is not None:  # it may end with the first spline, or only at its limit
            most = config.refinement.max_control_points
            rounds, steps = HARD_AFTER
            later = sum(_growths(most, spline.control_points)) * rounds
            steps = min(steps, spline.steps)
            high, many = high + later * (steps * NEWTON_STEP + CERTIFICATE), many + later * steps
        newton = NEWTON_VERTEX * vertices
        return cls((few * newton, many * newton), (FIT + low, FIT + high), most**3)


def _rounds(config: Config, rounds: int, steps: int) -> tuple[float, float]:
    """Return the products and the Newton steps of rounds with so many steps, within the limits of the options."""
    spline = config.spline
    rounds, steps = min(rounds, spline.rounds), min(steps, spline.steps)
    return rounds * (steps * NEWTON_STEP + CERTIFICATE), float(rounds * steps)


def _growths(most: int, control_points: int) -> list[float]:
    """Return the factors by which the number of control points grows in each refinement, up to `most` a direction."""
    whole = (most / control_points) ** 3
    count = math.ceil(math.log(whole) / math.log(GROWTH))
    return [min(GROWTH**number, whole) for number in range(1, count + 1)]
