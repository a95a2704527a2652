"""Control-point optimisation: distortion, smoothness, boundary and injectivity of F together (section 4.3.2, step 3).

Truncated Newton steps on the energy of energy.py. Between steps the boundary parameters slide (surface_distance.py).
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from ..certificate.jacobian import Certificate, certify
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..history import History
from ..progress import Progress, ProgressCallback, ignore
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume
from .determinant_penalty import edge_spans
from .energy import Knots, SplineEnergy
from .surface_distance import SurfaceFit

_log = logging.getLogger(__name__)
_CHECKPOINT = "spline"
_SLIDES = 2  # of the boundary parameters after each step
_RELAXATIONS = 1  # sweeps over triangles that they turned over
_SHORTEST_STEP = 1e-6
_LEAST_STEPS = 10  # a round: what unfolds a few spans hardly lowers the energy of the whole
# After so many rounds the anchors let go, and the surface gives way where the map is not proved: a cube edge in a
# valley cannot lie on it.
_PATIENT_ROUNDS = 2
_GIVING_WAY = 0.25  # of the weights there, each round


@dataclass(frozen=True, eq=False)
class Optimized:
    """Control points (3, n_u, n_v, n_w) at volume 1 and what the certificate says of them."""

    control: Tensor
    certificate: Certificate


def optimize(
    control: Tensor,
    knots: Knots,
    surface: SurfaceFit,
    config: SplineConfig,
    *,
    history: History,
    progress: ProgressCallback = ignore,
    checkpoints: Checkpoints | None = None,
) -> Optimized:
    """Minimise from `control` (3, n_u, n_v, n_w), volume 1, in rounds: descend, certify, watch the spans not proved.

    Each round raises the weight of the penalties on det J, so the first ones shape the map and the later ones
    unfold what is left. Where spans stay unproved, the surface data near them loses weight. Once the map is certified,
    a few more rounds take that back as far as they can. Anchors along the cube's edges draw F to the surface in those
    last rounds and, where it is close to begin with, in the first ones: not while what is folded comes apart. The
    result is the last certified map, else the one with the fewest unproved spans.
    A checkpoint is kept after every round.
    """
    checkpoints = checkpoints or Checkpoints(None, {}, resume=False)
    with _one_thread_an_operation():
        energy = SplineEnergy(config, knots, surface, device=control.device)
        return _rounds(control, knots, energy, history, progress, checkpoints)


@contextmanager
def _one_thread_an_operation() -> Iterator[None]:
    """Most tensors here are small: handing them to a second thread costs more than it saves (up to 4 times)."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _rounds(
    control: Tensor,
    knots: Knots,
    energy: SplineEnergy,
    history: History,
    progress: ProgressCallback,
    checkpoints: Checkpoints,
) -> Optimized:
    """Descend, certify, watch the spans not proved, until certified or at the end of the penalties."""
    config = energy.config
    energy.barrier.activate(edge_spans(tuple(len(breakpoints(k)) - 1 for k in knots)))  # type: ignore[arg-type]
    best = Optimized(control, certify(_as_volume(control, knots, config.degree)))
    near = energy.anchors.near(control)
    first, polished = 0, 0
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        first, control, best = _restore(*saved, energy, best, knots)
        history.rows[:] = [tuple(row) for row in saved[1]["history"]]
        polished = int(saved[1]["polished"])
    for number in range(first, config.rounds):
        if best.certificate.verdict == "certified" and number > 0:
            if polished == config.polish:
                break
            polished += 1
            energy.take_back(_GIVING_WAY)
        if polished or (near and number < _PATIENT_ROUNDS):
            energy.anchors.aim(control, hold=not polished)
        else:
            energy.anchors.release()
        energy.start_round(control, config.penalties[min(number, len(config.penalties) - 1)])
        control = _descend(control, energy, number, history, progress)
        certificate = certify(_as_volume(control, knots, config.degree))
        _log.info("round %d: %s, %d spans unproved", number, certificate.verdict, len(certificate.unproved))
        if number == 0 or len(certificate.unproved) <= len(best.certificate.unproved):
            best = Optimized(control, certificate)
        energy.barrier.activate(certificate.unproved)
        if number >= _PATIENT_ROUNDS and not polished and len(certificate.unproved):
            energy.give_way(certificate.unproved, _GIVING_WAY)
        _save(checkpoints, {"number": number + 1, "polished": polished}, control, best, energy, history)
    return best


