"""Starts from the trained network: F is fitted to the network's map and then optimised."""

import logging
from dataclasses import dataclass, replace

from ..arrays import Array, IntArray
from ..checkpoint import Checkpoints
from ..config import SplineConfig
from ..cube.cube_layout import CubeLayout
from ..cube.edge_paths import PathError, choose_corners, lay_out
from ..cube.flips import flipped, untangle
from ..optimization.phases import RAMP, Polish, Schedule, Separate, Shape, Unfold
from ..progress import timed
from ..surface.solid import Solid
from ..threads import one_blas_thread
from .first_spline import COARSE, first_spline
from .start import Attempt, Start, Task, optimized

_log = logging.getLogger(__name__)

_FEW_FLIPS = 1e-2  # with a larger share of flipped triangles the surface is cut along traced cube edges


@dataclass(frozen=True)
class Network(Start):
    """Make a map from a trained network, which maps the solid into the cube."""

    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt | None:
        """Train the network, fit F to it and return the optimised F as an attempt.

        None is returned where the training finds the shape too hard, and other starts may follow.
        """
        from ..training.backend import one_thread_an_operation  # they load torch, which takes a second
        from ..training.trainer import Trainer, map_points

        others = task.most_starts > 1
        if others and task.config.train.easy_loss == 0.0:  # every shape counts as hard
            return None
        with timed(task.seconds, "train"), one_thread_an_operation():
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
            mapped = map_points(network, vertices)
            fit = task.fit(_layout(mapped, trainer.corners, task), COARSE)
            inside = Solid(vertices, faces).lattice(spline.fit_cell)
            places = map_points(network, inside).clip(0.0, 1.0)
            first = first_spline(inside, places, fit)
        return optimized(first, fit, schedule(spline), task, checkpoints)


NETWORK = Network("network", "network", "training the network")


def schedule(spline: SplineConfig) -> Schedule:
    """Return the phases of the rounds: F starts folded where the network's map is, and the penalties grow slowly."""
    return Schedule((Shape(RAMP), Unfold(RAMP), Separate(RAMP), Polish(RAMP)), spline.rounds)


def _layout(mapped: Array, corners: IntArray | None, task: Task) -> CubeLayout:
    """Return the layout of the nearest points on the cube, untangled; or else the patches between traced edges.

    The layout of nearest points is closer to the network's map. The layout by patches is used where flipped triangles
    remain in the other; it always succeeds where the edges can be traced.
    """
    from ..training.target_shapes import nearest_places

    layout = CubeLayout(*task.mesh, mapped, task.own)
    untangled = untangle(nearest_places(mapped), layout.faces)
    if flipped(untangled, layout.faces).mean() > _FEW_FLIPS:
        try:
            chosen = choose_corners(mapped) if corners is None else corners
            return lay_out(layout, chosen)
        except PathError as error:
            _log.warning("the first layout has flipped triangles: %s", error)
    return replace(layout, places=untangled)
