"""The way to thin blocks along the solid's skeleton, which the rounds draw to the surface.

A body with handles is no image of one cube, and limbs are squeezed on it. Blocks with square sections along the
branches of the curve skeleton, glued by whole faces at blocks where branches meet, follow both. The surface is not laid
out on them: its points take the nearest places on the blocks anew before each round (reassignment.py).
"""

import logging
import math
from dataclasses import dataclass, replace

import numpy as np

from ..checkpoint import Checkpoints
from ..config import Config, scaled_steps
from ..cube.cutting import subdivide_finely
from ..layouts.complex import Complex, spline_of
from ..layouts.rods.along_skeleton import LayoutError, blocks_along
from ..layouts.skeleton.graph import Skeleton, SkeletonError
from ..optimization.phases import Polish, Schedule, Separate, Unfold
from ..optimization.reassignment import reassign
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import Correspondence
from ..optimization.term import Weights
from ..progress import timed
from ..spline.spline_map import SplineMap
from ..surface.geometry import normals_and_areas
from ..threads import one_blas_thread
from .cost import Cost
from .growth import GROWTH, STEPS, Grow
from .laid import in_words, kept_blocks
from .mapping_task import MOST_POINTS, MappingTask
from .one_cube import MORE_ROUNDS
from .sharp import has_long_edges
from .way import Attempt, Suits, Way, optimized

_log = logging.getLogger(__name__)

_FACE_SHARES = (1e-3, 1e-2, 0.1)  # of the weight of the surface's data while the faces are drawn to it, round by round
_POINT_SHARES = (0.01, 0.1)  # the same while the surface's points draw F, before they have all their weight
_LONGEST = 0.055  # length at volume 1 above which the mesh's edges are cut: about a span across a block
# Until blocks have no fault: thin ones do not buckle, and far thinner parts of the body keep their small det J.
STIFF_WEIGHTS = Weights(10.0 * Weights.fairness, least_floor=0.05)
_SOFT_ROUNDS = 4  # with the usual weights, after a stiff map is certified
# Share of the volume in the balls around the curves. A square rod has .79, and a rod twice as wide as thick .39:
TUBE_OF_LIMBS = 0.7  # without handles one cube is possible, and is left for a body that is nearly all limbs: bodies
# of round limbs have .75 to .97, and one with a fat trunk that the curves do not fill (a bunny) .65 and less
TUBE_OF_HANDLES = 0.4  # with it blocks along all branches serve: square rods become sections twice as wide as thick
LONG = 10.0  # median radii of the longest limb, to the middle of its junction: five diameters
COMPACT = 4.0  # cubed area of the surface over 36 pi, at volume 1: bodies with less have no long limbs, and most have
# less, so that these need not wait for a skeleton
_FAR = 0.2  # root mean square distance from the surface beyond which a folded map is given up


@dataclass(frozen=True)
class Approach(Grow):
    """Let the faces of F be drawn to the surface: in each round with a larger share of the weight."""

    name = "approach"
    by_faces = True


class AlongSkeleton(Way):
    """Make a map of several blocks along the branches of the solid's skeleton."""

    origin = "blocks"
    comes_from = "blocks along the skeleton", "glued by whole faces, and drawn to the surface"

    def suits(self, task: MappingTask) -> Suits:
        """Return whether the body has handles, or is nearly all limbs that are long, or the options ask for blocks."""
        if not task.surface.is_plain:
            return Suits(False)
        if task.surface.genus:
            return Suits(True, _of_handles(task.skeleton))
        if task.config.blocks is not None or task.given_corners is not None:
            return Suits((task.config.blocks or 1) > 1)
        if (figure := _compactness(task)) < COMPACT:
            usual = f"no handles, and a compact body: {figure:.1f} for a ball's 1: one cube"
            return Suits(False, usual, logging.DEBUG)
        try:
            return of_limbs(task.skeleton)
        except SkeletonError as error:
            return Suits(False, f"no handles, and no skeleton ({error}): one cube")

    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt | None:
        """Lay thin blocks along the skeleton, draw them to the surface and return the attempt.

        None is returned if no blocks fit into a body that one cube may suit, too, and other ways follow.
        """
        needed = task.surface.genus > 0 or task.config.blocks is not None
        with timed(task.seconds, "fit"), one_blas_thread():
            try:
                first = kept_blocks(checkpoints, lambda: spline_of(_blocks(task), task.config.spline.degree))
            except LayoutError as error:
                if needed:
                    raise
                _log.warning("%s", error)
                return None
            fit = surface_fit(task, first)
        stiff = optimized(first, fit, schedule(task.config), task, checkpoints, STIFF_WEIGHTS)
        return softened(stiff, task, checkpoints)

    def cost(self, task: MappingTask) -> Cost:
        """Return the cost of the rounds of the blocks, which the checkpoint keeps."""
        first = kept_blocks(task.checkpoints, lambda: spline_of(_blocks(task), task.config.spline.degree))
        return Cost.of_blocks(first.control.shape[1], len(first.nets.knots), has_long_edges(task.surface))

    def serves(self, attempt: Attempt) -> bool:
        """Return whether the map has no faults, and is close to the surface: one cube may be closer.

        On a hand whose blocks span the slits between the fingers, 0.013 away back from the boundary, one cube is
        closer.
        """
        both_ways = math.hypot(attempt.distance, attempt.distance_back) / math.sqrt(2.0)
        return super().serves(attempt) and both_ways <= GROWTH.far


