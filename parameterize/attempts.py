"""The ways to a map, one after the other: the trained network, a cube that grows, a layout extended into the solid."""

import logging
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from .arrays import Array, IntArray
from .checkpoint import Checkpoints
from .coarse import coarse_knots, optimize_coarse_first
from .config import Config, ExtensionConfig, GrowthConfig, SplineConfig
from .cube.cutting import subdivide_finely
from .cube.edge_paths import PathError, choose_corners, lay_out
from .cube.flips import Layout, flipped, untangle
from .cube.sphere import lay_on_sphere
from .extension import extended, extending
from .growth import first_cube, growing, stiffened, surface_on_cube
from .optimization.least_squares import fit_pairs
from .optimization.rounds import Optimized
from .optimization.sliding import SlidingParameters
from .optimization.surface_distance import SurfaceFit
from .progress import timed
from .surface.geometry import vertex_quadrics, vertex_weights
from .surface.surface import Surface
from .threads import one_blas_thread
from .training.backend import one_thread_an_operation
from .training.samples import interior_points
from .training.target_shapes import nearest_places
from .training.trainer import Trainer, map_points

_log = logging.getLogger(__name__)

Origin = Literal["network", "growth", "extension"]


@dataclass(frozen=True, eq=False)
class Task:
    """What all attempts share: the surface, options, the place, and what is computed of the surface once."""

    surface: Surface
    config: Config
    seed: int
    device: str  # where the network is trained, "cpu" or "cuda"
    dtype: str  # its precision, "float32" or "float64"
    given_corners: IntArray | None
    seconds: dict[str, float]  # which grow as the run goes on
    report: dict[str, Any]  # history and progress, as Trainer and optimize take them

    @property
    def own(self) -> int:
        """Number of the surface's own vertices, which stay the first ones where edges are cut."""
        return len(self.surface.vertices)

    @cached_property
    def mesh(self) -> tuple[Array, IntArray]:
        """Vertices (n, 3) and faces (m, 3) at volume 1, long edges cut."""
        spline = self.config.spline
        return subdivide_finely(
            self.surface.unit_vertices, self.surface.faces, spline.longest_edge, self.own + spline.most_points
        )

    @cached_property
    def sphere(self) -> Layout:
        """The surface at volume 1, laid on the sphere."""
        surface = self.surface
        return lay_on_sphere(surface.unit_vertices, surface.faces, self.config.layout, self.report["progress"])


@dataclass(frozen=True, eq=False)
class Attempt:
    """A map, the surface data that belong to it, where it comes from, and the options by which it may be refined."""

    found: Optimized
    fit: SurfaceFit
    origin: Origin
    spline: SplineConfig

    @cached_property
    def distance(self) -> float:
        """Root mean square distance of the surface's points from the map, at volume 1."""
        return math.sqrt(self.fit.mean_square(self.found.control))

    @property
    def rank(self) -> tuple[int, bool, bool, float]:
        """What is not proved, then the distance: of two attempts the one with the lower rank is better."""
        return *self.found.rank, self.distance


def best_attempt(task: Task, checkpoints: Checkpoints) -> Attempt:
    """Train a map; where that is hard or not certified, grow and extend others. Return the first without faults.

    Where the first growth is far from the surface, a stiffer one follows, and the nearer of the two is kept. Where all
    have faults, return the best.
    """
    config = task.config
    ways: list[tuple[str, GrowthConfig | ExtensionConfig]] = [
        ("growing a map from a cube", config.growth),
        ("extending the surface's layout into the solid", config.extension),
        ("growing a stiffer map", config.stiff_growth),
        ("growing a stiffer map, farther from the surface,", config.last_growth),
    ]
    tries = min(config.starts - 1, len(ways)) if task.given_corners is None else 0
    best = _trained(task, checkpoints, give_up=tries > 0)
    far = False
    for i in range(tries):
        if best is not None and not any(best.found.faults) and not far:
            break
        told, options = ways[i]
        _tell(best, told)
        kept = checkpoints.of_part(i + 1)
        other = _grown(task, options, kept) if isinstance(options, GrowthConfig) else _extended(task, options, kept)
        far = i == 0 and other.distance > config.growth.far
        if i == 0 and (other.found.meets_itself or far):
            ways[1], ways[2] = ways[2], ways[1]
        if best is None or other.rank < best.rank:
            best = other
    assert best is not None
    return best


def _tell(best: Attempt | None, way: str) -> None:
    if best is None:
        _log.info("the shape is hard for the network: %s instead", way)
    else:
        _log.warning("%s; %s instead", _fault(best.found), way)


