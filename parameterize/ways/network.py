"""The way by the trained network: F is fitted to the network's map and then optimised."""

import logging
import math
from dataclasses import replace

from ..arrays import Array, IntArray
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..cube.cube import CubeLayout
from ..cube.edge_paths import PathError, choose_corners, lay_out
from ..cube.flips import flipped, untangle
from ..optimization.phases import RAMP, Polish, Schedule, Separate, Shape, Unfold
from ..progress import timed
from ..surface.solid import Solid
from ..threads import one_blas_thread
from ..training.target_shapes import nearest_on_cube
from ..training.training_points import points_of_a_step
from .cost import Cost
from .growth import GROWTH, LAST, STIFF
from .mapping_task import MappingTask
from .one_cube import COARSE, OneCube, correspondence, first_spline
from .way import Attempt, optimized

_log = logging.getLogger(__name__)

_STEP = 1.3e-3  # passes for each point of a training step, with Adam's work
_FEW_FLIPS = 1e-2  # with a larger share of flipped triangles the surface is cut along traced cube edges


class Network(OneCube):
    """Make a map from a trained network, which maps the solid into the cube."""

    origin, counted = "network", True
    comes_from = "the network", "trained on the surface"

    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt | None:
        """Train the network, fit F to it and return the optimised F as an attempt.

        None is returned if the training finds the shape too hard, and other ways may follow.
        """
        from ..training.backend import one_thread_an_operation
        from ..training.trainer import Trainer  # it loads torch, which takes a second

        others = _has_others(task)
        if others and task.config.train.easy_loss == 0.0:  # every shape counts as hard
            return None
        with timed(task.seconds, "train"), one_thread_an_operation(), one_blas_thread():
            trainer = Trainer(
                *task.mesh,
                task.config,
                seed=task.seed,
                device=task.device,
                dtype=task.dtype,
                given_corners=task.given_corners,
                checkpoints=checkpoints,
                **task.report,
            )
            network = trainer.run(give_up=others)
        if network is None:
            return None
        spline = task.config.spline
        vertices, faces = task.mesh
        with timed(task.seconds, "fit"), one_thread_an_operation(), one_blas_thread():
            mapped = network.at(vertices)
            fit = correspondence(task, _layout(mapped, trainer.corners, task), COARSE)
            inside = Solid(vertices, faces).lattice(spline.fit_cell)
            places = network.at(inside).clip(0.0, 1.0)
            first = first_spline(inside, places, fit)
        return optimized(first, fit, schedule(spline), task, checkpoints)

    def cost(self, task: MappingTask) -> Cost:
        """Return the cost of the training and the rounds; of a hard surface that of a growth after the first stage."""
        config, surface = task.config, task.surface
        points = points_of_a_step(surface.unit_vertices, surface.faces, config.train)
        cube = Cost.of_cube(config, task.own)
        low, high = (steps * _STEP * points for steps in _steps(task))
        activations = 8 * points * config.network.width * (2 * config.network.modules + 3) / 1e6
        return replace(cube, passes=(cube.passes[0] + low, cube.passes[1] + high), memory_mb=activations)


NETWORK = Network("network", "training the network")


def _has_others(task: MappingTask) -> bool:
    """Return whether a growth may follow, so that the training may be given up."""
    names = task.config.ways
    return task.most_starts > 1 and (not names or any(way.name in names for way in (GROWTH, STIFF, LAST)))


def _steps(task: MappingTask) -> tuple[float, float]:
    """Return the training steps for an easy surface, and for a hard one: those of the first stage, or none.

    The first stage shows whether a surface is hard.
    """
    config, limit = task.config, task.config.train.easy_loss
    steps: float = sum(stage.steps for stage in config.stages)
    steps += math.ceil(config.train.race * next((stage.steps for stage in config.stages if stage.name == "cube"), 0))
    if limit is None or not _has_others(task):
        return steps, steps
    return (0, 0) if limit == 0.0 else (steps, config.stages[0].steps)


def schedule(spline: SplineConfig) -> Schedule:
    """Return the phases of the rounds: F starts folded where the network's map is, and the penalties grow slowly."""
    return Schedule((Shape(RAMP), Unfold(RAMP), Separate(RAMP), Polish(RAMP)), spline.rounds)


def _layout(mapped: Array, corners: IntArray | None, task: MappingTask) -> CubeLayout:
    """Return the layout of the nearest points on the cube, untangled; or else the patches between traced edges.

    The layout of nearest points is closer to the network's map. The layout by patches is used where flipped triangles
    remain in the other; it always succeeds where the edges can be traced.
    """
    layout = CubeLayout(*task.mesh, mapped, task.own)
    untangled = untangle(nearest_on_cube(mapped), layout.faces)
    if flipped(untangled, layout.faces).mean() > _FEW_FLIPS:
        try:
            chosen = choose_corners(mapped) if corners is None else corners
            return lay_out(layout, chosen)
        except PathError as error:
            _log.warning("the first layout has flipped triangles: %s", error)
    return replace(layout, places=untangled)
