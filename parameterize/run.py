"""parameterize: a closed surface to a trivariate B-spline volume, certified where that succeeds."""

import hashlib
import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from numbers import Integral
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from .arrays import Array, IntArray
from .certificate.boundary import check_boundary
from .certificate.jacobian import Certificate, certify
from .checkpoint import Checkpoints
from .coarse import coarse_knots, optimize_coarse_first
from .config import Config, SplineConfig, preset
from .cube.boundary_map import BoundaryMap, boundary_map
from .cube.cutting import subdivide_finely
from .cube.edge_paths import PathError, choose_corners
from .cube.flips import flipped, untangle
from .cube.tutte import Layout, lay_out
from .extension import extended, extending
from .growth import first_cube, growing, surface_on_cube
from .optimization.least_squares import fit_pairs
from .optimization.newton import Optimized, one_thread_an_operation
from .optimization.sliding import SlidingParameters
from .optimization.surface_distance import SurfaceFit
from .progress import History, ProgressCallback, ignore
from .quality.quality import QualityReport, measure
from .refinement import Refinement, refine
from .spline.volume import BSplineVolume
from .surface.geometry import vertex_quadrics, vertex_weights
from .surface.surface import Surface
from .training.samples import interior_points
from .training.target_shapes import nearest_on_cube
from .training.trainer import Trainer, map_points

_log = logging.getLogger(__name__)

Origin = Literal["network", "growth", "extension"]


@dataclass(frozen=True, eq=False)
class Parameterization:
    """What `parameterize` returns; lengths in the user's units.

    Attributes
    ----------
    volume : BSplineVolume
        The map F.
    boundary : BoundaryMap
        Every surface vertex with its parameters.
    certificate : Certificate
        What is proved of det J.
    quality : QualityReport
        What is measured; printed, a table.
    history : dict of str to array
        Columns of equal length, one row a training step.
    seconds : dict of str to float
        Wall seconds of train, fit, optimize and certify, the last with quality, at the end: the certificates on the way
        count as optimize; with config.refinement, also those of refine.
    device : str
        Where the network was trained.
    seed : int
    config : Config
    origin : "network", "growth" or "extension"
        Where the map comes from: the trained network, a cube that grew, or an extended layout of the surface.
    refinement : Refinement or None
        With config.refinement, how many control points each direction got, and why no more.

    Examples
    --------
    >>> import iga_nn
    >>> config = iga_nn.preset("fast").scaled(0.02).with_control_points(6)  # a quick look
    >>> result = iga_nn.parameterize(iga_nn.sample("cube"), config)
    >>> result.quality.certificate is result.certificate, sorted(result.seconds)
    (True, ['certify', 'fit', 'optimize', 'train'])
    """

    volume: BSplineVolume
    boundary: BoundaryMap
    certificate: Certificate
    quality: QualityReport
    history: dict[str, NDArray[Any]]
    seconds: dict[str, float]
    device: str
    seed: int
    config: Config
    origin: Origin
    refinement: Refinement | None = None