def _trained(task: Task, checkpoints: Checkpoints, *, give_up: bool) -> Attempt | None:
    """Train the network, fit F to it and optimise F. With `give_up`, return None where the shape is hard to train."""
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
        network = trainer.run(give_up=give_up)
    if network is None:
        return None
    spline = task.config.spline
    vertices, faces = task.mesh
    with timed(task.seconds, "fit"), one_thread_an_operation(), one_blas_thread():
        mapped = map_points(network, vertices)
        fit = _surface_fit(_layout(mapped, trainer.corners, task), spline, task)
        inside = interior_points(vertices, faces, spline.fit_cell)
        places = map_points(network, inside).clip(0.0, 1.0)
        control = _first_spline(inside, places, fit, spline)
    return _optimized(control, fit, spline, task, checkpoints, "network")


def _grown(task: Task, growth: GrowthConfig, checkpoints: Checkpoints) -> Attempt:
    """Lay the surface on the cube and let F grow towards it."""
    spline = growing(task.config.spline, growth)
    with timed(task.seconds, "fit"), one_blas_thread():
        layout = _on_cube(task, growth.turn)
        fit = _surface_fit(layout, spline, task)
        control = first_cube(layout, task.own, fit.places.knots, spline.degree)
    attempt = _optimized(control, fit, spline, task, checkpoints, "growth")
    return replace(attempt, spline=stiffened(task.config.spline, growth))


def _extended(task: Task, extension: ExtensionConfig, checkpoints: Checkpoints) -> Attempt:
    """Lay the surface on the cube and fit F to that layout, extended into the solid."""
    spline = extending(task.config.spline, extension)
    with timed(task.seconds, "fit"), one_blas_thread():
        layout = _on_cube(task, 0)
        fit = _surface_fit(layout, spline, task)
        control = _first_spline(*extended(layout, extension), fit, spline)
    return _optimized(control, fit, spline, task, checkpoints, "extension")


def _on_cube(task: Task, turn: int) -> Layout:
    config = task.config
    return surface_on_cube(task.sphere, task.own, config.spline, config.layout, seed=task.seed, turn=turn)


def _optimized(
    control: Array,
    fit: SurfaceFit,
    spline: SplineConfig,
    task: Task,
    checkpoints: Checkpoints,
    origin: Origin,
) -> Attempt:
    with timed(task.seconds, "optimize"):
        found, fit = optimize_coarse_first(control, fit, spline, checkpoints=checkpoints, **task.report)
    return Attempt(found, fit, origin, task.config.spline)


def _fault(found: Optimized) -> str:
    if not any(found.faults):
        return "far from the surface"
    return "the boundary meets itself" if found.meets_itself else "not certified"


def _surface_fit(layout: Layout, spline: SplineConfig, task: Task) -> SurfaceFit:
    """Return where the surface's points lie on the boundary of the cube to begin with (section 4.3.2, step 1)."""
    return SurfaceFit(
        SlidingParameters(coarse_knots(spline), spline.degree, layout.places, layout.faces, task.config.layout),
        layout.vertices,
        vertex_quadrics(layout.vertices, layout.faces, spline.tangential),
        vertex_weights(layout.vertices, layout.faces, task.own),
        given_corners=None if task.given_corners is None else task.mesh[0][task.given_corners],
    )


def _layout(mapped: Array, corners: IntArray | None, task: Task) -> Layout:
    """Return nearest points on the cube, untangled; where that leaves flips, patches between traced edges.

    The first stays closer to the network's map, the second always succeeds where the edges can be traced.
    """
    vertices, faces = task.mesh
    nearest = nearest_places(mapped)
    untangled = untangle(nearest, faces, task.config.layout)
    if flipped(untangled, faces).mean() > task.config.spline.few_flips:
        try:
            chosen = choose_corners(mapped) if corners is None else corners
            return lay_out(mapped, vertices, faces, chosen, task.config.layout)
        except PathError as error:
            _log.warning("the first layout has flipped triangles: %s", error)
    return Layout(vertices, faces, untangled)


def _first_spline(inside: Array, places: Array, fit: SurfaceFit, spline: SplineConfig) -> Array:
    """Fit by least squares to pairs (k, 3) of places and points inside, and the boundary's (section 4.3.2, step 2)."""
    weights = [
        np.full(len(inside), (1.0 - spline.boundary_share) / max(len(inside), 1)),
        np.full(len(fit.points), spline.boundary_share / len(fit.points)),
    ]
    return fit_pairs(
        np.concatenate([places, fit.places.parameters]),
        np.concatenate([inside, fit.points]),
        np.concatenate(weights),
        fit.places.knots,
        spline.degree,
        fairness=spline.fit_fairness,
    )
