"""Starts from a layout of the surface on the cube whose edges follow sharp edges, extended into the solid.

F is smooth but on the cube's edges. A trained or grown map has these where distortion is least, often across planes,
and rounds the sharp edges; here points of sharp edges lie on the cube's edges from the start, and stay there.
"""

import logging
from dataclasses import dataclass, replace

from ..checkpoint import Checkpoints
from ..cube.carried import Carried, carried, choose_sharp_corners
from ..cube.cube import snap
from ..cube.edge_paths import PathError, lay_out
from ..cube.layout import CubeLayout
from ..extension import extended
from ..progress import timed
from ..threads import one_blas_thread
from .extension import CELL, schedule
from .first_spline import COARSE, first_spline
from .on_cube import surface_on_cube
from .start import Attempt, Start, Task, optimized

_log = logging.getLogger(__name__)

_TURNS = 3  # of the cube that are tried, until twelve paths are found: corners on sharp edges hardly depend on it
_LEAST_SHARE = 0.25  # of the cube's edges that follow ridges: of a half ball four of twelve do, around an eye none


@dataclass(frozen=True)
class Sharp(Start):
    """Make a map by a harmonic extension of a layout whose cube has its edges on sharp edges of the surface."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt | None:
        """Lay the surface on the cube along its sharp edges, and fit F to that layout, extended into the solid.

        None is returned where the cube's edges find no paths, or hardly follow sharp edges.
        """
        with timed(task.seconds, "fit"), one_blas_thread():
            found = _along_ridges(task)
            if found is None:
                return None
            layout, kept = found
            fit = task.fit(layout, COARSE, kept)
            first = first_spline(*extended(layout, CELL), fit)
        return optimized(first, fit, schedule(task.config.spline), task, checkpoints)


SHARP = Sharp("sharp edges", "extension", "laying the cube's edges along sharp edges")


def _along_ridges(task: Task) -> tuple[CubeLayout, Carried] | None:
    """Return the layout whose cube has its edges on ridges, and the points that stay there; None where it has few."""
    ridges = task.ridges
    assert ridges is not None  # else this start is not among those of the body
    for turn in range(_TURNS):
        layout = surface_on_cube(task, turn)
        try:
            given = task.given_corners
            laid = lay_out(layout, choose_sharp_corners(layout, ridges) if given is None else given, ridges)
        except PathError as error:
            _log.info("turn %d of the cube: %s", turn, error)
            continue
        laid = replace(laid, places=snap(laid.places))
        kept = carried(laid, ridges)
        _log.info("the cube's edges follow ridges along %.0f %% of their length", 100.0 * kept.share)
        return (laid, kept) if kept.share >= _LEAST_SHARE else None
    return None
