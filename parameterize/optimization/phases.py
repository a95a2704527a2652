"""Defines the phases of a spline stage: a phase sets weights for its rounds, amends their maps, and decides its end.

F takes its shape or grows, and is then unfolded until it is certified; its boundary is pushed apart where it meets
itself; the last phase restores the weight that the surface's data have lost. Rounds are counted over the whole stage,
from 0.
"""

import logging
import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .endings import CertifiedMap, Reason
from .newton import GAIN
from .reassignment import reassign
from .spans import acting_on, with_neighbours
from .state import MOST_WATCHED, State

_log = logging.getLogger(__name__)

FULL_PENALTY = 2500.0  # weight on det J once F has its shape: folds open even against the surface's data
RAMP = (20.0, 100.0, 500.0, FULL_PENALTY)  # one a round, for a map that starts folded: it takes its shape through folds
PATIENT_ROUNDS = 2  # of a stage: after them the penalty grows at unproved spans
FIRM_ROUNDS = 4  # after these the surface gives way at unproved spans, which more weight alone has not unfolded
RELAXING = 0.25  # factor of the surface's weights there, each round: an edge in a valley cannot lie on the surface
_CONTACT_WAY = 0.0625  # the same where the boundary meets itself: these rounds are few
_STALLING = 8  # rounds in which the unproved spans are not halved: another start costs as much as waiting longer
_SMOOTHING_ROUNDS = 2  # the same; F is then smoothed there, as no descent undoes some folds
# Spans that stay unproved: smoothing F near more would take its shape away. It helps one of 19 surfaces: without it the
# network's map of a spiky one stalls, and a growth with 1.18 times the distortion takes its place.
_MOST_SMOOTHED = 10
_MENDINGS = 6  # attempts to restore certified control points around spans that fold again


@dataclass(frozen=True)
class Phase(ABC):
    """Define rounds with one aim.

    penalties: the weights of the penalties on det J, one for each round of the stage; later rounds have the last
    weight. patience: the number of rounds of the stage after which the surface's data relax at unproved spans. shares:
    where F grows, the shares of the weight of the surface's data, one for each round of the stage. steps: the largest
    number of Newton steps in a round; None for the number in the options. by_faces: whether the faces of F are drawn to
    the surface, and not the points of the surface draw F.
    """

    name: ClassVar[str]
    by_faces: ClassVar[bool] = False
    penalties: tuple[float, ...] = (FULL_PENALTY,)
    patience: int = FIRM_ROUNDS
    shares: tuple[float, ...] = ()
    steps: int | None = None

    def penalty(self, number: int) -> float:
        """Return the weight of the penalties on det J in a round."""
        return self.penalties[min(number, len(self.penalties) - 1)]

    def begin(self, state: State) -> None:
        """Set the weights of the data and of the anchors for the next round: those of several blocks always act."""
        if state.energy.nets.is_single:
            state.energy.anchors.release()
        else:
            state.energy.anchors.aim(state.spline.control)

    def amended(self, state: State, found: CertifiedMap) -> CertifiedMap:
        """Return the map that a round has found, or a better map made from it."""
        return found

    @abstractmethod
    def done(self, state: State) -> Reason | None:
        """Return the reason for which the phase ends; None where it continues."""


@dataclass(frozen=True)
class Shape(Phase):
    """Let F take its shape."""

    name = "shape"

    def done(self, state: State) -> Reason | None:
        """Return a reason to end after the patient rounds, or with a certified map; None before."""
        if state.certified:
            return Reason.CERTIFIED
        return Reason.SHAPED if state.number >= PATIENT_ROUNDS else None


@dataclass(frozen=True)
class Unfold(Phase):
    """Raise the penalty on unproved spans, let the surface's data give way near these, and smooth a few spans.

    far: a root mean square distance from the surface; a folded map that is farther away is given up in patience rounds.
    far_first: the same distance after `first` rounds of the stage, the first round in which F no longer grows.
    """

    name = "unfold"
    far: float = 0.02
    far_first: float = 0.02
    first: int = 0

    def amended(self, state: State, found: CertifiedMap) -> CertifiedMap:
        """Smooth the map near spans that stay unproved; return the smoothed map where it has fewer unproved spans."""
        unproved, patience = found.unproved, max(self.patience, state.halved + _SMOOTHING_ROUNDS)
        if state.number < patience or not 0 < len(unproved) <= _MOST_SMOOTHED:
            return found
        control = state.energy.smoothed(found.spline.control, unproved)
        smoothed = CertifiedMap.of(found.spline.with_control(control))
        _log.info("smoothed near %d spans: %d unproved", len(unproved), len(smoothed.unproved))
        return smoothed if smoothed.faults < found.faults else found

    def done(self, state: State) -> Reason | None:
        """Return a reason to end with a certified map, or where more rounds would not unfold F; None before."""
        if state.certified:
            return Reason.CERTIFIED
        if state.number > state.halved + _STALLING:
            return Reason.STALLED
        if state.number < self.patience:
            return None
        if state.many:
            return Reason.TOO_MANY_FOLDED
        far = self.far_first if state.number == self.first else self.far
        return Reason.TOO_FAR if state.last_square > far**2 else None


