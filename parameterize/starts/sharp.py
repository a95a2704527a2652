"""Starts from a layout of the surface on the cube whose edges follow sharp edges, extended into the solid.

F is smooth but on the cube's edges. A trained or grown map has these where distortion is least, often across planes,
and rounds the sharp edges; here points of sharp edges lie on the cube's edges from the start, and stay there.
"""

import logging
from dataclasses import dataclass, replace

from ..arrays import IntArray
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..cube.constrained import OFF_RIDGES, Constrained, choose_sharp_corners, constrained
from ..cube.cube import snap
from ..cube.cube_layout import CubeLayout
from ..cube.edge_paths import PathError, lay_out
from ..extension import extended
from ..optimization.phases import Polish, Schedule, Separate, Shape, Unfold
from ..progress import timed
from ..surface.ridges import Ridges
from ..threads import one_blas_thread
from .first_spline import COARSE, first_spline
from .on_cube import MORE_ROUNDS, surface_on_cube
from .start import ALL, Attempt, Start, Task, optimized

_log = logging.getLogger(__name__)

_CELL = 0.0255  # of the lattice inside, in a domain of volume 1: some 60 000 points, more than F has control points
_TURNS = 3  # of the cube that are tried, until twelve paths are found: corners on sharp edges hardly depend on it


@dataclass(frozen=True)
class Sharp(Start):
    """Make a map by a harmonic extension of a layout whose cube has its edges on sharp edges of the surface."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt | None:
        """Lay the surface on the cube along its sharp edges, and fit F to that layout, extended into the solid.

        None is returned where the cube's edges find no paths, or do not carry all sharp edges.
        """
        with timed(task.seconds, "fit"), one_blas_thread():
            found = _along_ridges(task)
            if found is None:
                return None
            layout, kept = found
            fit = task.fit(layout, COARSE, kept)
            first = first_spline(*extended(layout, _CELL), fit)
        return optimized(first, fit, schedule(task.config.spline), task, checkpoints)


def schedule(spline: SplineConfig) -> Schedule:
    """Return the phases of the rounds: the first map is close to the last, so folds have a large penalty at once."""
    return Schedule((Shape(), Unfold(), Separate(), Polish()), spline.rounds + MORE_ROUNDS)


SHARP = Sharp("sharp edges", "extension", "laying the cube's edges along sharp edges")


def _along_ridges(task: Task) -> tuple[CubeLayout, Constrained] | None:
    """Return the layout whose cube carries all sharp edges, and the points that stay on these; None where none does."""
    ridges = task.ridges
    assert ridges is not None  # else this start is not among those of the body
    for turn in range(_TURNS):
        layout = surface_on_cube(task, turn)
        found = [_laid_out(layout, corners, ridges) for corners in _corners(layout, ridges, task.given_corners)]
        if laid := [one for one in found if one is not None]:
            best = max(laid, key=lambda one: one[1].length)
            share = best[1].length / ridges.total
            _log.info("turn %d of the cube: its edges carry %.0f %% of the sharp edges", turn, 100.0 * share)
            return best if share >= ALL else None
    return None


def _corners(layout: CubeLayout, ridges: Ridges, given: IntArray | None) -> list[IntArray]:
    """Return choices of corners (8,): those that the user gives; else others, too, where one is off all ridges."""
    if given is not None:
        return [given]
    usual, farther = (choose_sharp_corners(layout, ridges, off) for off in OFF_RIDGES)
    return [usual] if ridges.hold(layout.points[usual]).all() else [usual, farther]


def _laid_out(layout: CubeLayout, corners: IntArray, ridges: Ridges) -> tuple[CubeLayout, Constrained] | None:
    """Return the layout with these corners (8,), and what the cube's edges carry; None where they find no paths."""
    try:
        laid = lay_out(layout, corners, ridges)
    except PathError as error:
        _log.info("%s", error)
        return None
    laid = replace(laid, places=snap(laid.places))
    return laid, constrained(laid, ridges)