def _save(
    checkpoints: Checkpoints,
    state: dict[str, Any],
    control: Tensor,
    best: Optimized,
    energy: SplineEnergy,
    history: History,
) -> None:
    tensors = {
        "control": control,
        "best": best.control,
        "parameters": torch.as_tensor(energy.surface.places.parameters),
        "cube_faces": torch.as_tensor(energy.surface.places.cube_faces),
        "yielding": torch.as_tensor(energy.surface.yielding),
        "anchors": torch.as_tensor(energy.anchors.fit.points),
        "anchors_yielding": torch.as_tensor(energy.anchors.fit.yielding),
        "active": torch.as_tensor(energy.barrier.active),
    }
    checkpoints.save(_CHECKPOINT, tensors, state | {"history": history.rows})


def _restore(
    tensors: dict[str, Tensor], state: dict[str, Any], energy: SplineEnergy, best: Optimized, knots: Knots
) -> tuple[int, Tensor, Optimized]:
    """Next round, control points and best result of a checkpoint; parameters and active spans go back in place."""
    device = best.control.device
    energy.surface.places.place(tensors["parameters"].numpy(), tensors["cube_faces"].numpy())
    energy.surface.give_way(tensors["yielding"].numpy())
    energy.anchors.restore(tensors["anchors"].numpy(), tensors["anchors_yielding"].numpy())
    energy.barrier.activate(tensors["active"].numpy())
    control, kept = tensors["control"].to(device), tensors["best"].to(device)
    return int(state["number"]), control, Optimized(kept, certify(_as_volume(kept, knots, energy.config.degree)))


@dataclass(frozen=True, eq=False)
class _Point:
    """Control points with energy and gradient, the boundary's part apart: it alone changes when parameters slide."""

    control: Tensor
    inner: tuple[float, Tensor]
    outer: tuple[float, Tensor]
    folded: int

    @property
    def total(self) -> float:
        return self.inner[0] + self.outer[0]

    @property
    def gradient(self) -> Tensor:
        return self.inner[1] + self.outer[1]


def _evaluate(control: Tensor, energy: SplineEnergy) -> _Point:
    value, gradient, folded = energy.volume_part(control)
    return _Point(control, (value, gradient), energy.surface_part(control), folded)


def _line_search(point: _Point, direction: Tensor, energy: SplineEnergy) -> _Point | None:
    """Shorten the step until the energy falls enough (Armijo); None where the direction does not lead down.

    The next length is where the parabola through the values and the slope at 0 has its minimum, between a tenth and a
    half of the last (Nocedal and Wright, section 3.5).
    """
    slope = float((direction * point.gradient).sum())
    length = 1.0
    while slope < 0.0 and length > _SHORTEST_STEP:
        trial = _evaluate(point.control + length * direction, energy)
        rise = trial.total - point.total
        if rise <= 1e-4 * length * slope:
            return trial
        parabola = -slope * length / (2.0 * (rise - slope * length)) if math.isfinite(rise) else 0.1
        length *= min(max(parabola, 0.1), 0.5)
    return None


def _descend(
    control: Tensor,
    energy: SplineEnergy,
    number: int,
    history: History,
    progress: ProgressCallback,
) -> Tensor:
    """One round of Newton steps with sliding boundary parameters."""
    steps = energy.config.steps
    usual = steps * (len(energy.config.penalties) + energy.config.polish)  # hard shapes take more
    started = time.perf_counter()
    energy.watch_facing(control)
    point = _evaluate(control, energy)
    lowest, waited = point.total, 0
    for step in range(steps):
        found = _line_search(point, energy.newton_direction(point.control, -point.gradient), energy)
        if found is None:
            _log.info("round %d: no descent after step %d", number, step)
            break
        gain = point.total - found.total
        for _ in range(_SLIDES):
            energy.surface.places.slide(found.control, energy.surface.points, 0.5 / control.shape[1])
        energy.surface.places.relax(_RELAXATIONS)
        energy.watch_facing(found.control)
        point = replace(found, outer=energy.surface_part(found.control))
        done = number * steps + step + 1
        history.add("spline", done - 1, point.total, point.folded, {"surface": point.outer[0]})
        total = max(usual, (number + 1) * steps)
        left = (time.perf_counter() - started) / (step + 1) * (total - done)
        progress(Progress("spline", done, total, point.total, point.folded, left))
        enough = energy.config.gain if number else energy.config.first_gain
        waited = 0 if point.total < (1.0 - enough) * lowest else waited + 1
        lowest = min(lowest, point.total)
        if step + 1 >= _LEAST_STEPS and (gain < enough * point.total or waited >= _LEAST_STEPS):
            break
    return point.control


def _as_volume(control: Tensor, knots: Knots, degree: int) -> BSplineVolume:
    points = control.permute(1, 2, 3, 0).cpu().numpy()
    return BSplineVolume((degree,) * 3, knots, points)
