"""From a surface to its volume in a folder: read, announced, trained, written, drawn."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from parameterize.arrays import Array
from parameterize.files import save_arrays
from solve.forms.frame import UnitFrame

from ..errors import InputError, input_errors
from ..models import resolve
from ..options import MapOptions, read_corners
from ..report import advice
from ..report import document as reports
from .cost_estimate import Forecast, forecast
from .machine import available_memory_mb
from .output_folder import CHECKPOINT, RunFolder, has_checkpoint
from .verdict import tell

if TYPE_CHECKING:
    from parameterize.progress import ProgressCallback
    from parameterize.run import Parameterization
    from parameterize.surface.surface import Surface
    from solve import Poisson

log = logging.getLogger(__name__)

_TRIED = 50  # points of the surface


def map_surface(
    state: RunFolder,
    mesh: str | Path,
    options: MapOptions,
    progress: ProgressCallback | None,
    command: str,
    equation: Poisson | None = None,
    unknowns: int = 0,
) -> Parameterization:
    """Parameterize, and leave everything that is known of the map in the folder.

    command: that repeats it. equation, unknowns: what is solved on it afterwards, and how large that is.
    """
    with state.timed("load"):
        surface = resolve(
            str(mesh), component=options.component, max_faces=options.max_faces, decimate=options.decimate
        )
        corners = read_corners(options.corners, _frame(surface)) if options.corners else None
    log.info("%s: %d vertices, %d faces", surface.name, len(surface.vertices), len(surface.faces))
    for notice in surface.notices:
        log.warning("%s: %s", surface.name, notice)
    from parameterize.run import choose_device, corner_vertices

    with input_errors():
        device = choose_device(options.device)
        marks = None if corners is None else surface.vertices[corner_vertices(surface, corners)]
    if equation is not None:
        _check_data(equation, surface)
    if options.resume and not has_checkpoint(state.folder):
        log.info("no checkpoint, starting anew")
    state.begin("map", "solution")
    with state.timed("load"):
        expected = forecast(surface, options.config(), device=device, unknowns=unknowns)
    _announce(expected)
    result = _train(surface, options, corners, progress, state.folder / CHECKPOINT)
    state.seconds.update(result.seconds)
    _write(state, surface, result, command, expected, options)
    defects: dict[str, Any] = {}
    if len(unproved := result.certificate.unproved):
        defects["places"] = advice.span_places(result.volume, unproved)
    if meeting := result.quality.boundary_check.meeting:
        defects["meeting"] = meeting
    state.draw("map", volume=result.volume, history=result.history, marks=marks, **defects)
    return result


def _frame(surface: Surface) -> UnitFrame:
    """What X, Y, Z mean before there is a volume."""
    low, high = surface.bbox
    x, y, z = ((low + high) / 2.0).tolist()
    return UnitFrame((x, y, z), 1.0 / surface.scale)


def _check_data(equation: Poisson, surface: Surface) -> None:
    """What can be known of the data before there are points inside: their values on the surface."""
    from parameterize.surface.geometry import vertex_normals
    from solve.meaning import empty_formulas

    equation = equation.placed(_frame(surface))
    x, y, z = surface.vertices.T
    for evaluate in (equation.boundary_at, equation.source_at, equation.kappa_at, equation.reaction_at):
        evaluate(x, y, z)
    if equation.exact is not None:
        equation.exact_at(x, y, z)
    for _, notice in empty_formulas(equation, surface.vertices.T):
        log.warning("%s", notice)
    normals = vertex_normals(surface.vertices, surface.faces)
    for face in equation.neumann:
        _check_somewhere(partial(equation.flux_at, face), surface.vertices, normals)
    for face in equation.robin:
        _check_somewhere(partial(equation.robin_at, face), surface.vertices, normals)


def _check_somewhere(evaluate: Callable[[Array, Array], object], points: Array, normals: Array) -> None:
    """Raise what `evaluate` raises on all of some points: one face's data need be good on that face alone."""
    from solve import ExpressionError

    refused = None
    for row in np.linspace(0, len(points) - 1, _TRIED).astype(int):
        try:
            evaluate(points[row], normals[row])
            return
        except ExpressionError as error:
            refused = error
    assert refused is not None
    raise refused


def _announce(expected: Forecast) -> None:
    """Say what the run will take, and warn where the machine has not that much memory."""
    log.info("estimate: %s", expected)
    free = available_memory_mb()
    if free is not None and expected.memory_mb > free:
        log.warning(
            "%.1f GB of memory are needed, %.1f GB are free: lower --control-points or --refine, or free some",
            expected.memory_mb / 1000.0,
            free / 1000.0,
        )


def _train(
    surface: Surface, options: MapOptions, corners: Any, progress: ProgressCallback | None, checkpoint: Path
) -> Parameterization:
    from parameterize.checkpoint import CheckpointError
    from parameterize.cube.edge_paths import PathError
    from parameterize.run import parameterize

    try:
        return parameterize(
            surface,
            options.config(),
            seed=options.seed,
            device=options.device,
            corners=corners,
            progress=progress,
            checkpoint_dir=checkpoint,
            resume=options.resume,
        )
    except CheckpointError as error:
        raise InputError(str(error)) from None
    except PathError as error:
        raise InputError(f"{surface.name}: {error}; train longer, or give --corners") from None


def _write(
    state: RunFolder, surface: Surface, result: Parameterization, command: str, expected: Forecast, options: MapOptions
) -> None:
    result.volume.save(state.folder / "volume.npz")
    result.boundary.save(state.folder / "boundary.npz")
    save_arrays(state.folder / "history.npz", **result.history)
    state.write(
        command=command,
        input=surface.summary(),
        config=asdict(result.config),
        estimate=expected.as_dict(),
        seed=options.seed,
        device=result.device,
        versions=reports.versions(),
        parameterization=result.quality.as_dict() | advice.unproved(result.volume, result.certificate),
    )
    tell(state, options)
