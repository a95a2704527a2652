"""Control-point optimisation: distortion, smoothness, boundary and injectivity of F together (section 4.3.2, step 3).

Truncated Newton steps on the energy of energy.py. Between steps the boundary parameters slide (surface_distance.py).
Steps and sliding by turns converge linearly; acceleration.py looks ahead, and what it finds is kept where it is lower.
"""

import logging
import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ..arrays import Array, IntArray, Knots
from ..certificate.boundary import check_boundary
from ..certificate.jacobian import Certificate, certify
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..progress import History, Progress, ProgressCallback, ignore
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume
from .acceleration import Acceleration
from .determinant_penalty import acting_on, edge_spans, with_neighbours
from .energy import SplineEnergy
from .surface_distance import SurfaceFit

_log = logging.getLogger(__name__)
_CHECKPOINT = "spline"
_SHORTEST_STEP = 1e-6
_COUNTS = ("number", "parting", "polished", "fewest", "halved")  # of rounds and spans, in a checkpoint


@dataclass(frozen=True, eq=False)
class Optimized:
    """Control points (3, n_u, n_v, n_w) at volume 1, and what is proved of them.

    injective: True where the boundary is proved not to meet itself, False where it was found to, None where that is not
    decided; it is asked of certified maps alone.
    """

    control: Tensor
    certificate: Certificate
    injective: bool | None

    @classmethod
    def of(cls, control: Tensor, knots: Knots, config: SplineConfig) -> "Optimized":
        """Certify control points and, where that succeeds, check their boundary."""
        volume = BSplineVolume((config.degree,) * 3, knots, control.permute(1, 2, 3, 0).cpu().numpy())
        certificate = certify(volume)
        injective = check_boundary(volume).injective if certificate.verdict == "certified" else None
        return cls(control, certificate, injective)

    @property
    def meets_itself(self) -> bool:
        """Whether the boundary of a certified map was found to meet itself."""
        return self.injective is False

    @property
    def faults(self) -> tuple[int, bool]:
        """What keeps the map from being one-to-one; fewer unproved spans count first."""
        return len(self.certificate.unproved), self.meets_itself

    @property
    def rank(self) -> tuple[int, bool, bool]:
        """The faults, and whether the boundary is undecided: of two maps the one with the lower rank is better."""
        return *self.faults, self.injective is None


def optimize(
    control: Tensor,
    knots: Knots,
    surface: SurfaceFit,
    config: SplineConfig,
    *,
    history: History,
    progress: ProgressCallback = ignore,
    checkpoints: Checkpoints | None = None,
    begun: int = 0,
    watched: IntArray | None = None,
) -> Optimized:
    """Minimise from `control` (3, n_u, n_v, n_w), volume 1, in rounds: descend, certify, watch the spans not proved.

    Each round raises the weight of the penalties on det J, so the first ones shape the map and the later ones
    unfold what is left. Where spans stay unproved, the penalty on them and their neighbours grows further, and after
    `firm_rounds` the surface data near them loses weight. Where few of them stay for `smoothing_rounds`, F is smoothed
    there. Unless F still grows, the rounds end without a certified map where `stalling` of them have not halved the
    number of unproved spans, and after `firm_rounds` where more than `most_watched` spans are unproved or F is farther
    than `far` from the surface, root mean square.

    Where the boundary of a certified map meets itself, up to `parting` rounds push it apart, and the surface data there
    lose weight; where it still does then, the rounds end. Once the map is certified, a few more rounds take back what
    the data has lost, step by step, as far as they can. What these rounds fold again is moved back. Anchors along the
    cube's edges draw F to the surface in those last rounds and, where it is close to begin with, in the first ones: not
    while what is folded comes apart. The result is the last certified map whose boundary is proved not to meet itself,
    else the last one where that is not decided, else the last certified one, else the one with the fewest unproved
    spans.

    begun: of how many rounds `control` is the result, on other knots; watched (k, 3): spans that nearly fold there.
    A checkpoint is kept after every round. The surface's parameters are left as they belong to the result.
    """
    checkpoints = checkpoints or Checkpoints(None, {}, resume=False)
    with one_thread_an_operation():
        energy = SplineEnergy(config, knots, surface)
        energy.barrier.activate(edge_spans(tuple(len(breakpoints(k)) - 1 for k in knots)))  # type: ignore[arg-type]
        if watched is not None:
            energy.barrier.activate(watched)
        first = Optimized.of(control, knots, config)
        places = surface.places.parameters, surface.places.cube_faces
        near = energy.anchors.near(control)
        rounds = _Rounds(energy, knots, control, first, places, near=near, number=begun, halved=begun)
        if (saved := checkpoints.load(_CHECKPOINT)) is not None:
            rounds.restore(*saved, history)
        while not rounds.finished:
            rounds.begin()
            rounds.conclude(_descend(rounds, history, progress))
            rounds.save(checkpoints, history)
        surface.places.place(*rounds.best_places)
    return rounds.best


