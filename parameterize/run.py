"""parameterize: a closed surface to a trivariate B-spline volume, certified where its proof succeeds."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import IntArray, in_brackets
from .certificate.boundary import check_boundary
from .certificate.certify import Certificate, certify
from .checkpoint import Checkpoints
from .config import Config, preset
from .cube.boundary_map import BoundaryMap, boundary_map
from .cube.cube import CubeLayout
from .display import Brief
from .old_names import renamed
from .optimization.endings import CertifiedMap
from .optimization.reassignment import reassign
from .optimization.surface_distance import Correspondence
from .progress import History, ProgressCallback, ignore, timed
from .quality.quality import QualityReport, measure
from .refinement import Refinement, refine
from .spline.body import Body, BodyLike
from .surface.surface import Surface
from .time_limit import closing
from .training.backend import choose_device, choose_precision
from .transfer import transferred
from .ways.mapping_task import MappingTask
from .ways.strategy import WAYS, attempts, ways_of
from .ways.tried import AttemptReport, best_of
from .ways.way import Way

MadeCallback = Callable[[BodyLike, dict[str, NDArray[Any]]], None]
_LAST_SLIDES = 20  # of the boundary parameters before the boundary map is made, and again after `_LAST_SWEEPS`
_LAST_SWEEPS = 600  # over the triangles that the last slides flipped, at most: nothing moves after them


@dataclass(frozen=True, eq=False, repr=False)
class Parameterization(Brief):
    """What `parameterize` returns; lengths in the user's units.

    Attributes
    ----------
    volume : BSplineVolume or Body
        The map F of a cube, or of several blocks that are glued.
    boundary : BoundaryMap
        Every surface vertex with its parameters, and the block that they belong to.
    certificate : Certificate
        What is proved of det J.
    quality : QualityReport
        What is measured; printed, a table.
    history : dict of str to array
        Columns of equal length, one row a training step; empty for exact blocks and those of extrusions.
    seconds : dict of str to float
        Wall seconds of train, fit, optimize and certify, the last with quality, at the end: the certificates on the way
        count as optimize; with config.refinement, also those of refine. A map that is not trained has no train.
    device : str
        Where the network was trained.
    seed : int
    config : Config
    origin : str
        The kind of way that made the map: "network", "growth", "sharp", "blocks", "planes" or "stacks"; see
        docs/ways.md.
    attempts : tuple of AttemptReport
        The ways that were tried, in their order, with rounds and seconds by phase and the faults of their maps.
    refinement : Refinement or None
        With config.refinement, how many control points each direction got, or all blocks together, and why no more.
    refused : dict of str to str
        By the names of ways that were asked and do not suit the body: why, such as what the mesher says.
    decomposition : str
        Why the body was to become one cube or several blocks, in words, with the figures that decide; "" if the
        options say it.

    Examples
    --------
    >>> import iga_nn
    >>> config = iga_nn.preset("fast").scaled(0.02).with_control_points(6)  # a quick look
    >>> result = iga_nn.parameterize(iga_nn.sample("cube"), config)
    >>> result.quality.certificate is result.certificate, sorted(result.seconds)
    (True, ['certify', 'fit', 'optimize'])
    """

    volume: BodyLike
    boundary: BoundaryMap
    certificate: Certificate
    quality: QualityReport
    history: dict[str, NDArray[Any]]
    seconds: dict[str, float]
    device: str
    seed: int
    config: Config
    origin: str
    attempts: tuple[AttemptReport, ...]
    refinement: Refinement | None = None
    decomposition: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def division(self) -> str:
        """Return the decomposition, by its earlier name."""
        return str(getattr(self, renamed("parameterize.Parameterization", "division")))


def parameterize(
    surface: Surface,
    config: Config | None = None,
    *,
    seed: int = 0,
    device: str = "auto",
    dtype: str = "float32",
    corners: ArrayLike | None = None,
    ways: Iterable[Way | str] | Way | str = (),
    progress: ProgressCallback | None = None,
    when_made: MadeCallback | None = None,
    checkpoint_dir: str | Path | None = None,
    resume: bool = False,
) -> Parameterization:
    """Map the unit cube onto the solid inside a closed surface (paper, section 4.3), or several blocks.

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
    dtype : str
        Precision of the network: "float32" or "float64".
    corners : (8, 3) array or (8,) array of int, optional
        The cube's corners on the surface: points in the surface's units, which take their nearest vertices, or vertex
        numbers; in the order (0,0,0), (0,0,1), (0,1,0), ..., (1,1,1). Chosen by the method where they are not given.
        They are those of one cube: refused for a body with handles, and where `config.blocks` asks for several.
    ways : ways or their names, optional
        Those that may be taken, in their order; those of `config` by default. docs/ways.md lists them.
    progress : callable, optional
        Called with a `Progress` at every step.
    when_made : callable, optional
        Called with the volume and the history as soon as they are known; the volume is certified and measured after
        that.
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
        For a surface, config, seed or progress of another type.
    ValueError
        For a negative seed, bad corners, an unknown way, another precision or a device that is not there.
    CheckpointError
        For a checkpoint of another run.
    LayoutError
        For a body with handles if `config.blocks` allows one, or fewer than its skeleton needs; or if none of the ways
        suits it.
    SkeletonError
        For a body with handles whose tunnel is knotted, or that has too thin a part.
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
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function of a Progress, or None, got {progress!r:.80}")
    asked = ways_of(ways) or ways_of(config.ways)
    config = replace(config, ways=tuple(way.name for way in asked))
    place, dtype = choose_device(device), choose_precision(dtype)
    given = given_corners(surface, corners, config)
    config = config if given is None else config.holding_edges()
    identity = identity_of(surface, config, seed=seed, device=place, dtype=dtype, corners=given)
    checkpoints = Checkpoints(None if checkpoint_dir is None else Path(checkpoint_dir), identity, resume=resume)
    history, seconds = History(), dict[str, float]()
    report: dict[str, Any] = {"history": history, "progress": progress or ignore}
    with timed(seconds, "fit"):
        copy, _ = surface.fitted
        held = given if given is None or copy is surface else corner_vertices(copy, surface.vertices[given])
    task = MappingTask(copy, config, seed, place, dtype, held, seconds, report, checkpoints)
    tried, decomposition = attempts(task, asked or WAYS, checkpoints)
    best = best_of(tried)
    assert best is not None, "at least one of the attempts has a map"
    way, attempt = best
    found, fit, refinement = attempt.found, attempt.fit, None
    if config.refinement is not None:
        with timed(seconds, "refine"):
            options = config.spline, config.refinement, attempt.weights
            found, fit, refinement = refine(found, fit, *options, checkpoints=checkpoints, **report)
    with closing():  # a time limit that is reached now does not lose the map
        with timed(seconds, "optimize"):
            body, boundary = _in_users_units(found, fit, task)
            if copy is not surface:
                boundary = transferred(boundary, body, surface)
        steps = history.arrays()
        if when_made is not None:
            when_made(body.simplest, steps)
        with timed(seconds, "certify"):
            certificate = certify(body)  # of the body in the user's units: bringing it there rounds
            proofs = certificate, check_boundary(body)
            quality = measure(body, surface.vertices, surface.faces, surface.scale, boundary, *proofs, surface.sharp)
    return Parameterization(
        volume=body.simplest,
        boundary=boundary,
        certificate=certificate,
        quality=quality,
        history=steps,
        seconds=seconds,
        device=place,
        seed=seed,
        config=config,
        origin=way.origin,
        attempts=tuple(one.report() for one in tried),
        refinement=refinement,
        decomposition=decomposition,
        refused=task.refused,
    )


