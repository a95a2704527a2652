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
HARD_AFTER = (3, 14)  # rounds, and Newton steps a round, after each insertion of knots


@dataclass(frozen=True)
class Cost:
    """Hold the passes and the products of a map: those of an easy and of a hard surface; and megabytes of its own.

    control_points: of the finished map, at most.
    """

    passes: tuple[float, float]
    products: tuple[float, float]
    control_points: float
    memory_mb: float = 0.0

    @classmethod
    def of_certificate(cls, control_points: float, config: Config) -> "Cost":
        """Return the cost of a map with so many control points in all that is certified and left as it is."""
        products = CERTIFICATE * control_points / config.spline.control_points**3
        return cls((0.0, 0.0), (products, products), control_points)

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
