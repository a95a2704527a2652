"""Makes the volume of a surface in an output folder: reads, announces, trains, writes and draws."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.checkpoint import CheckpointError, Checkpoints, differing
from parameterize.compilation import compilation_told
from parameterize.files import array_names, digest, load_arrays, save_arrays
from parameterize.progress import ProgressCallback
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.solids import PatchSolids
from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.geometry import normals_and_areas, vertex_normals
from parameterize.surface.surface import Surface
from parameterize.time_limit import closing
from solve import ExpressionError
from solve.diagnostics import empty_formulas
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.frame import UnitFrame
from solve.forms.owners import demand_owners

from ..errors import InputError, input_errors
from ..io.formats import load_volume
from ..models import resolve
from ..options import MapOptions
from ..report import document as reports
from ..report.advice import unproved_places, with_unproved
from ..report.artifacts import SOLVED
from ..rounding import rounded
from .cost_estimate import Forecast, before_layout, forecast, span_in_words, warn_of_memory
from .output_folder import CHECKPOINT, RunFolder, changed_file, has_checkpoint
from .pace import pace
from .regions import check_regions, frame_of
from .time_limit import checked, for_later, stopped_in_words
from .verdict import tell

if TYPE_CHECKING:
    from parameterize.run import MadeCallback, Parameterization

log = logging.getLogger(__name__)

_OF_MAP = ("volume.npz", "boundary.npz", "history.npz")
_OF_THE_END = ("not_solved", "incomplete", "cut_map", "not_drawn")  # entries of a report that a run takes up again
_TRIED = 50  # points of the surface
_CORNERS_BYTES = 65_536
_LARGEST_COORDINATE = 1e100  # distances of larger ones overflow
_LARGEST_WHOLE = 2**53  # beyond it not every whole number is a float64


@dataclass(frozen=True, eq=False)
class MapInput:
    """Hold the input of a training, and the identity of the map.

    corners: vertices or points. marks: (8, 3), the points of the corners, for figures. identity: the content of the
    surface and the options of the map; equal identities give equal maps.
    """

    surface: Surface
    corners: Any
    marks: Array | None
    identity: dict[str, Any]


def read_input(mesh: str | Path, mapping: MapOptions, finished: reports.Report | None = None) -> MapInput:
    """Check the options, and read the surface and the corners. Raises MeshError and InputError.

    finished: the report of a result that may be that of this run. Then the device need not exist here, and "auto" is
    the device of that result, because another machine may have computed it.
    """
    from parameterize.run import given_corners, identity_of

    config = mapping.config()
    if finished is None:
        from parameterize.training.backend import choose_device

        with input_errors():
            device = choose_device(mapping.device)
    else:
        device = finished.get("device", "") if mapping.device == "auto" else mapping.device
    with compilation_told():
        surface = resolve(str(mesh), **mapping.reading())
    corners = read_corners(Path(mapping.corners), frame_of(surface)) if mapping.corners else None
    with input_errors():
        vertices = given_corners(surface, corners, config)
    marks = None if vertices is None else surface.vertices[vertices]
    return MapInput(
        surface, corners, marks, identity_of(surface, config, seed=mapping.seed, device=device, corners=vertices)
    )


def map_surface(
    state: RunFolder,
    given: MapInput,
    mapping: MapOptions,
    progress: ProgressCallback | None,
    known: dict[str, Any],
    problem: BoundaryValueProblem | None = None,
    unknowns: int = 0,
    levels: Sequence[int] = (),
) -> Parameterization:
    """Parameterize a surface, write all results on the map into the folder, and return it.

    known: the command that repeats the run and the identity of the run, for the report. problem, unknowns, levels: the
    problem that is solved on the map, its number of unknowns, and the levels that it is solved on.
    """

    def made(body: BodyLike, history: dict[str, Any]) -> None:
        state.begin("map", "solution")  # files that stay until the checkpoint of a resumed run is accepted
        state.write(**known)  # first, so that files which a full disk or a kill leaves belong to a run
        _draw(state, given, body, history)

    with compilation_told():
        expected = _prepare(state, given, mapping, problem, unknowns, levels)
        with for_later(is_solved=problem is not None):
            result = _train(given, mapping, checked(progress), made, state.folder / CHECKPOINT)
    with closing():
        state.seconds.update(result.seconds)
        _write(state, given, expected, result, mapping)
        _draw_defects(state, result)
    return result


def kept_map(
    state: RunFolder, given: MapInput, known: dict[str, Any], problem: BoundaryValueProblem | None
) -> BodyLike | None:
    """Return the certified map that an interrupted run of the same options has left; None where there is none.

    Its report is taken over, and its figures are drawn, because the interruption may have come before them. The
    arguments are those of `map_surface`.
    """
    report = reports.read(state.folder)
    if report is None or not _is_of_map(report, given):
        return None
    if name := changed_file(state.folder, report, _OF_MAP):
        log.info("%s is not that of the report: the map is made anew", state.folder / name)
        return None
    if problem is not None:
        _check_data(problem, given.surface)
    state.report = {name: value for name, value in report.items() if name not in (*SOLVED, *_OF_THE_END)}
    state.seconds.update(state.report.pop("seconds"))
    state.sweep()
    state.write(**known)
    log.info("%s: the map is there, and kept", state.folder)
    body = load_volume(state.folder / "volume.npz")
    history = state.folder / "history.npz"
    _draw(state, given, body, load_arrays(history, tuple(array_names(history))))
    return body


def _is_of_map(report: reports.Report, given: MapInput) -> bool:
    """Return whether a report tells of a finished map with this identity that is certified.

    One that a time limit has cut short is none: its rounds go on.
    """
    if "parameterization" not in report or not reports.is_certified(report) or "cut_map" in report:
        return False
    found = {name: report.get("identity", {}).get(name) for name in given.identity}
    return not differing(reports.plain(given.identity), found)


def _prepare(
    state: RunFolder,
    given: MapInput,
    mapping: MapOptions,
    problem: BoundaryValueProblem | None,
    unknowns: int,
    levels: Sequence[int],
) -> Forecast:
    """Check the problem's data on the surface, announce the cost of the run, and return it.

    The folder is cleared once all input is accepted; in a resumed run, only once its map is there, because the
    checkpoint may be refused.
    """
    surface = given.surface
    log.info("%s: %d vertices, %d faces", surface.name, len(surface.vertices), len(surface.faces))
    for notice in _notices(surface):
        log.warning("%s: %s", surface.name, notice)
    if problem is not None:
        _check_data(problem, surface)
    checkpoints = None
    if is_resumed := mapping.resume and has_checkpoint(state.folder):
        checkpoints = _checkpoints(state.folder / CHECKPOINT, given)
    else:
        state.begin("map", "solution")
    if mapping.resume and not is_resumed:
        log.info("no checkpoint, starting anew")
    with state.timed("load"):
        before = None if is_resumed else before_layout(surface, pace())
        if before is not None:
            said = "the layout of its blocks comes first, and an interruption before it ends loses it"
            log.info("estimate before the layout: about %s; %s", span_in_words(*before), said)
        expected = forecast(
            surface.fitted[0],
            mapping.config(),
            device=given.identity["device"],
            unknowns=unknowns,
            levels=levels,
            components=1 if problem is None else problem.form.components,
            corners=given.identity["corners"],
            checkpoints=checkpoints,
        )
        expected = replace(expected, before=before)
    log.info("estimate: %s", expected)
    needed = f"{rounded(expected.memory_mb / 1000.0, 1)} GB of memory are needed"
    warn_of_memory(expected.memory_mb, needed, "lower --control-points or --refine, or free some")
    return expected


def _thickness(surface: Surface) -> float:
    """Return the mean thickness of a body: twice its volume over its area, which is that of a thin plate."""
    return 2.0 * surface.volume / float(normals_and_areas(surface.vertices, surface.faces)[1].sum())


def _notices(surface: Surface) -> list[str]:
    """Return the notices of a surface, and that on the copy it is fitted on."""
    return [*surface.notices, *filter(None, [surface.fitted[1]])]


def _checkpoints(folder: Path, given: MapInput) -> Checkpoints:
    """Return the checkpoints of a run that resumes. Raises InputError for those of another run."""
    checkpoints = Checkpoints(folder, given.identity, resume=True)
    try:
        checkpoints.check()
    except CheckpointError as error:
        raise InputError(str(error)) from None
    return checkpoints


def read_corners(path: Path, frame: UnitFrame | None = None) -> Array | IntArray:
    """Return eight points (8, 3) in the surface's units or eight vertex numbers (8,) from a JSON file.

    frame: the frame of the surface; where it is known, the file may contain {"XYZ": [...]}, points in scaled
    coordinates. Raises InputError.
    """
    try:
        with path.open(encoding="utf-8") as stream:
            given = json.loads(stream.read(_CORNERS_BYTES))
        scaled = frame if isinstance(given, dict) and list(given) == ["XYZ"] else None
        rows = np.array(given["XYZ"] if scaled else given, dtype=object)
        if any(isinstance(number, bool) for number in rows.flat):
            raise TypeError
        rows = np.array(rows.tolist(), dtype=np.float64)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (ValueError, TypeError, OverflowError, RecursionError):
        expected = 'a JSON list of eight points or of eight vertex numbers, or {"XYZ": eight points}'
        raise InputError(f"{path}: corners must be {expected}") from None
    if rows.shape not in ((8, 3), (8,)):
        raise InputError(
            f"{path}: corners must be eight points of three coordinates or eight vertex numbers, "
            f"found an array of shape {rows.shape}"
        )
    if len(beyond := rows[~(np.abs(rows) <= _LARGEST_COORDINATE)]):  # NaN is one of them
        raise InputError(
            f"{path}: the numbers of corners must be finite and at most {_LARGEST_COORDINATE:g} in magnitude, "
            f"found {beyond[0]:g}"
        )
    if rows.shape == (8, 3):
        return scaled.to_units(rows) if scaled else rows
    if scaled:
        raise InputError(f"{path}: XYZ must hold eight points of three coordinates; vertex numbers stand in a list")
    if np.any(rows != np.rint(rows)) or np.abs(rows).max() > _LARGEST_WHOLE:
        raise InputError(f"{path}: vertex numbers must be whole and at most {_LARGEST_WHOLE}")
    return rows.astype(np.int64)


def _check_data(problem: BoundaryValueProblem, surface: Surface) -> None:
    """Check the problem's data on the surface, because no points inside are known yet.

    Raises ExpressionError, and InputError for names of solids that are not those of the surface.
    """
    problem = problem.placed(frame_of(surface))
    points = surface.vertices.T
    with input_errors():
        parts = _of_solids(problem, surface)
    for own, inside in parts:
        if own.exact is not None:
            own.exact_at(inside)
        for evaluate in (own.source_at, own.form.tensor, own.form.mass):
            evaluate(inside)
    for _, notice in empty_formulas(problem, points):
        log.warning("%s", notice)
    normals = vertex_normals(surface.vertices, surface.faces)
    if problem.conditions:
        with input_errors():
            check_regions(problem.on_surface(surface.part), surface)
        return
    for face in FACE_NAMES:
        if face in problem.dirichlet:
            problem.boundary_at(points, face)
        else:
            _check_somewhere(partial(problem.on_face, face), surface.vertices, normals)


def _of_solids(problem: BoundaryValueProblem, surface: Surface) -> list[tuple[BoundaryValueProblem, Array]]:
    """Return the problem of each solid of a surface with the solid's vertices (3, m); none of data by patch.

    Patches have numbers once the map exists. Raises ValueError for names of solids that are not those of the surface.
    """
    if not problem.by_patch:
        return [(problem, surface.vertices.T)]
    if not all(isinstance(owner, str) for owners in problem.by_patch.values() for owner in owners):
        return []
    names = surface.solids if len(surface.solids) > 1 else ()  # the map of one solid does not keep its name
    solids = PatchSolids.of(PatchSolids(surface.owners, names), len(surface.faces))
    for name, owners in problem.by_patch.items():
        demand_owners(name, owners, solids)
    rows = [np.unique(surface.faces[solids.numbers == number]) for number in range(len(solids.labels))]
    return [
        (problem.of_patch(0, label), surface.vertices[row].T) for label, row in zip(solids.labels, rows, strict=True)
    ]


def _check_somewhere(evaluate: Callable[[Array, Array], object], points: Array, normals: Array) -> None:
    """Raise the ExpressionError that `evaluate` raises at all points: a face's data need only be valid on that face."""
    refused = None
    for row in np.linspace(0, len(points) - 1, _TRIED).astype(int):
        try:
            evaluate(points[row], normals[row])
            return
        except ExpressionError as error:
            refused = error
    assert refused is not None
    raise refused


