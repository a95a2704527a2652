"""One round of truncated Newton steps on the energy of energy.py, and the rule by which it ends.

Between steps the boundary parameters slide (surface_distance.py). Steps and sliding by turns converge linearly;
acceleration.py looks ahead, and what it finds is kept where it is lower.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..arrays import Array
from .acceleration import Acceleration
from .energy import SplineEnergy

_log = logging.getLogger(__name__)
_SHORTEST_STEP = 1e-6
_MEMORY = 4  # differences of Newton steps from which the next place is guessed: older ones belong to another shape
_DAMPING = 1.0  # of a Newton step once the one before had to be shortened (Levenberg, Marquardt)
_DAMPING_GROWTH = 3.0  # factor after each further one, and divisor after a full step
FIRST_GAIN = 8e-3  # `StoppingRule.gain` of the first round of all: what it leaves the next ones lower anyway
GAIN = 1e-3  # likewise of later ones
LEAST_STEPS = 6  # a round: what unfolds a few spans hardly lowers the energy of the whole
_SMALL_GAINS = 2  # in a row end a round: a step may gain little by chance


@dataclass(frozen=True, eq=False)
class Point:
    """Control points with energy and gradient, the boundary's part apart: it alone changes when parameters slide."""

    control: Array
    inner: tuple[float, Array]
    outer: tuple[float, Array]
    folded: int

    @property
    def total(self) -> float:
        """Return the energy."""
        return self.inner[0] + self.outer[0]

    @property
    def gradient(self) -> Array:
        """Return its gradient."""
        return self.inner[1] + self.outer[1]


def _evaluate(control: Array, energy: SplineEnergy) -> Point:
    value, gradient, folded = energy.volume_part(control)
    return Point(control, (value, gradient), energy.surface_part(control), folded)


def _line_search(point: Point, direction: Array, energy: SplineEnergy) -> tuple[Point, float] | None:
    """Shorten the step until the energy falls enough (Armijo); return where it leads, and its length, at most 1.

    The next length is where the parabola through the values and the slope at 0 has its minimum, between a tenth and a
    half of the last (Nocedal and Wright, section 3.5). None where the direction does not lead down.
    """
    slope = float((direction * point.gradient).sum())
    length = 1.0
    while slope < 0.0 and length > _SHORTEST_STEP:
        trial = _evaluate(point.control + length * direction, energy)
        rise = trial.total - point.total
        if rise <= 1e-4 * length * slope:
            return trial, length
        parabola = -slope * length / (2.0 * (rise - slope * length)) if math.isfinite(rise) else 0.1
        length *= min(max(parabola, 0.1), 0.5)
    return None


def _look_ahead(found: Point, acceleration: Acceleration, energy: SplineEnergy) -> Point | None:
    """Return the point that the acceleration guesses, parameters slid there; None where it lies no lower than `found`.

    The parameters are then where they were.
    """
    if (control := acceleration.guess()) is None:
        return None
    places = energy.surface.places
    before = places.parameters, places.cube_faces
    energy.slide(control)
    ahead = _evaluate(control, energy)
    if ahead.total < found.total:
        return ahead
    places.place(*before)
    acceleration.forget(keep=1)
    return None


def _next_damping(damping: float, length: float) -> float:
    """Raise the damping after a step that had to be shortened to less than half, lower it after a full one."""
    if length < 0.5:
        return max(_DAMPING, _DAMPING_GROWTH * damping)
    lowered = damping / _DAMPING_GROWTH if length == 1.0 else damping
    return lowered if lowered >= _DAMPING else 0.0


@dataclass
class StoppingRule:
    """When a round of steps ends: after `steps`, or where they lower the energy by less than the share `gain`.

    Steps with sliding count together: single ones may gain little, and sliding may raise the energy of what is folded.
    """

    steps: int
    gain: float
    taken: int = 0
    lowest: float = math.inf  # energy before each of the steps taken
    waited: int = 0  # steps since it was last lowered enough
    small: int = 0  # gains in a row that were too small

    def ends(self, before: float, searched: float, slid: float) -> bool:
        """Return whether a step is the last: its energy before it, after the line search, and after sliding."""
        self.taken += 1
        self.lowest = min(self.lowest, before)
        self.waited = 0 if slid < (1.0 - self.gain) * self.lowest else self.waited + 1
        self.small = self.small + 1 if before - min(searched, slid) < self.gain * slid else 0
        tired = self.small >= _SMALL_GAINS or self.waited >= LEAST_STEPS
        return self.taken >= self.steps or (self.taken >= LEAST_STEPS and tired)


def descend(energy: SplineEnergy, control: Array, rule: StoppingRule, after_step: Callable[[Point], None]) -> Array:
    """Return the control points (3, n_u, n_v, n_w) after one round of steps; the surface's parameters slide with them.

    after_step: called with where each step has led to.
    """
    energy.watch_facing(control)
    point = _evaluate(control, energy)
    damping, acceleration, ended = 0.0, Acceleration(_MEMORY), False
    while not ended:
        direction = energy.newton_direction(point.control, -point.gradient, damping)
        searched = _line_search(point, direction, energy)
        if searched is None:
            _log.info("no descent after step %d of the round", rule.taken)
            break
        found, length = searched
        damping = _next_damping(damping, length)
        if length < 1.0:
            acceleration.forget()
        else:
            acceleration.add(point.control, found.control)
        ahead = _look_ahead(found, acceleration, energy)
        if ahead is None:
            energy.slide(found.control)
            ahead = replace(found, outer=energy.surface_part(found.control))
        after_step(ahead)
        ended = rule.ends(point.total, found.total, ahead.total)
        point = ahead
    return point.control
