"""The spline stage on two sets of knots: its first rounds on few control points, the others on all.

The first rounds move the map far, and need no fine spline for that; on fewer spans they take a fraction of the time.
The map so found is then interpolated on the fine knots.
"""

from dataclasses import replace
from typing import Any

from .arrays import Knots
from .checkpoint import Checkpoints
from .config import SplineConfig
from .optimization.certified_map import CertifiedMap
from .optimization.endings import Course
from .optimization.phases import PATIENT_ROUNDS, Schedule
from .optimization.rounds import optimize
from .optimization.surface_distance import Correspondence
from .optimization.term import Weights
from .progress import History, ProgressCallback
from .spline.bspline import open_uniform_knots
from .spline.spline_map import SplineMap


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