@dataclass(frozen=True)
class Separate(Phase):
    """Push apart the boundary of a certified map that meets itself; the surface's data give way there.

    Where two rods leave a junction at a small angle, their common edge tends to stay behind inside of the solid, and
    the sheets beside it overlap: anchors draw the edge out, and the surface's points leave their places on the sheets.

    far: a root mean square distance from the surface, beyond which the phase gives up.
    """

    name = "separate"
    rounds: int = 6
    far: float = 0.01

    def begin(self, state: State) -> None:
        """Let the surface's data give way where sheets of the boundary touch.

        Several blocks are drawn out by their anchors, and before the first round all places are found anew.
        """
        energy, control = state.energy, state.spline.control
        energy.relax(energy.watch_contact(control), _CONTACT_WAY)
        super().begin(state)
        if not energy.nets.is_single and not state.rounds[self.name]:
            reassign(energy.surface, control, first=True)

    def done(self, state: State) -> Reason | None:
        """Return a reason to end when the boundary no longer meets itself, or cannot be parted near the surface."""
        if not state.best.meets_itself:
            return Reason.APART
        if state.rounds[self.name] == self.rounds:
            return Reason.MEETS_ITSELF
        return Reason.DRIFTED_AWAY if state.last_square > self.far**2 else None


@dataclass(frozen=True)
class Polish(Phase):
    """Restore the weight that the surface's data have lost, step by step, as far as F stays certified."""

    name = "polish"
    patience: int = sys.maxsize
    rounds: int = 6

    def begin(self, state: State) -> None:
        """Give the data more weight, unless the last round has folded F again; draw F's edges to the surface."""
        energy = state.energy
        if state.rounds["separate"]:
            energy.watch_contact(state.spline.control)
        if state.settled:
            energy.take_back(RELAXING)
        energy.anchors.aim(state.spline.control)

    def amended(self, state: State, found: CertifiedMap) -> CertifiedMap:
        """Move the spans that fold again back to their certified shape; return the given map where that fails."""
        energy, folded, mended = state.energy, found.unproved, found
        held = np.zeros(len(energy.determinants.weights), dtype=bool)
        for _ in range(_MENDINGS):
            unproved = mended.unproved
            if not 0 < len(unproved) <= MOST_WATCHED:
                break
            held |= with_neighbours(unproved, energy.nets)
            back = acting_on(held, energy.nets)
            control = np.where(back, state.best.spline.control, found.spline.control)
            mended = CertifiedMap.of(found.spline.with_control(control))
        if mended is found or mended.rank > state.best.rank:
            return found
        before = energy.surface.sliding.on_faces
        energy.slide(mended.spline.control)
        if energy.surface.mean_square(mended.spline.control) >= state.best_square:
            energy.surface.sliding.place(*before)
            return found
        energy.determinants.activate(folded)
        energy.relax(folded, RELAXING)
        _log.info("moved back near %d spans", len(folded))
        return mended

    def done(self, state: State) -> Reason | None:
        """Return a reason to end: all weight is restored, F folds more and more, or the rounds are used up."""
        if not (count := state.rounds[self.name]):
            return None
        if state.settled and not state.energy.yields:
            return Reason.POLISHED
        if state.many or 0 < state.unproved_before < state.unproved:
            return Reason.FOLDS_AGAIN
        return Reason.LESS_POLISHED if count == self.rounds else None


@dataclass(frozen=True)
class Schedule:
    """Hold the phases of a spline stage in their order, and the limits that they share.

    rounds: the largest number of rounds in the stage. gain: a share of the energy; a round ends where its steps lower
    the energy by less.
    """

    phases: tuple[Phase, ...]
    rounds: int
    gain: float = GAIN

    @property
    def grown(self) -> int:
        """Return the number of rounds in which F grows."""
        return max(len(phase.shares) for phase in self.phases)
