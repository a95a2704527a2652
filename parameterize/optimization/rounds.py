"""Optimises the control points: distortion, smoothness, boundary and injectivity of F together (section 4.3.2, step 3).

The energy of energy.py is lowered in rounds (newton.py), phase after phase (phases.py). After each round the map is
certified, and unproved spans receive new weights.

The first rounds move the map far, and need no fine spline for that; on fewer spans they take a fraction of the time.
The map so found is then interpolated on the fine knots, for the other rounds.
"""

import logging
import time
from dataclasses import dataclass, replace
from typing import Any

from ..arrays import IntArray, Knots
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..progress import History, Progress, ProgressCallback, ignore, timed
from ..spline.bspline import open_uniform_knots
from ..spline.spline_map import SplineMap
from ..threads import one_blas_thread
from ..time_limit import OutOfTime, check_time, cut_short, seconds_left, seconds_to_spare
from .endings import CertifiedMap, Course, Reason
from .energy import SplineEnergy
from .newton import FIRST_GAIN, Point, StoppingRule, descend
from .phases import PATIENT_ROUNDS, RELAXING, Phase, Schedule
from .spans import edge_spans
from .state import State
from .surface_distance import Correspondence
from .term import Weights

_log = logging.getLogger(__name__)
_SPAN_GROWTH = 5.0  # factor of the penalty's weight at unproved spans, each round
_SPAN_MOST = 125.0  # of these factors together


def optimize(
    start: SplineMap,
    surface: Correspondence,
    config: SplineConfig,
    schedule: Schedule,
    weights: Weights = Weights(),
    *,
    history: History,
    progress: ProgressCallback = ignore,
    checkpoints: Checkpoints | None = None,
    begun: int = 0,
    watched: IntArray | None = None,
) -> tuple[CertifiedMap, Course]:
    """Minimise the energy from a map at volume 1, in rounds, phase after phase; return a map and the rounds' course.

    A round sets weights, descends and certifies the map. The returned map is the last certified map whose boundary is
    proved not to meet itself; or else the last certified map whose boundary is undecided; or else the last certified
    map; or else the map with the fewest unproved spans.

    Where a time limit leaves no time for another round, the rounds end with what they have.

    begun: the number of rounds on other knots that have led to `start`. watched: (k, 4), the spans that nearly fold in
    `start`. A checkpoint is kept after every round. After the call, the surface's parameters belong to the returned
    map.
    """
    checkpoints = checkpoints or Checkpoints.none()
    with one_blas_thread():
        energy = SplineEnergy(start.nets, surface, weights, grown=schedule.grown > 0)
        energy.determinants.activate(edge_spans(start.nets))
        if watched is not None:
            energy.determinants.activate(watched)
        first = CertifiedMap.of(start)
        state = State(energy, start, first, surface.sliding.on_faces, number=begun, halved=begun)
        state.restore(checkpoints, history)
        pace = _Pace()
        for phase in schedule.phases:
            while (reason := phase.done(state)) is None and state.number < schedule.rounds:
                if not pace.allows(state):
                    reason = Reason.OUT_OF_TIME
                    break
                try:
                    with timed(state.seconds, phase.name):
                        told = _StepReport(state.number, config.steps, schedule, history, progress)
                        _round(state, phase, schedule, told)
                except OutOfTime:
                    reason = Reason.OUT_OF_TIME
                    break
                state.save(checkpoints, history)
            ending = reason or Reason.OUT_OF_ROUNDS
            if ending.ends_the_rounds:
                break
        if ending is Reason.OUT_OF_TIME:
            cut_short(f"the rounds of the spline, after {state.number}")
        surface.sliding.place(*state.best_parameters)
    return state.best, Course(state.rounds, state.seconds, ending)


class _Pace:
    """Say whether a time limit allows another round: it takes as long as the one before."""

    def __init__(self) -> None:
        self._before, self._last = time.monotonic(), 0.0

    def allows(self, state: State) -> bool:
        """Return whether there is time: rounds on a map without faults leave more of it to later stages."""
        now = time.monotonic()
        self._before, self._last = now, now - self._before
        left = seconds_left() if any(state.best.faults) else seconds_to_spare()
        return left > self._last