def _train(
    given: MapInput,
    mapping: MapOptions,
    progress: ProgressCallback | None,
    made: MadeCallback,
    checkpoint: Path,
) -> Parameterization:
    """Train, and return the map. Raises InputError for a checkpoint of another run, and for corners without paths.

    made: `when_made` of `parameterize`.
    """
    from parameterize.cube.edge_paths import PathError
    from parameterize.layouts.rods.along_skeleton import LayoutError
    from parameterize.layouts.skeleton.graph import SkeletonError
    from parameterize.run import parameterize

    try:
        return parameterize(
            given.surface,
            mapping.config(),
            seed=mapping.seed,
            device=mapping.device,
            corners=given.corners,
            progress=progress,
            when_made=made,
            checkpoint_dir=checkpoint,
            resume=mapping.resume,
        )
    except CheckpointError as error:
        raise InputError(str(error)) from None
    except (SkeletonError, LayoutError) as error:
        raise InputError(f"{given.surface.name}: {error}") from None
    except PathError as error:
        raise InputError(f"{given.surface.name}: {error}; train longer, or give --corners") from None


def _write(
    state: RunFolder, given: MapInput, expected: Forecast, result: Parameterization, mapping: MapOptions
) -> None:
    """Write the files of the map, and the report on it."""
    result.volume.save(state.folder / "volume.npz")
    result.boundary.save(state.folder / "boundary.npz")
    save_arrays(state.folder / "history.npz", **result.history)
    state.write(
        input=given.surface.summary() | {"notices": _notices(given.surface), "thickness": _thickness(given.surface)},
        config=asdict(result.config),
        estimate=asdict(expected),
        files={name: digest(state.folder / name) for name in _OF_MAP},
        seed=mapping.seed,
        device=result.device,
        versions=reports.versions(),
        **({"cut_map": said} if (said := stopped_in_words()) else {}),
        parameterization=with_unproved(result.quality.as_dict(), as_body(result.volume), result.certificate)
        | {"origin": result.origin, "decomposition": result.decomposition, "division": result.decomposition}
        | ({"refused": dict(result.refused)} if result.refused else {})
        | {"attempts": [asdict(attempt) for attempt in result.attempts]}
        | ({"refinement": asdict(result.refinement)} if result.refinement else {}),
    )
    tell(state, mapping)


def _draw(state: RunFolder, given: MapInput, body: BodyLike, history: dict[str, Any]) -> None:
    """Draw the map, its blocks, and the course of the training: beside the run they are done before the solve is."""
    known: dict[str, Any] = {} if as_body(body).is_single else {"blocks": body}
    if len(next(iter(history.values()))):  # exact blocks have no steps
        known["history"] = history
    state.draw("map", volume=body, marks=given.marks, **known)


def _draw_defects(state: RunFolder, result: Parameterization) -> None:
    """Draw the places without a proof and the places where the map meets itself, if there are any."""
    if len(places := unproved_places(as_body(result.volume), result.certificate)):
        state.draw("map", faulty=result.volume, places=places)
    if meeting := result.quality.boundary_check.meeting:
        state.draw("map", faulty=result.volume, meeting=meeting)