@contextmanager
def one_thread_an_operation() -> Iterator[None]:
    """Most tensors here are small: handing them to a second thread costs more than it saves (up to 4 times).

    A thread of `in_parallel` begins with torch's setting at its first operation and keeps it. All torch work in pieces
    belongs under this: else such a thread splits its sums, and bits depend on which thread takes a piece.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


@dataclass
class _Rounds:
    """Where the optimisation stands between two rounds; number, parting and polished count those done."""

    energy: SplineEnergy
    knots: Knots
    control: Tensor
    best: Optimized
    best_places: tuple[Array, IntArray]  # the surface's parameters (N, 3) that belong to it, and their cube faces (N,)
    near: bool  # whether F was close to the surface all along the cube's edges to begin with
    number: int = 0
    certified: bool = False  # whether a round on these knots has ended with a certified map
    parting: int = 0  # rounds in which the boundary of a certified map that meets itself is pushed apart
    polished: int = 0  # rounds after that, or after the map was certified for the first time
    fewest: int = sys.maxsize  # spans unproved when their number was last halved
    halved: int = 0  # the round in which that was
    off: float = math.inf  # mean squared distance of the best map from the surface
    lost: bool = False  # whether the rounds end without a certified map

    @property
    def finished(self) -> bool:
        """Whether no round is left, or the last polish has left nothing to take back."""
        config = self.energy.config
        polished = self.polished == config.polish or (self.polished > 0 and self.settled and not self.energy.yields)
        return self.number >= config.rounds or polished or self.lost

    @property
    def growing(self) -> bool:
        """Whether the next round is one of those in which F grows into the solid."""
        return self.number < len(self.shares)

    @property
    def shares(self) -> tuple[float, ...]:
        """The shares of the weight of the surface's data in the rounds in which F grows; none for other maps."""
        growth = self.energy.config.growth
        return () if growth is None else growth.shares

    @property
    def settled(self) -> bool:
        """Whether the last round has ended with the best map, not with one that folds again."""
        return torch.equal(self.control, self.best.control)

    def begin(self) -> None:
        """Weigh penalties, surface data and anchors for the next round."""
        config, energy = self.energy.config, self.energy
        if self.certified and self.best.meets_itself and self.parting < config.parting:
            self.parting += 1
            energy.give_way(energy.watch_contact(self.control), config.contact_way)
        elif self.certified:
            self.polished += 1
            if self.parting:
                energy.watch_contact(self.control)
            if self.settled:
                energy.take_back(config.giving_way)
        if self.polished or (self.near and self.number < config.patient_rounds):
            energy.anchors.aim(self.control, hold=not self.polished)
        else:
            energy.anchors.release()
        penalty = config.penalties[min(self.number, len(config.penalties) - 1)]
        energy.start_round(self.control, penalty, self.shares[self.number] if self.growing else None)

    def conclude(self, control: Tensor) -> None:
        """Certify what the round has found; watch the spans not proved and let the surface give way near them."""
        config = self.energy.config
        found = Optimized.of(control, self.knots, config)
        if self.polished:
            found = self._mended(found)
        elif not self.certified:
            found = self._smoothed(found)
        self.control, unproved = found.control, found.certificate.unproved
        meets = ", the boundary meets itself" if found.meets_itself else ""
        _log.info("round %d: %s, %d spans unproved%s", self.number, found.certificate.verdict, len(unproved), meets)
        self.certified |= not self.growing and found.certificate.verdict == "certified"
        if self.number == 0 or self.growing or found.rank <= self.best.rank:
            places = self.energy.surface.places
            self.best, self.best_places = found, (places.parameters, places.cube_faces)
            self.off = self._distance(found.control)
        many = len(unproved) > config.most_watched
        if not many:
            self.energy.barrier.activate(unproved)
        if self.number >= config.patient_rounds and len(unproved):
            self.energy.barrier.stiffen(unproved, config.span_growth, config.span_most)
        if self.number >= config.firm_rounds and not self.polished and len(unproved):
            self.energy.give_way(unproved, config.giving_way)
        if 2 * len(unproved) <= self.fewest or self.number <= len(self.shares):
            self.fewest, self.halved = len(unproved), self.number
        self.number += 1
        self.lost = not self.growing and self._hopeless(many)

    def _hopeless(self, many: bool) -> bool:
        """Return whether further rounds would not part a boundary that meets itself, or not unfold F at the surface.

        many: whether more than `most_watched` spans are unproved.
        """
        config = self.energy.config
        if self.certified:
            return self.best.meets_itself and self.parting == config.parting
        if self.number > self.halved + config.stalling:
            return True
        return self.number >= config.firm_rounds and (many or self._distance(self.control) > config.far**2)

    def _distance(self, control: Tensor) -> float:
        """Return the mean squared distance of a map from the surface at the parameters as they are."""
        return float(np.square(self.energy.surface.residuals(control)).sum(axis=1).mean())

    def _smoothed(self, found: Optimized) -> Optimized:
        """Smooth the map near spans that the last rounds have not unfolded; return it where fewer are unproved then."""
        unproved, config = found.certificate.unproved, self.energy.config
        stalled = not self.growing and self.number >= max(config.firm_rounds, self.halved + config.smoothing_rounds)
        if not stalled or not 0 < len(unproved) <= config.most_smoothed:
            return found
        smoothed = Optimized.of(self.energy.smoothed(found.control, unproved), self.knots, config)
        _log.info("smoothed near %d spans: %d unproved", len(unproved), len(smoothed.certificate.unproved))
        return smoothed if smoothed.faults < found.faults else found

    def _mended(self, found: Optimized) -> Optimized:
        """Move what folds again back to where it was certified; return the map found where that brings nothing."""
        config, held = self.energy.config, np.zeros(self.energy.barrier.weights.shape, dtype=bool)
        mended = found
        for _ in range(config.mendings):
            unproved = mended.certificate.unproved
            if not 0 < len(unproved) <= config.most_watched:
                break
            held |= with_neighbours(unproved, held.shape)
            back = torch.from_numpy(acting_on(held, config.degree))
            mended = Optimized.of(torch.where(back, self.best.control, found.control), self.knots, config)
        if mended is found or mended.rank > self.best.rank:
            return found
        places = self.energy.surface.places
        before = places.parameters, places.cube_faces
        self.energy.slide(mended.control)
        if self._distance(mended.control) >= self.off:
            places.place(*before)
            return found
        self.energy.barrier.activate(found.certificate.unproved)
        self.energy.give_way(found.certificate.unproved, config.giving_way)
        _log.info("moved back near %d spans", len(found.certificate.unproved))
        return mended

    def save(self, checkpoints: Checkpoints, history: History) -> None:
        """Keep a checkpoint of the rounds, the sliding parameters, the weights and the spans that are watched."""
        surface, anchors = self.energy.surface, self.energy.anchors.fit
        tensors = {
            "control": self.control,
            "best": self.best.control,
            "best_parameters": torch.as_tensor(self.best_places[0]),
            "best_cube_faces": torch.as_tensor(self.best_places[1]),
            "parameters": torch.as_tensor(surface.places.parameters),
            "cube_faces": torch.as_tensor(surface.places.cube_faces),
            "yielding": torch.as_tensor(surface.yielding),
            "anchors": torch.as_tensor(anchors.points),
            "anchors_yielding": torch.as_tensor(anchors.yielding),
            "span_weights": torch.as_tensor(self.energy.barrier.weights),
        }
        counts = {name: getattr(self, name) for name in _COUNTS}
        state = counts | {"certified": self.certified, "lost": self.lost, "off": self.off, "history": history.rows}
        checkpoints.save(_CHECKPOINT, tensors, state)

    def restore(self, tensors: dict[str, Tensor], state: dict[str, Any], history: History) -> None:
        """Continue from a checkpoint that `save` has kept."""
        energy = self.energy
        energy.surface.places.place(tensors["parameters"].numpy(), tensors["cube_faces"].numpy())
        energy.surface.give_way(tensors["yielding"].numpy())
        energy.anchors.restore(tensors["anchors"].numpy(), tensors["anchors_yielding"].numpy())
        energy.barrier.weigh(tensors["span_weights"].numpy())
        self.control = tensors["control"]
        self.best = Optimized.of(tensors["best"], self.knots, energy.config)
        self.best_places = tensors["best_parameters"].numpy(), tensors["best_cube_faces"].numpy()
        for name in _COUNTS:
            setattr(self, name, int(state[name]))
        self.certified, self.lost, self.off = bool(state["certified"]), bool(state["lost"]), float(state["off"])
        history.rows[:] = [tuple(row) for row in state["history"]]


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


def _line_search(point: _Point, direction: Tensor, energy: SplineEnergy) -> tuple[_Point, float] | None:
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


def _descend(rounds: _Rounds, history: History, progress: ProgressCallback) -> Tensor:
    """Return the control points after one round of Newton steps with sliding boundary parameters."""
    energy, number = rounds.energy, rounds.number
    config, steps = energy.config, energy.config.steps
    most = config.growth.steps if config.growth and rounds.growing else steps
    energy.watch_facing(rounds.control)
    point = _evaluate(rounds.control, energy)
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
