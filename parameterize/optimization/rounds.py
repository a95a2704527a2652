"""Control-point optimisation: distortion, smoothness, boundary and injectivity of F together (section 4.3.2, step 3).

The energy of energy.py is lowered in rounds (newton.py). After each the map is certified; what folds is weighed anew.
"""

import logging
import math
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, IntArray, Knots
from ..certificate.boundary import check_boundary
from ..certificate.jacobian import Certificate, certify
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..progress import History, ProgressCallback, ignore
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume
from ..threads import one_blas_thread
from .determinant_penalty import acting_on, edge_spans, with_neighbours
from .energy import SplineEnergy
from .newton import descend
from .surface_distance import SurfaceFit

_log = logging.getLogger(__name__)
_CHECKPOINT = "spline"
_COUNTS = ("number", "parting", "polished", "unproved", "fewest", "halved")  # of rounds and spans, in a checkpoint


@dataclass(frozen=True, eq=False)
class Optimized:
    """Control points (3, n_u, n_v, n_w) at volume 1, and what is proved of them.

    injective: True where the boundary is proved not to meet itself, False where it was found to, None where that is not
    decided; it is asked of certified maps alone.
    """

    control: Array
    certificate: Certificate
    injective: bool | None

    @classmethod
    def of(cls, control: Array, knots: Knots, config: SplineConfig) -> "Optimized":
        """Certify control points and, where that succeeds, check their boundary."""
        volume = BSplineVolume((config.degree,) * 3, knots, np.moveaxis(control, 0, -1))
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
    control: Array,
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
    than `far` from the surface, root mean square: that of growth after the first round in which F no longer grows.

    Where the boundary of a certified map meets itself, up to `parting` rounds push it apart, and the surface data there
    lose weight; where it still does then, the rounds end. Once the map is certified, a few more rounds take back what
    the data has lost, step by step, as far as they can. What these rounds fold again is moved back; where it cannot be
    and the next round does not unfold it but folds more, the rounds end. Anchors along the
    cube's edges draw F to the surface in those last rounds and, where it is close to begin with, in the first ones: not
    while what is folded comes apart. The result is the last certified map whose boundary is proved not to meet itself,
    else the last one where that is not decided, else the last certified one, else the one with the fewest unproved
    spans.

    begun: of how many rounds `control` is the result, on other knots; watched (k, 3): spans that nearly fold there.
    A checkpoint is kept after every round. The surface's parameters are left as they belong to the result.
    """
    checkpoints = checkpoints or Checkpoints(None, {}, resume=False)
    with one_blas_thread():
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
            lowered = descend(
                energy, rounds.control, rounds.number, growing=rounds.growing, history=history, progress=progress
            )
            rounds.conclude(lowered)
            rounds.save(checkpoints, history)
        surface.places.place(*rounds.best_places)
    return rounds.best


@dataclass
class _Rounds:
    """Where the optimisation stands between two rounds; number, parting and polished count those done."""

    energy: SplineEnergy
    knots: Knots
    control: Array
    best: Optimized
    best_places: tuple[Array, IntArray]  # the surface's parameters (N, 3) that belong to it, and their cube faces (N,)
    near: bool  # whether F was close to the surface all along the cube's edges to begin with
    number: int = 0
    certified: bool = False  # whether a round on these knots has ended with a certified map
    parting: int = 0  # rounds in which the boundary of a certified map that meets itself is pushed apart
    polished: int = 0  # rounds after that, or after the map was certified for the first time
    unproved: int = 0  # spans that the last round has left so
    fewest: int = sys.maxsize  # spans unproved when their number was last halved
    halved: int = 0  # the round in which that was
    off: float = math.inf  # mean squared distance of the best map from the surface
    lost: bool = False  # whether further rounds would bring no better map

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
        return np.array_equal(self.control, self.best.control)

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

    def conclude(self, control: Array) -> None:
        """Certify what the round has found; watch the spans not proved and let the surface give way near them."""
        config = self.energy.config
        found, distance = Optimized.of(control, self.knots, config), self.energy.surface.mean_square(control)
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
            self.off = self.energy.surface.mean_square(found.control)
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
        worse = self.polished > 0 and (many or 0 < self.unproved < len(unproved))
        self.unproved = len(unproved)
        self.lost = not self.growing and (worse or self._hopeless(many, distance))

    def _hopeless(self, many: bool, distance: float) -> bool:
        """Return whether further rounds would not part a boundary that meets itself, or not unfold F at the surface.

        many: whether more than `most_watched` spans are unproved. distance: mean squared, of what the steps have led
        to; where F is smoothed after them, it is farther for a while.
        """
        config = self.energy.config
        if self.certified:
            return self.best.meets_itself and (self.parting == config.parting or distance > config.parted**2)
        if self.number > self.halved + config.stalling:
            return True
        just_grown = self.number == len(self.shares) + 1
        far = config.growth.far if config.growth and just_grown else config.far
        return self.number >= config.firm_rounds and (many or distance > far**2)

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
            back = acting_on(held, config.degree)
            mended = Optimized.of(np.where(back, self.best.control, found.control), self.knots, config)
        if mended is found or mended.rank > self.best.rank:
            return found
        places = self.energy.surface.places
        before = places.parameters, places.cube_faces
        self.energy.slide(mended.control)
        if self.energy.surface.mean_square(mended.control) >= self.off:
            places.place(*before)
            return found
        self.energy.barrier.activate(found.certificate.unproved)
        self.energy.give_way(found.certificate.unproved, config.giving_way)
        _log.info("moved back near %d spans", len(found.certificate.unproved))
        return mended

    def save(self, checkpoints: Checkpoints, history: History) -> None:
        """Keep a checkpoint of the rounds, the sliding parameters, the weights and the spans that are watched."""
        surface, anchors = self.energy.surface, self.energy.anchors.fit
        arrays = {
            "control": self.control,
            "best": self.best.control,
            "best_parameters": self.best_places[0],
            "best_cube_faces": self.best_places[1],
            "parameters": surface.places.parameters,
            "cube_faces": surface.places.cube_faces,
            "yielding": surface.yielding,
            "anchors": anchors.points,
            "anchors_yielding": anchors.yielding,
            "span_weights": self.energy.barrier.weights,
        }
        counts = {name: getattr(self, name) for name in _COUNTS}
        state = counts | {"certified": self.certified, "lost": self.lost, "off": self.off, "history": history.rows}
        checkpoints.save(_CHECKPOINT, arrays, state)

    def restore(self, arrays: dict[str, NDArray[Any]], state: dict[str, Any], history: History) -> None:
        """Continue from a checkpoint that `save` has kept."""
        energy = self.energy
        energy.surface.places.place(arrays["parameters"], arrays["cube_faces"])
        energy.surface.give_way(arrays["yielding"])
        energy.anchors.restore(arrays["anchors"], arrays["anchors_yielding"])
        energy.barrier.weigh(arrays["span_weights"])
        self.control = arrays["control"]
        self.best = Optimized.of(arrays["best"], self.knots, energy.config)
        self.best_places = arrays["best_parameters"], arrays["best_cube_faces"]
        for name in _COUNTS:
            setattr(self, name, int(state[name]))
        self.certified, self.lost, self.off = bool(state["certified"]), bool(state["lost"]), float(state["off"])
        history.rows[:] = [tuple(row) for row in state["history"]]
