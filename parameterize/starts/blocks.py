"""Starts from thin blocks along the solid's skeleton, which the rounds draw to the surface.

A body with handles is no image of one cube, and limbs are squeezed on it. Blocks with square sections along the
branches of the curve skeleton, glued by whole faces at blocks where branches meet, follow both. The surface is not laid
out on them: its points take the nearest places on the blocks anew before each round (reassignment.py).
"""

import logging
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, Knots
from ..checkpoint import Checkpoints
from ..config import Config, scaled_steps
from ..cube.cutting import subdivide_finely
from ..layouts.rods.along_skeleton import Block, BlockLayout, LayoutError
from ..optimization.phases import Polish, Schedule, Separate, Unfold
from ..optimization.reassignment import reassign
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import TANGENTIAL, Correspondence
from ..optimization.term import Weights
from ..progress import timed
from ..spline.bspline import greville, open_uniform_knots
from ..spline.control_nets import ControlNets
from ..spline.spline_map import SplineMap
from ..surface.geometry import vertex_quadrics, vertex_weights
from ..threads import one_blas_thread
from .growth import STEPS, Grow
from .kept_blocks import kept_blocks
from .on_cube import MORE_ROUNDS
from .start import MOST_POINTS, Attempt, Start, Task, optimized

_log = logging.getLogger(__name__)

_FACE_SHARES = (1e-3, 1e-2, 0.1)  # of the weight of the surface's data while the faces are drawn to it, round by round
_POINT_SHARES = (0.01, 0.1)  # the same while the surface's points draw F, before they have all their weight
_LONGEST = 0.055  # length at volume 1 above which the mesh's edges are cut: about a span across a block
# Until blocks have no fault: thin ones do not buckle, and far thinner parts of the body keep their small det J.
STIFF_WEIGHTS = Weights(10.0 * Weights.fairness, least_floor=0.05)
_SOFT_ROUNDS = 4  # with the usual weights, after a stiff map is certified
_FAR = 0.2  # root mean square distance from the surface beyond which a folded map is given up


@dataclass(frozen=True)
class Approach(Grow):
    """Let the faces of F be drawn to the surface: in each round with a larger share of the weight."""

    name = "approach"
    by_faces = True


@dataclass(frozen=True)
class AlongSkeleton(Start):
    """Make a map of several blocks along the branches of the solid's skeleton."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt | None:
        """Lay thin blocks along the skeleton, draw them to the surface and return the attempt.

        None is returned where no blocks fit into a body that one cube may suit, too, and other starts follow.
        """
        needed = task.surface.genus > 0 or task.config.blocks is not None
        with timed(task.seconds, "fit"), one_blas_thread():
            try:
                degree = task.config.spline.degree
                first = kept_blocks(checkpoints, task.choice, lambda: thin_blocks(task.layout, degree))
            except LayoutError as error:
                if needed:
                    raise
                _log.warning("%s", error)
                return None
            fit = surface_fit(task, first)
        stiff = optimized(first, fit, schedule(task.config), task, checkpoints, STIFF_WEIGHTS)
        return softened(stiff, task, checkpoints)


BLOCKS = AlongSkeleton("blocks", "blocks", "laying blocks along the skeleton")


def softened(stiff: Attempt, task: Task, checkpoints: Checkpoints) -> Attempt:
    """Return what rounds with the usual weights make of a stiff map, or that map where they make it worse.

    They lower the distortion of seven bodies by 7 %, and their distance from the surface by 6 %.
    """
    if any(stiff.found.faults):
        return stiff
    spline = stiff.found.spline
    rounds = Schedule((Polish(),), _SOFT_ROUNDS)
    soft = optimized(spline, stiff.fit.on_nets(spline.nets), rounds, task, checkpoints.of_part("soft"))
    soft = replace(soft, course=soft.course.after(stiff.course))
    return min(soft, stiff, key=lambda attempt: attempt.rank)


def schedule(
    config: Config,
    face_shares: tuple[float, ...] = _FACE_SHARES,
    point_shares: tuple[float, ...] = _POINT_SHARES,
) -> Schedule:
    """Return the phases of the rounds: all faces are drawn to the surface at first, then the surface's points draw F.

    Both do so with a growing weight, whose shares are given round by round.

    Folded maps are not given up for their distance: places are assigned anew in each round.
    """
    shares, steps = face_shares + point_shares, scaled_steps(STEPS, config.steps_factor)
    growing = Approach(shares=face_shares, steps=steps), Grow(shares=shares, steps=steps)
    phases = *growing, Unfold(far=_FAR, far_first=_FAR), Separate(far=_FAR), Polish()
    return Schedule(phases, len(shares) + config.spline.rounds + MORE_ROUNDS)


def thin_blocks(layout: BlockLayout, degree: int) -> SplineMap:
    """Return the map whose control points are points of the layout's rods, at the Greville points of uniform knots."""
    nets = nets_of(layout, degree)
    points = [points_of(block, rows, degree) for block, rows in zip(layout.blocks, nets.knots, strict=True)]
    return SplineMap(nets, nets.merged(nets.joined(points)))


def nets_of(layout: BlockLayout, degree: int) -> ControlNets:
    """Return the control nets of a layout's blocks, with uniform knots."""
    knots = [tuple(open_uniform_knots(degree + spans, degree) for spans in block.spans) for block in layout.blocks]
    return ControlNets(degree, tuple(knots), layout.interfaces)  # type: ignore[arg-type]


def points_of(block: Block, knots: Knots, degree: int) -> Array:
    """Return the points (3, n_u, n_v, n_w) of a block at the Greville points of its knots."""
    places = np.stack(np.meshgrid(*(greville(row, degree) for row in knots), indexing="ij"), axis=-1)
    return np.moveaxis(block.points(places), -1, 0)


def surface_fit(task: Task, first: SplineMap) -> Correspondence:
    """Return the surface's points, each with its first place on the blocks."""
    surface = task.surface
    points, faces = subdivide_finely(surface.unit_vertices, surface.faces, _LONGEST, task.own + MOST_POINTS)
    face = int(np.flatnonzero(first.nets.exposed)[0])  # any: places are assigned at once
    places = np.full((len(points), 3), 0.5)
    places[:, face % 6 // 2] = face % 2
    fit = Correspondence(
        SlidingParameters(first.nets, places, np.full(len(points), face), faces),
        points,
        vertex_quadrics(points, faces, TANGENTIAL),
        vertex_weights(points, faces, task.own),
    )
    reassign(fit, first.control, first=True)
    return fit