def _round(state: State, phase: Phase, schedule: Schedule, report: "_StepReport") -> None:
    """Set weights, descend and certify; then penalise unproved spans and let the surface's data give way near them."""
    energy, number = state.energy, state.number
    grows, steps = bool(phase.shares), phase.steps or report.most
    phase.begin(state)
    share = phase.shares[number] if grows else None
    energy.start_round(state.spline.control, phase.penalty(number), share, by_faces=phase.by_faces)
    rule = StoppingRule(steps, schedule.gain if number else FIRST_GAIN)
    control = descend(energy, state.spline.control, rule, report)
    found = CertifiedMap.of(state.spline.with_control(control))
    state.last_square = energy.surface.mean_square(control)
    found = phase.amended(state, found)
    verdict, unproved = found.certificate.verdict, found.unproved
    meets = ", the boundary meets itself" if found.meets_itself else ""
    _log.info("round %d, %s: %s, %d spans unproved%s", number, phase.name, verdict, len(unproved), meets)
    state.spline, state.unproved_before, state.unproved = found.spline, state.unproved, len(unproved)
    state.certified |= not grows and verdict == "certified"
    if number == 0 or grows or found.rank <= state.best.rank:
        state.keep(found)
    if not state.many:
        energy.determinants.activate(unproved)
    if number >= PATIENT_ROUNDS and len(unproved):
        energy.determinants.stiffen(unproved, _SPAN_GROWTH, _SPAN_MOST)
    if number >= phase.patience and len(unproved):
        energy.relax(unproved, RELAXING)
    if 2 * len(unproved) <= state.fewest or number <= schedule.grown:
        state.fewest, state.halved = len(unproved), number
    state.number += 1
    state.rounds[phase.name] += 1


@dataclass
class _StepReport:
    """Report each step of a round to the history and to the progress callback."""

    number: int  # of the round
    most: int  # steps a round
    schedule: Schedule
    history: History
    progress: ProgressCallback
    step: int = 0

    def __call__(self, point: Point) -> None:
        """Report the point after a step."""
        check_time()
        done, loss = self.number * self.most + self.step, point.total
        self.history.add("spline", done, loss, point.folded, {"surface": point.outer[0]})
        steps = self.schedule.rounds * self.most  # at most: a round ends once it gains nothing more
        self.progress(Progress("spline", done + 1, steps, loss, point.folded, None))
        self.step += 1


def coarse_knots(config: SplineConfig, share: float) -> Knots:
    """Return the knots of the first rounds: a share of the spans a direction that F has in the end, at least one."""
    spans = max(1, round(share * (config.control_points - config.degree)))
    return (open_uniform_knots(config.degree + spans, config.degree),) * 3


def optimize_coarse_first(
    start: SplineMap,
    fit: Correspondence,
    config: SplineConfig,
    schedule: Schedule,
    weights: Weights,
    *,
    history: History,
    progress: ProgressCallback,
    checkpoints: Checkpoints,
) -> tuple[CertifiedMap, Course, Correspondence]:
    """Run the first phase on the knots of `start` and `fit`, the others on all; return map, course and data there.

    start: on `coarse_knots`. The first rounds have a checkpoint of their own. Where both sets of
    knots are the same, all rounds are one run.
    """
    report: dict[str, Any] = {"history": history, "progress": progress}
    fine = (open_uniform_knots(config.control_points, config.degree),) * 3
    if not start.nets.is_single or len(fine[0]) == len(start.knots[0]):
        return *optimize(start, fit, config, schedule, weights, checkpoints=checkpoints, **report), fit
    begun = min(schedule.grown or PATIENT_ROUNDS, schedule.rounds - 1)  # at least one round is on all
    first = replace(schedule, rounds=begun)
    kept = checkpoints.of_part("coarse")
    found, earlier = optimize(start, fit, config, first, weights, checkpoints=kept, **report)
    start = found.spline.interpolated(fine)
    fit = fit.on_nets(start.nets)
    found, course = optimize(start, fit, config, schedule, weights, checkpoints=checkpoints, begun=begun, **report)
    return found, course.after(earlier), fit