def parameterize(
    surface: Surface,
    config: Config | None = None,
    *,
    seed: int = 0,
    device: str = "auto",
    dtype: torch.dtype = torch.float32,
    corners: ArrayLike | None = None,
    progress: ProgressCallback | None = None,
    checkpoint_dir: str | Path | None = None,
    resume: bool = False,
) -> Parameterization:
    """Map the unit cube onto the solid inside a closed surface (paper, section 4.3).

    Parameters
    ----------
    surface : Surface
        What bounds the solid.
    config : Config, optional
        Options, `preset("fast")` by default.
    seed : int
        Equal seeds give equal volumes, bit for bit; the number of threads (OMP_NUM_THREADS, or all cores) does not
        change the result on a CPU.
    device : str
        Where the network trains: "auto", "cpu" or "cuda".
    dtype : torch.dtype
        Of the network.
    corners : (8, 3) array or (8,) array of int, optional
        The cube's corners on the surface: points in the surface's units, which take their nearest vertices, or vertex
        numbers; in the order (0,0,0), (0,0,1), (0,1,0), ..., (1,1,1). Chosen by the method where they are not given.
    progress : callable, optional
        Called with a `Progress` at every step.
    checkpoint_dir : str or Path, optional
        Where checkpoints go.
    resume : bool
        Go on from the last checkpoint.

    Returns
    -------
    Parameterization
        The volume with its certificate, whatever the verdict is.

    Raises
    ------
    TypeError
        For a surface, config or seed of another type.
    ValueError
        For a negative seed, bad corners or a device that is not there.
    CheckpointError
        For a checkpoint of another run.
    PathError
        Where the training stays too far from a cube for its edges to be found.

    Examples
    --------
    >>> import iga_nn
    >>> config = iga_nn.preset("fast").scaled(0.02).with_control_points(6)  # a quick look
    >>> result = iga_nn.parameterize(iga_nn.sample("cube"), config, seed=1)
    >>> result.volume.shape, result.seed
    ((6, 6, 6), 1)
    """
    config, seed = _checked(surface, config, seed)
    place = choose_device(device)
    given = None if corners is None else corner_vertices(surface, corners)
    identity = {
        "surface": hashlib.sha256(surface.vertices.tobytes() + surface.faces.tobytes()).hexdigest(),
        "config": asdict(config),
        "seed": seed,
        "device": place.type,
        "dtype": str(dtype),
        "corners": None if given is None else given.tolist(),
    }
    checkpoints = Checkpoints(None if checkpoint_dir is None else Path(checkpoint_dir), identity, resume=resume)
    spline = config.spline
    own, history, seconds = len(surface.vertices), History(), dict[str, float]()
    vertices, faces = subdivide_finely(surface.unit_vertices, surface.faces, own, spline)
    report: dict[str, Any] = {"history": history, "progress": progress or ignore}
    task = _Task(surface, vertices, own, faces, config, seed, place, dtype, given, seconds, report)
    attempt = _best_attempt(task, checkpoints)
    found, fit = attempt.found, attempt.fit
    told = None
    if config.refinement is not None:
        with _timed(seconds, "refine"):
            found, fit, told = refine(found, fit, own, spline, config.refinement, checkpoints=checkpoints, **report)
    with _timed(seconds, "optimize"):
        volume, boundary = _in_users_units(found, surface, task, fit)
    with _timed(seconds, "certify"):
        certificate = certify(volume)  # of the volume in the user's units: bringing it there rounds
        proofs = certificate, check_boundary(volume)
        quality = measure(volume, surface.vertices, surface.faces, surface.scale, boundary, *proofs)
    return Parameterization(
        volume=volume,
        boundary=boundary,
        certificate=certificate,
        quality=quality,
        history=history.arrays(),
        seconds=seconds,
        device=place.type,
        seed=seed,
        config=config,
        origin=attempt.origin,
        refinement=told,
    )


def _checked(surface: Surface, config: Config | None, seed: int) -> tuple[Config, int]:
    if not isinstance(surface, Surface):
        raise TypeError(f"surface must be a Surface, got {surface!r:.80}; read one with load_surface(path)")
    if config is not None and not isinstance(config, Config):
        raise TypeError(f"config must be a Config, got {config!r:.80}; take one from preset('fast')")
    if not isinstance(seed, Integral):
        raise TypeError(f"seed must be a whole number, got {seed!r:.80}")
    if seed < 0:
        raise ValueError(f"seed must not be negative, got {seed}")
    return config or preset("fast"), int(seed)


def choose_device(name: str) -> torch.device:
    """Return the torch device for "auto", "cpu" or "cuda". Raises ValueError where it is not there."""
    if name not in ("auto", "cpu", "cuda"):
        raise ValueError(f"device {name!r}: choose auto, cpu or cuda")
    available = torch.cuda.is_available()
    if name == "cuda" and not available:
        raise ValueError("device cuda: torch finds no CUDA device here; use --device cpu")
    return torch.device("cuda" if available and name != "cpu" else "cpu")


