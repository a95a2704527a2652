"""Starts from the surface's layout on the cube, without the network: F is fitted to the layout's extension inside."""

from dataclasses import dataclass

from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..extension import extended
from ..optimization.phases import Polish, Schedule, Separate, Shape, Unfold
from ..progress import timed
from ..threads import one_blas_thread
from .first_spline import COARSE, first_spline
from .on_cube import MORE_ROUNDS, USUAL_STEPS, surface_on_cube
from .start import Attempt, Start, Task, optimized

CELL = 0.0255  # of the lattice, in a domain of volume 1: some 60 000 points, more than F has control points


@dataclass(frozen=True)
class Extension(Start):
    """Make a map by a harmonic extension of the surface's layout on the cube."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt:
        """Lay the surface on the cube and fit F to that layout, extended into the solid."""
        spline = task.config.spline
        with timed(task.seconds, "fit"), one_blas_thread():
            layout = surface_on_cube(task, turn=0)
            fit = task.fit(layout, COARSE)
            first = first_spline(*extended(layout, CELL), fit)
        return optimized(first, fit, schedule(spline), task, checkpoints)


EXTENSION = Extension("extension", "extension", "extending the surface's layout into the solid")


def schedule(spline: SplineConfig) -> Schedule:
    """Return the phases of the rounds: the first map is close to the last, so folds have a large penalty at once."""
    return Schedule((Shape(), Unfold(), Separate(), Polish()), spline.rounds + MORE_ROUNDS, USUAL_STEPS)
