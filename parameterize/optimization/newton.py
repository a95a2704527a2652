"""One round of truncated Newton steps on the energy of energy.py, and when it ends.

Between steps the boundary parameters slide (surface_distance.py). Steps and sliding by turns converge linearly;
acceleration.py looks ahead, and what it finds is kept where it is lower.
"""

import logging
import math
import time
from dataclasses import dataclass, replace

from ..arrays import Array
from ..config import SplineConfig
from ..progress import History, Progress, ProgressCallback
from .acceleration import Acceleration
from .energy import SplineEnergy

_log = logging.getLogger(__name__)
_SHORTEST_STEP = 1e-6


@dataclass(frozen=True, eq=False)
class _Point:
    """Control points with energy and gradient, the boundary's part apart: it alone changes when parameters slide."""

    control: Array
    inner: tuple[float, Array]
    outer: tuple[float, Array]
    folded: int

    @property
    def total(self) -> float:
        return self.inner[0] + self.outer[0]

    @property
    def gradient(self) -> Array:
        return self.inner[1] + self.outer[1]


def _evaluate(control: Array, energy: SplineEnergy) -> _Point:
    value, gradient, folded = energy.volume_part(control)
    return _Point(control, (value, gradient), energy.surface_part(control), folded)


def _line_search(point: _Point, direction: Array, energy: SplineEnergy) -> tuple[_Point, float] | None:
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


def _look_ahead(found: _Point, acceleration: Acceleration, energy: SplineEnergy) -> _Point | None:
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


def _next_damping(damping: float, length: float, config: SplineConfig) -> float:
    """Raise the damping after a step that had to be shortened to less than half, lower it after a full one."""
    if length < 0.5:
        return max(config.damping, config.damping_growth * damping)
    lowered = damping / config.damping_growth if length == 1.0 else damping
    return lowered if lowered >= config.damping else 0.0


def _expected_steps(config: SplineConfig, number: int, step: int) -> int:
    """Return how many steps are left after one of a round where the run is a usual one; hard shapes take more."""
    usual = [min(count, config.steps) for count in config.usual_steps]
    present = usual[number] if number < len(usual) else config.least_steps
    return max(present - step - 1, 1) + sum(usual[number + 1 :])


def descend(
    energy: SplineEnergy,
    control: Array,
    number: int,
    *,
    growing: bool,
    history: History,
    progress: ProgressCallback,
) -> Array:
    """Return the control points (3, n_u, n_v, n_w) after one round of steps; the surface's parameters slide with them.

    number: of the round. growing: whether F still grows into the solid in it, which then has fewer steps.
    """
    config, steps = energy.config, energy.config.steps
    most = config.growth.steps if config.growth and growing else steps
    energy.watch_facing(control)
    point = _evaluate(control, energy)
    lowest, waited, small, damping, acceleration = point.total, 0, 0, 0.0, Acceleration(config.memory)
    for step in range(most):
        begun = time.perf_counter()
        direction = energy.newton_direction(point.control, -point.gradient, damping)
        searched = _line_search(point, direction, energy)
        if searched is None:
            _log.info("round %d: no descent after step %d", number, step)
            break
        found, length = searched
        damping = _next_damping(damping, length, config)
        if length < 1.0:
            acceleration.forget()
        else:
            acceleration.add(point.control, found.control)
        ahead = _look_ahead(found, acceleration, energy)
        before = point.total
        if ahead is None:
            energy.slide(found.control)
            ahead = replace(found, outer=energy.surface_part(found.control))
        point = ahead
        gain = before - min(found.total, point.total)  # sliding may raise the energy of what is folded
        done = number * steps + step + 1
        history.add("spline", done - 1, point.total, point.folded, {"surface": point.outer[0]})
        total = max(number + 1, len(config.usual_steps)) * steps
        left = _expected_steps(config, number, step) * (time.perf_counter() - begun)
        progress(Progress("spline", done, total, point.total, point.folded, left))
        enough = config.gain if number else config.first_gain
        waited = 0 if point.total < (1.0 - enough) * lowest else waited + 1
        lowest = min(lowest, point.total)
        small = small + 1 if gain < enough * point.total else 0
        if step + 1 >= config.least_steps and (small >= config.small_gains or waited >= config.least_steps):
            break
    return point.control
