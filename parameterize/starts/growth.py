"""A start that does not need the network: the cube grows into the solid (for shapes that are hard to train).

The surface is laid on the cube one-to-one before anything else, so that the boundary never has to be untangled. The
first map is a cube in the solid's middle. Round after round the surface's data draw it more strongly, while the
penalties on det J act from the start: what is never folded need not be unfolded (compare Schueller, Kavan, Panozzo,
Sorkine-Hornung, SGP 2013).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..arrays import Knots
from ..checkpoint import Checkpoints
from ..config import Config, scaled_steps
from ..cube.layout import CubeLayout
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
from .on_cube import MORE_ROUNDS, USUAL_STEPS, surface_on_cube
from .start import Attempt, Start, Task, optimized

# Of the weight of the surface's data, round by round: two a decade, so that F follows without a fold.
SHARES = (1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
STEPS = 12  # of Newton's method in each of these rounds, at most: the next one moves F on anyway
_COARSE = 1 / 3  # of the spans a direction in these rounds: F is smooth while it grows


@dataclass(frozen=True)
class Grow(Phase):
    """F grows from a cube: the surface's data draw it with a larger share of their weight in each round."""

    name = "grow"

    def done(self, state: State) -> Reason | None:
        """End when all shares have been taken."""
        return Reason.GROWN if state.number >= len(self.shares) else None


@dataclass(frozen=True)
class Growth(Start):
    """A cube grows.

    turn: of the cube: 0 is the best found, 1 the next, and so on. far: distance from the surface, root mean square,
    with which F is given up once all data draw it, and beyond which a stiffer growth is tried beside this one. firm:
    rounds after which the surface's data give way at unproved spans. stiffness: factor of the fairness. least_floor:
    share to which the floors of det J are lowered, at most, in parts that are far thinner than the rest.
    """

    turn: int = 0
    far: float = 0.005
    firm: int = 6
    stiffness: float = 1.0
    least_floor: float = 1.0

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt:
        """Lay the surface on the cube and let F grow towards it."""
        with timed(task.seconds, "fit"), one_blas_thread():
            layout = surface_on_cube(task, self.turn)
            fit = task.fit(layout, _COARSE)
            first = first_cube(layout, fit.places.knots, fit.places.degree)
        return optimized(first, fit, self.schedule(task.config), task, checkpoints, self.weights)

    @property
    def weights(self) -> Weights:
        """The weights that this growth keeps to the end."""
        return Weights(self.stiffness * Weights.fairness, least_floor=self.least_floor)

    def schedule(self, config: Config) -> Schedule:
        """Return the rounds: those in which F grows come first, with the full penalty on det J."""
        grown, steps = len(SHARES), scaled_steps(STEPS, config.steps_factor)
        phases = (
            Grow(firm=self.firm, shares=SHARES, steps=steps),
            Unfold(firm=self.firm, far=max(Unfold.far, self.far), far_first=self.far, first=grown + 1),
            Separate(firm=self.firm, far=max(Separate.far, self.far)),
            Polish(),
        )
        return Schedule(phases, grown + config.spline.rounds + MORE_ROUNDS, (steps,) * grown + USUAL_STEPS)


GROWTH = Growth("growth", "growth", "growing a map from a cube")
# Where the first growth fails: far thinner parts keep their small det J, and what is squeezed does not buckle.
STIFF = Growth(
    "stiff growth", "growth", "growing a stiffer map", turn=1, far=0.01, firm=12, stiffness=10.0, least_floor=0.05
)
# Where all else fails: a certified map that is far from the surface is worth more than none.
LAST = replace(STIFF, name="last growth", doing="growing a stiffer map, farther from the surface,", turn=2, far=0.05)


def first_cube(layout: CubeLayout, knots: Knots, degree: int) -> SplineMap:
    """Return the map onto the unit cube, turned so that it faces the surface as laid out."""
    weights = vertex_weights(layout.points, layout.faces, layout.n_own)
    rotation, _ = Rotation.align_vectors(layout.points - 0.5, layout.places - 0.5, weights)
    points = np.stack(np.meshgrid(*(greville(row, degree) for row in knots), indexing="ij"), axis=-1) - 0.5
    return SplineMap.of(BSplineVolume((degree,) * 3, knots, 0.5 + points @ rotation.as_matrix().T))
