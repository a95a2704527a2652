"""Holds the state of a spline stage between two rounds, and its checkpoint."""

import math
import sys
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array, IntArray
from ..checkpoint import Checkpoints
from ..progress import History
from ..spline.spline_map import SplineMap
from .endings import CertifiedMap
from .energy import SplineEnergy

MOST_WATCHED = 1000  # spans: where more are unproved, the penalty at the Gauss points unfolds most first
_CHECKPOINT = "spline"
_NUMBERS = ("number", "certified", "unproved", "unproved_before", "fewest", "halved", "last_square", "best_square")


@dataclass
class State:
    """Hold the state of a stage between two rounds; squares are mean squared distances from the surface."""

    energy: SplineEnergy
    spline: SplineMap
    best: CertifiedMap
    best_parameters: tuple[Array, IntArray]  # the surface's parameters (N, 3) that belong to it, and their faces (N,)
    number: int  # of rounds done, those on other knots among them
    halved: int  # the round in which the number of unproved spans was last halved
    certified: bool = False  # whether a round on these knots, one in which F does not grow, has certified the map
    unproved: int = 0  # the number of unproved spans after the last round
    unproved_before: int = 0  # the number after the round before
    fewest: int = sys.maxsize  # their number when it was last halved
    last_square: float = 0.0  # of the map that the last round's steps gave: smoothing leads away for a while
    best_square: float = math.inf
    rounds: Counter[str] = field(default_factory=Counter)  # done on these knots, by phase
    seconds: dict[str, float] = field(default_factory=dict)  # of these

    @property
    def many(self) -> bool:
        """Return whether there are more unproved spans than can be watched."""
        return self.unproved > MOST_WATCHED

    @property
    def settled(self) -> bool:
        """Return whether the last round has ended with the best map, and not with a map that folds again."""
        return np.array_equal(self.spline.control, self.best.spline.control)

    def keep(self, found: CertifiedMap) -> None:
        """Set a map, with the present parameters of the surface, as the best map."""
        self.best, self.best_parameters = found, self.energy.surface.sliding.on_faces
        self.best_square = self.energy.surface.mean_square(found.spline.control)

    def save(self, checkpoints: Checkpoints, history: History) -> None:
        """Keep a checkpoint of the rounds, the sliding parameters, the weights and the spans that are watched."""
        surface, anchors = self.energy.surface, self.energy.anchors
        arrays = {
            "control": self.spline.control,
            "best": self.best.spline.control,
            "best_parameters": self.best_parameters[0],
            "best_cube_faces": self.best_parameters[1],
            "parameters": surface.sliding.parameters,
            "cube_faces": surface.sliding.cube_faces,
            "relaxation": surface.relaxation,
            "anchors": anchors.points,
            "anchors_yielding": anchors.relaxation,
            "span_weights": self.energy.determinants.weights,
        }
        numbers = {name: getattr(self, name) for name in _NUMBERS}
        phases = {"rounds": self.rounds, "seconds": self.seconds}
        checkpoints.save(_CHECKPOINT, arrays, numbers | phases | {"history": history.rows})

    def restore(self, checkpoints: Checkpoints, history: History) -> None:
        """Continue from the checkpoint that `save` has written, where there is one."""
        if (saved := checkpoints.load(_CHECKPOINT)) is None:
            return
        arrays, state = saved
        energy = self.energy
        energy.surface.sliding.place(arrays["parameters"], arrays["cube_faces"])
        energy.surface.relax(arrays["relaxation"])
        energy.anchors.restore(arrays["anchors"], arrays["anchors_yielding"])
        energy.determinants.weigh(arrays["span_weights"])
        self.spline = self.spline.with_control(arrays["control"])
        self.best = CertifiedMap.of(self.spline.with_control(arrays["best"]))
        self.best_parameters = arrays["best_parameters"], arrays["best_cube_faces"]
        for name in _NUMBERS:
            setattr(self, name, state[name])
        self.rounds, self.seconds = Counter(state["rounds"]), state["seconds"]
        history.rows[:] = [tuple(row) for row in state["history"]]