BLOCKS = AlongSkeleton("blocks", "laying blocks along the skeleton")


def of_limbs(skeleton: Skeleton) -> Suits:
    """Return whether a body without handles is nearly all long limbs, by its skeleton."""
    if max(skeleton.degrees) < 3:
        return Suits(False, "no handles, and no place where limbs meet: one cube")
    limbs = [branch for branch in skeleton.branches if min(skeleton.degrees[end] for end in branch.ends) == 1]
    slender = max(branch.length / float(np.median(branch.radii)) for branch in limbs)
    figures = f"{skeleton.tube:.2f} of the volume around its curves, longest limb {slender:.1f} radii"
    if skeleton.tube < TUBE_OF_LIMBS:
        return Suits(False, f"no handles, and a fat trunk: {figures}: one cube")
    if slender < LONG:
        return Suits(False, f"no handles, and short limbs: {figures}: one cube")
    return Suits(True, f"{np.sum(np.equal(skeleton.degrees, 1))} limbs: {figures}: blocks along them")


def _of_handles(skeleton: Skeleton) -> str:
    """Return why blocks along the branches suit a body with handles."""
    figures = f"{skeleton.tube:.2f} of the volume around its curves"
    if skeleton.tube >= TUBE_OF_HANDLES:
        return f"{in_words(skeleton.handles, 'handle')}, thick branches: {figures}: blocks along them"
    return f"{in_words(skeleton.handles, 'handle')}, flat branches: {figures}: blocks as wide as the body along them"


def _compactness(task: MappingTask) -> float:
    """Return the cubed area of the surface at volume 1, over that of a ball."""
    area = float(normals_and_areas(task.surface.unit_vertices, task.surface.faces)[1].sum())
    return area**3 / (36.0 * math.pi)


def _blocks(task: MappingTask) -> Complex:
    """Return thin blocks along the skeleton. Raises SkeletonError and LayoutError if there are none."""
    surface, most = task.surface, task.config.blocks

    def find() -> Complex:
        return blocks_along(task.skeleton, surface.unit_vertices, surface.faces, task.spans_across, task.in_users_units)

    blocks = task.fact(("blocks", task.spans_across), find)
    if most is not None and len(blocks) > most:
        raise LayoutError(f"the skeleton needs {len(blocks)} blocks, and at most {most} are allowed: allow more")
    return blocks


def softened(stiff: Attempt, task: MappingTask, checkpoints: Checkpoints) -> Attempt:
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


def surface_fit(task: MappingTask, first: SplineMap) -> Correspondence:
    """Return the surface's points, each with its first place on the blocks."""
    surface = task.surface
    points, faces = subdivide_finely(surface.unit_vertices, surface.faces, _LONGEST, task.own + MOST_POINTS)
    face = int(np.flatnonzero(first.nets.exposed)[0])  # any: places are assigned at once
    parameters = np.full((len(points), 3), 0.5)
    parameters[:, face % 6 // 2] = face % 2
    fit = task.correspondence(SlidingParameters(first.nets, parameters, np.full(len(points), face), faces), points)
    reassign(fit, first.control, first=True)
    return fit
