"""The spline stage on two sets of knots: its first rounds on few control points, the others on all.

The first rounds move the map far, and need no fine spline for that; on fewer spans they take a fraction of the time.
The map so found is then interpolated on the fine knots.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from .arrays import Array, Knots
from .checkpoint import Checkpoints
from .config import SplineConfig
from .optimization.endings import Course
from .optimization.optimized import Optimized
from .optimization.phases import PATIENT_ROUNDS, Schedule
from .optimization.rounds import optimize
from .optimization.surface_distance import SurfaceFit
from .optimization.term import Weights
from .progress import History, ProgressCallback
from .spline.bspline import evaluate_grid, greville, interpolate_grid, open_uniform_knots


def coarse_knots(config: SplineConfig, share: float) -> Knots:
    """Return the knots of the first rounds: a share of the spans a direction that F has in the end, at least one."""
    spans = max(1, round(share * (config.control_points - config.degree)))
    return (open_uniform_knots(config.degree + spans, config.degree),) * 3


def optimize_coarse_first(
    control: Array,
    fit: SurfaceFit,
    config: SplineConfig,
    schedule: Schedule,
    weights: Weights,
    *,
    history: History,
    progress: ProgressCallback,
    checkpoints: Checkpoints,
) -> tuple[Optimized, Course, SurfaceFit]:
    """Run the first phase on the knots of `control` and `fit`, the others on all; return map, course and data there.

    control: (3, n_u, n_v, n_w) on `coarse_knots`. The first rounds have a checkpoint of their own. Where both sets of
    knots are the same, all rounds are one run.
    """
    report: dict[str, Any] = {"history": history, "progress": progress}
    knots, fine = fit.places.knots, (open_uniform_knots(config.control_points, config.degree),) * 3
    if len(fine[0]) == len(knots[0]):
        return *optimize(control, fine, fit, config, schedule, weights, checkpoints=checkpoints, **report), fit
    longer = (len(fine[0]) / len(knots[0])) ** 1.5  # that a step takes on all of them, about
    begun = min(schedule.grown or PATIENT_ROUNDS, schedule.rounds - 1)  # at least one round is on all
    usual = schedule.usual_steps[:begun]
    usual += tuple(math.ceil(longer * steps) for steps in schedule.usual_steps[begun:])
    first = replace(schedule, rounds=begun, usual_steps=usual)
    kept = checkpoints.of_part("coarse")
    found, earlier = optimize(control, knots, fit, config, first, weights, checkpoints=kept, **report)
    control, fit = interpolated(found.control, knots, fine, config.degree), fit.on_knots(fine)
    found, course = optimize(
        control, fine, fit, config, schedule, weights, checkpoints=checkpoints, begun=begun, **report
    )
    return found, course.after(earlier), fit


def interpolated(control: Array, knots: Knots, finer: Knots, degree: int) -> Array:
    """Return the control points (3, n_u, n_v, n_w) on other knots of the map that agrees at their Greville points."""
    places = [greville(row, degree) for row in finer]
    values = evaluate_grid((degree,) * 3, knots, np.moveaxis(control, 0, -1), places)
    return np.ascontiguousarray(np.moveaxis(interpolate_grid(finer, degree, values), -1, 0))