def identity_of(
    surface: Surface,
    config: Config,
    *,
    seed: int,
    device: str,
    dtype: str = "float32",
    corners: IntArray | None = None,
) -> dict[str, Any]:
    """Return the identity of a run: the content of its surface and all its options.

    Runs whose identities are equal, see `checkpoint.differing`, make the same map. device: "cpu" or "cuda". corners:
    (8,), vertex numbers.
    """
    return {
        "surface": hashlib.sha256(surface.vertices.tobytes() + surface.faces.tobytes()).hexdigest(),
        "sharp": surface.sharp,
        "config": asdict(config),
        "seed": seed,
        "device": device,
        "dtype": dtype,
        "corners": None if corners is None else corners.tolist(),
    }


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


def given_corners(surface: Surface, corners: ArrayLike | None, config: Config) -> IntArray | None:
    """Return the vertices (8,) of corners that a user gives, None where none are given.

    Raises ValueError for bad corners, see `corner_vertices`, and where the map is not that of one cube.
    """
    if corners is None:
        return None
    if not surface.is_plain:
        raise ValueError("corners are those of one cube, and this body has cavities or several solids: leave them out")
    if surface.genus or (config.blocks or 1) > 1:
        why = f"this body has handles (genus {surface.genus})" if surface.genus else "several blocks are asked for"
        raise ValueError(f"corners are those of one cube, and {why}: leave them out")
    return corner_vertices(surface, corners)


