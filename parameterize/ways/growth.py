"""The way by a cube that grows into the solid, without the network (for shapes that are hard to train).

The surface is laid on the cube one-to-one before anything else, so that the boundary never has to be untangled. The
first map is a cube in the middle of the solid. In each round the surface's data draw the map more strongly, while the
penalties on det J act from the start, so that folds are avoided and need not be removed (compare Schueller, Kavan,
Panozzo, Sorkine-Hornung, SGP 2013).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..arrays import Knots
from ..checkpoint import Checkpoints
from ..config import Config, scaled_steps
from ..cube.cube import CubeLayout
from ..optimization.endings import Reason
from ..optimization.phases import Phase, Polish, Schedule, Separate, Unfold
from ..optimization.state import State
from ..optimization.term import Weights
from ..progress import timed
from ..spline.bspline import greville
from ..spline.spline_map import SplineMap
from ..spline.volume import BSplineVolume
from ..surface.geometry import vertex_weights
from ..threads import one_blas_thread
from .cost import Cost
from .mapping_task import MappingTask
from .one_cube import MORE_ROUNDS, OneCube, correspondence, surface_on_cube
from .tried import Tried
from .way import Attempt, optimized

# Of the weight of the surface's data, round by round: two a decade, so that F follows without a fold.
SHARES = (1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
STEPS = 12  # of Newton's method in each of these rounds, at most: the next one moves F on anyway
_COARSE = 1 / 3  # of the spans a direction in these rounds: F is smooth while it grows


@dataclass(frozen=True)
class Grow(Phase):
    """Let F grow from its start: in each round the surface's data have a larger share of their weight."""

    name = "grow"

    def done(self, state: State) -> Reason | None:
        """Return Reason.GROWN once all shares have been used, and None before."""
        return Reason.GROWN if state.number >= len(self.shares) else None


@dataclass(frozen=True)
class Growth(OneCube):
    """Make a map by a cube that grows into the solid.

    turn: the turn of the cube; 0 is the best turn found, 1 the next best, and so on. far: a root mean square distance
    from the surface; a map farther away is given up once all data draw it, and a stiffer growth is tried beside this
    one. patience: the number of rounds after which the surface's data relax at unproved spans. stiffness: the factor of
    the fairness weight. least_floor: the smallest share to which the floors of det J are lowered in parts that are far
    thinner than the rest. beside: the name of a growth that this one follows, too, if that one ends farther away than
    its `far`, certified or not.
    """

    origin = "growth"
    comes_from = "a growing cube", "the surface laid on its faces without the network"
    counted = True
    turn: int = 0
    far: float = 0.005
    patience: int = 6
    stiffness: float = 1.0
    least_floor: float = 1.0
    beside: str = ""

    def follows(self, tried: Sequence[Tried]) -> bool:
        """Return whether no map is good enough, or the growth that this one is beside ends too far away."""
        return super().follows(tried) or any(
            one.way.name == self.beside and one.attempt is not None and one.attempt.distance > GROWTH.far
            for one in tried
        )

    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt:
        """Lay the surface on the cube, let F grow towards it, and return the attempt."""
        with timed(task.seconds, "fit"), one_blas_thread():
            layout = surface_on_cube(task, self.turn)
            fit = correspondence(task, layout, _COARSE)
            first = first_cube(layout, fit.sliding.knots, fit.sliding.nets.degree)
        return optimized(first, fit, self.schedule(task.config), task, checkpoints, self.weights)

    def cost(self, task: MappingTask) -> Cost:
        """Return the cost of the rounds."""
        return Cost.of_cube(task.config, task.own)

    @property
    def weights(self) -> Weights:
        """Return the weights of the energy that this growth keeps until its last round."""
        return Weights(self.stiffness * Weights.fairness, least_floor=self.least_floor)

    def schedule(self, config: Config) -> Schedule:
        """Return the phases of the rounds: F grows in the first phase, under the full penalty on det J."""
        grown, steps = len(SHARES), scaled_steps(STEPS, config.steps_factor)
        phases = (
            Grow(patience=self.patience, shares=SHARES, steps=steps),
            Unfold(patience=self.patience, far=max(Unfold.far, self.far), far_first=self.far, first=grown + 1),
            Separate(patience=self.patience, far=max(Separate.far, self.far)),
            Polish(),
        )
        return Schedule(phases, grown + config.spline.rounds + MORE_ROUNDS)


GROWTH = Growth("growth", "growing a map from a cube")
# Where the first growth fails: far thinner parts keep their small det J, and squeezed parts do not buckle.
# Of 59 hard surfaces 15 needed this growth and one the last; a fit to an extended layout between served none.
STIFF = Growth(
    "stiff growth",
    "growing a stiffer map",
    turn=1,
    far=0.01,
    patience=12,
    stiffness=10.0,
    least_floor=0.05,
    beside="growth",
)
# Where all else fails: a certified map that is far from the surface is worth more than none.
LAST = replace(
    STIFF, name="last growth", doing="growing a stiffer map, farther from the surface,", turn=2, far=0.05, beside=""
)


def first_cube(layout: CubeLayout, knots: Knots, degree: int) -> SplineMap:
    """Return the map onto the unit cube, turned so that its faces look towards their parts of the surface."""
    weights = vertex_weights(layout.points, layout.faces, layout.n_own)
    rotation, _ = Rotation.align_vectors(layout.points - 0.5, layout.places - 0.5, weights)
    points = np.stack(np.meshgrid(*(greville(row, degree) for row in knots), indexing="ij"), axis=-1) - 0.5
    return SplineMap.of(BSplineVolume((degree,) * 3, knots, 0.5 + points @ rotation.as_matrix().T))
