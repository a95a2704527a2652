"""The way from a layout of the surface on the cube whose edges follow sharp edges, extended into the solid.

F is smooth but on the cube's edges. A trained or grown map has these where distortion is least, often across planes,
and rounds the sharp edges; here points of sharp edges lie on the cube's edges from the start, and stay there.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace

from ..arrays import IntArray
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..cube.constrained import OFF_RIDGES, Constrained, choose_sharp_corners, constrained
from ..cube.cube import CubeLayout, snap
from ..cube.edge_paths import PathError, lay_out
from ..extension import extended
from ..optimization.phases import Polish, Schedule, Separate, Shape, Unfold
from ..progress import timed
from ..surface.features import features_of
from ..surface.ridges import Ridges
from ..surface.surface import Surface
from ..threads import one_blas_thread
from .cost import Cost
from .mapping_task import MappingTask
from .one_cube import COARSE, MORE_ROUNDS, OneCube, correspondence, first_spline, surface_on_cube
from .tried import Tried
from .way import Attempt, Suits, optimized

_log = logging.getLogger(__name__)

FEW_EDGES = 4.0  # length at volume 1 of sharp edges: less is an eye or a mouth; the rim of a half ball has 5, a cube 12
PIECE = 0.25  # length at volume 1: a coarse mesh of a smooth body has sharp edges in shorter pieces
ALL = 0.95  # of the length of all sharp edges, which the cube's edges have to carry: with .92 of it on them, a notched
# cube came out three times as far from its surface as with edges that follow none
_CELL = 0.0255  # of the lattice inside, in a domain of volume 1: some 60 000 points, more than F has control points
_TURNS = 3  # of the cube that are tried, until twelve paths are found: corners on sharp edges hardly depend on it


class Sharp(OneCube):
    """Make a map by a harmonic extension of a layout whose cube has its edges on sharp edges of the surface."""

    origin = "sharp"
    comes_from = "the surface's layout on a cube", "extended into the solid without the network"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether sharp edges are long, and nearly all are ridges."""
        return Suits(task.config.starts > 1 and super().suits(task).applies and ridges_of(task) is not None)

    def follows(self, tried: Sequence[Tried]) -> bool:
        """Return whether no way comes before: edges of blocks along limbs were on sharp edges already."""
        return not tried

    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt | None:
        """Lay the surface on the cube along its sharp edges, and fit F to that layout, extended into the solid.

        None is returned if the cube's edges find no paths, or do not carry all sharp edges.
        """
        with timed(task.seconds, "fit"), one_blas_thread():
            laid = _along_ridges(task)
            if laid is None:
                return None
            layout, kept = laid
            fit = correspondence(task, layout, COARSE, kept)
            first = first_spline(*extended(layout, _CELL), fit)
        return optimized(first, fit, schedule(task.config.spline), task, checkpoints)

    def cost(self, task: MappingTask) -> Cost:
        """Return the cost of the rounds."""
        return Cost.of_cube(task.config, task.own)

    def serves(self, attempt: Attempt) -> bool:
        """Return whether the map has no faults, and it is also proved that the boundary does not meet itself."""
        return super().serves(attempt) and attempt.found.injective is not None


def schedule(spline: SplineConfig) -> Schedule:
    """Return the phases of the rounds: the first map is close to the last, so folds have a large penalty at once."""
    return Schedule((Shape(), Unfold(), Separate(), Polish()), spline.rounds + MORE_ROUNDS)


SHARP = Sharp("sharp edges", "laying the cube's edges along sharp edges")


def has_long_edges(surface: Surface) -> bool:
    """Return whether a body has sharp edges that are long in all."""
    lengths = surface.scale * surface.features.lengths
    return float(lengths[lengths > PIECE].sum()) >= FEW_EDGES


def ridges_of(task: MappingTask) -> Ridges | None:
    """Return the ridges of the surface, at volume 1; None if sharp edges are few or short, or not all ridges."""
    vertices, faces = task.surface.unit_vertices, task.surface.faces

    def find() -> Ridges | None:
        features = features_of(vertices, faces, task.surface.sharp)
        if features.lengths[features.lengths > PIECE].sum() < FEW_EDGES:
            return None
        ridges = Ridges.of(features, vertices, faces)
        return ridges if ridges.length >= ALL * ridges.total else None

    return task.fact("ridges", find)


def _along_ridges(task: MappingTask) -> tuple[CubeLayout, Constrained] | None:
    """Return the layout whose cube carries all sharp edges, and the points that stay on these; None where none does."""
    ridges = ridges_of(task)
    assert ridges is not None, "the way suits the body"
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