def corner_vertices(surface: Surface, corners: ArrayLike) -> IntArray:
    """Return the vertices (8,) of given corners: 8 vertex numbers, or (8, 3) points that take their nearest ones.

    Raises ValueError unless these are eight different vertices, and for points farther away than the surface is long.
    """
    given = np.asarray(corners)
    if given.shape == (8, 3):
        if not np.all(np.isfinite(given.astype(np.float64))):
            raise ValueError("corners: the coordinates must be finite")
        gaps = np.linalg.norm(surface.vertices[:, None] - given.astype(np.float64), axis=2)
        numbers, far = gaps.argmin(axis=0), int(gaps.min(axis=0).argmax())
        if (away := float(gaps[:, far].min())) > float(np.linalg.norm(np.ptp(surface.vertices, axis=0))):
            raise ValueError(
                f"corners: {in_brackets(given[far])} is {away:.3g} away from the surface, farther than this is long: "
                "give places on the surface, in its units"
            )
    elif given.shape == (8,) and given.dtype.kind in "iu":
        numbers = given.astype(np.int64)
    else:
        raise ValueError(f"corners must be 8 vertex numbers or 8 points of 3 coordinates, got shape {given.shape}")
    if numbers.min() < 0 or numbers.max() >= len(surface.vertices):
        raise ValueError(f"corners: vertex numbers must lie between 0 and {len(surface.vertices) - 1}")
    if len(np.unique(numbers)) != 8:
        raise ValueError("corners: two fall on the same vertex; give eight places farther apart")
    return np.asarray(numbers, dtype=np.int64)


def _in_users_units(found: CertifiedMap, fit: Correspondence, task: MappingTask) -> tuple[Body, BoundaryMap]:
    """Return the map and its boundary map; parameters are first brought close to this map's closest points."""
    surface, spline = task.surface, found.spline
    if not spline.nets.is_single:
        reassign(fit, spline.control)
    sliding = fit.sliding.at_closest_points(spline.control, fit.points, _LAST_SLIDES, _LAST_SWEEPS)
    unit = spline.body
    body = replace(
        unit, patches=tuple(replace(one, control_points=surface.from_unit(one.control_points)) for one in unit)
    )
    if not body.is_single:
        where, blocks = sliding.parameters[: task.own], sliding.blocks[: task.own]
        faces = surface.faces
        boundary = BoundaryMap(surface.vertices, where, faces, part_faces=faces, groups=surface.groups, patches=blocks)
        return body, boundary
    own = np.concatenate([surface.vertices, surface.from_unit(fit.points[task.own :])])
    boundary = boundary_map(body.only, CubeLayout(own, sliding.triangles, sliding.parameters, task.own))
    return body, replace(boundary, part_faces=surface.faces, groups=surface.groups)