def corner_vertices(surface: Surface, corners: ArrayLike) -> IntArray:
    """Return the vertices (8,) of given corners: 8 vertex numbers, or (8, 3) points that take their nearest ones.

    Raises ValueError unless these are eight different vertices.
    """
    given = np.asarray(corners)
    if given.shape == (8, 3):
        if not np.all(np.isfinite(given.astype(np.float64))):
            raise ValueError("corners: the coordinates must be finite")
        gaps = np.linalg.norm(surface.vertices[:, None] - given.astype(np.float64), axis=2)
        numbers = gaps.argmin(axis=0)
    elif given.shape == (8,) and given.dtype.kind in "iu":
        numbers = given.astype(np.int64)
    else:
        raise ValueError(f"corners must be 8 vertex numbers or 8 points of 3 coordinates, got shape {given.shape}")
    if numbers.min() < 0 or numbers.max() >= len(surface.vertices):
        raise ValueError(f"corners: vertex numbers must lie between 0 and {len(surface.vertices) - 1}")
    if len(np.unique(numbers)) != 8:
        raise ValueError("corners: two of them fall on the same vertex; give eight places farther apart")
    return np.asarray(numbers, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class _Task:
    """What all attempts share: the surface, itself and at volume 1 with long edges cut; options, the place."""

    surface: Surface
    vertices: Array
    own: int  # vertices of the surface itself, the first ones
    faces: IntArray
    config: Config
    seed: int
    device: torch.device
    dtype: torch.dtype
    given_corners: IntArray | None
    seconds: dict[str, float]  # which grow as the run goes on
    report: dict[str, Any]  # history and progress, as Trainer and optimize take them


@dataclass(frozen=True, eq=False)
class _Attempt:
    """A map, the surface data that belong to it, and where it comes from."""

    found: Optimized
    fit: SurfaceFit
    origin: Origin


def _best_attempt(task: _Task, checkpoints: Checkpoints) -> _Attempt:
    """Train a map; where that is hard or not certified, grow and extend others. Return the first without faults.

    Where all have faults, return the best.
    """
    starts = task.config.starts if task.given_corners is None else 1
    best = _trained(task, checkpoints, give_up=starts > 1)
    for start in range(1, starts):
        if best is not None and not any(best.found.faults):
            break
        grows = start % 2 == 1
        way = "growing a map from a cube" if grows else "extending the surface's layout into the solid"
        if best is None:
            _log.info("the shape is hard for the network: %s instead", way)
        else:
            _log.warning("%s; %s instead", _fault(best.found), way)
        turn = (start - 1) // 2  # a way that comes again begins with another turn of the cube
        other = (_grown if grows else _extended)(task, turn, checkpoints.of_start(start))
        if best is None or other.found.rank < best.found.rank:
            best = other
    assert best is not None
    return best


def _trained(task: _Task, checkpoints: Checkpoints, *, give_up: bool) -> _Attempt | None:
    """Train the network, fit F to it and optimise F. With `give_up`, return None where the shape is hard to train."""
    with _timed(task.seconds, "train"), one_thread_an_operation():
        trainer = Trainer(
            task.vertices,
            task.faces,
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
    with _timed(task.seconds, "fit"), one_thread_an_operation():
        mapped = map_points(network, task.vertices, task.device, task.dtype)
        fit = _surface_fit(_layout(mapped, trainer.corners, task), spline, task)
        inside = interior_points(task.vertices, task.faces, spline.fit_cell)
        places = map_points(network, inside, task.device, task.dtype).clip(0.0, 1.0)
        control = _first_spline(inside, places, fit, spline)
    return _optimized(control, fit, spline, task, checkpoints, "network")


def _grown(task: _Task, turn: int, checkpoints: Checkpoints) -> _Attempt:
    """Lay the surface on the cube and let F grow from a cube towards it."""
    config = task.config
    spline = growing(config.spline, config.growth)
    with _timed(task.seconds, "fit"), one_thread_an_operation():
        layout = _on_cube(task, turn)
        fit = _surface_fit(layout, spline, task)
        control = first_cube(layout, task.own, fit.places.knots, spline.degree)
    return _optimized(control, fit, spline, task, checkpoints, "growth")


def _extended(task: _Task, turn: int, checkpoints: Checkpoints) -> _Attempt:
    """Lay the surface on the cube likewise, extend that into the solid, fit F to it and optimise F."""
    config = task.config
    spline = extending(config.spline, config.extension)
    with _timed(task.seconds, "fit"), one_thread_an_operation():
        layout = _on_cube(task, turn)
        fit = _surface_fit(layout, spline, task)
        control = _first_spline(*extended(layout, config.extension), fit, spline)
    return _optimized(control, fit, spline, task, checkpoints, "extension")


def _on_cube(task: _Task, turn: int) -> Layout:
    mesh = task.surface.unit_vertices, task.surface.faces
    return surface_on_cube(*mesh, task.config.spline, task.config.layout, seed=task.seed, turn=turn)


def _optimized(
    control: torch.Tensor,
    fit: SurfaceFit,
    spline: SplineConfig,
    task: _Task,
    checkpoints: Checkpoints,
    origin: Origin,
) -> _Attempt:
    with _timed(task.seconds, "optimize"):
        found, fit = optimize_coarse_first(control, fit, spline, checkpoints=checkpoints, **task.report)
    return _Attempt(found, fit, origin)


def _fault(found: Optimized) -> str:
    return "the boundary meets itself" if found.meets_itself else "not certified"


def _surface_fit(layout: Layout, spline: SplineConfig, task: _Task) -> SurfaceFit:
    """Return where the surface's points lie on the boundary of the cube to begin with (section 4.3.2, step 1)."""
    return SurfaceFit(
        SlidingParameters(coarse_knots(spline), spline.degree, layout.places, layout.faces, task.config.layout),
        layout.vertices,
        vertex_quadrics(layout.vertices, layout.faces, spline.tangential),
        vertex_weights(layout.vertices, layout.faces, task.own),
        given_corners=None if task.given_corners is None else task.vertices[task.given_corners],
    )


def _layout(mapped: Array, corners: IntArray | None, task: _Task) -> Layout:
    """Return nearest points on the cube, untangled; where that leaves flips, patches between traced edges.

    The first stays closer to the network's map, the second always succeeds where the edges can be traced.
    """
    nearest = nearest_on_cube(torch.as_tensor(mapped)).numpy()
    untangled = untangle(nearest, task.faces, task.config.layout)
    if flipped(untangled, task.faces).mean() > task.config.spline.few_flips:
        try:
            chosen = choose_corners(mapped) if corners is None else corners
            return lay_out(mapped, task.vertices, task.faces, chosen, task.config.layout)
        except PathError as error:
            _log.warning("the first layout has flipped triangles: %s", error)
    return Layout(task.vertices, task.faces, untangled)


def _first_spline(inside: Array, places: Array, fit: SurfaceFit, spline: SplineConfig) -> torch.Tensor:
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


def _in_users_units(
    found: Optimized, surface: Surface, task: _Task, fit: SurfaceFit
) -> tuple[BSplineVolume, BoundaryMap]:
    """Return the volume and its boundary map; parameters are first brought close to this volume's closest points."""
    spline = task.config.spline
    places = fit.places.settled(found.control, fit.points, spline.last_slides, spline.last_sweeps)
    points = surface.from_unit(found.control.permute(1, 2, 3, 0).cpu().numpy())
    volume = BSplineVolume((spline.degree,) * 3, places.knots, points)
    own = np.concatenate([surface.vertices, surface.from_unit(fit.points[task.own :])])
    return volume, boundary_map(volume, own, places.triangles, places.parameters, task.config.layout)


@contextmanager
def _timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start
