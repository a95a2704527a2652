"""Both rooms in order, and the folder they leave: surface -> volume -> solution -> report and figures.

Every file is written as soon as its content is known, so that a late failure costs nothing that was computed before.
"""

from __future__ import annotations

import hashlib
import logging
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from parameterize.files import save_arrays, save_text
from parameterize.volume import BSplineVolume

from . import advice, studies
from . import report as reports
from .command import command_line
from .folder import CHECKPOINT, Outcome, RunFolder, has_checkpoint, open_folder
from .forecast import Forecast, forecast
from .formats import load_volume
from .machine import available_memory_mb
from .options import (
    InputError,
    MapOptions,
    PoissonOptions,
    ProblemOptions,
    StudyOptions,
    check_size,
    input_errors,
    read_corners,
)

if TYPE_CHECKING:
    from parameterize.mesh import Surface
    from parameterize.progress import ProgressCallback
    from parameterize.run import Parameterization
    from solve import Elasticity, Poisson, Solution

log = logging.getLogger(__name__)

MAP_DATA, MAP_PICTURES = ("volume.npz", "boundary.npz", "history.npz"), ("faces", "lines", "cut", "distortion")
MAP_FILES = (*MAP_DATA, "history.png", "history.pdf", *(f"{name}.png" for name in MAP_PICTURES))
DEFECT_FILES = ("folds.png", "meeting.png")
SOLUTION_FILES = ("solution.npz", "convergence.png", "convergence.pdf", "error.png")
STUDY_FILES = ("study.csv", "study.png", "study.pdf")


def run(
    problem: Literal["poisson"],
    mesh: str | Path,
    out: str | Path | None = None,
    *,
    mapping: MapOptions | None = None,
    poisson: PoissonOptions | None = None,
    force: bool = False,
    vector: bool = False,
    progress: ProgressCallback | None = None,
) -> Outcome:
    """From a surface to a solved problem, all files of design in `out` (default: the input's stem).

    mesh: path of a closed surface, or a sample's or model's name.
    vector: write the plots of curves as PDF, too.
    Raises MeshError for a surface that cannot be taken, solve.ExpressionError for a formula, InputError for other
    options and for an output folder that is finished (unless `force`) or cannot be written.
    """
    if problem != "poisson":
        raise InputError(f"problem {problem!r}: only 'poisson' can be solved")
    mapping, poisson = mapping or MapOptions(), poisson or PoissonOptions()
    equation, spline = poisson.problem(), mapping.config().spline
    unknowns = _check_size(BSplineVolume.uniform(np.zeros((spline.control_points,) * 3 + (3,)), spline.degree), poisson)
    with open_folder(mesh, out, force, mapping.resume, vector) as (state, finished):
        if finished and "poisson" not in finished.report:
            volume = finished.folder / "volume.npz"
            raise InputError(
                f"{finished.folder}: holds a finished volume; `iga-nn solve poisson {volume}` solves on it"
            )
        if finished:
            return finished
        command = command_line("run poisson", mesh, mapping, poisson, out=out)
        result = _parameterize(state, mesh, mapping, progress, command, equation, unknowns)
        solution = _solve(state, result.volume, equation, poisson)
        return _finish(state, result.volume, solution, equation)


def parameterize_to(
    mesh: str | Path,
    out: str | Path | None = None,
    *,
    mapping: MapOptions | None = None,
    force: bool = False,
    vector: bool = False,
    progress: ProgressCallback | None = None,
) -> Outcome:
    """From a surface to volume.npz, boundary.npz, history.npz, report.json and figures; raises as `run` does."""
    mapping = mapping or MapOptions()
    with open_folder(mesh, out, force, mapping.resume, vector) as (state, finished):
        if finished:
            return finished
        command = command_line("parameterize", mesh, mapping, out=out)
        result = _parameterize(state, mesh, mapping, progress, command)
        return _finish(state, result.volume)


def solve_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    problem: ProblemOptions | None = None,
    force: bool = False,
    vector: bool = False,
    device: str = "cpu",
) -> Outcome:
    """Solve on a saved volume: solution.npz, report.json, figures; raises as `run` does. On the CPU without torch.

    device: where Poisson's linear system is solved, "cpu" or "cuda".
    """
    from solve import Poisson, check_device, check_problem

    options = problem or PoissonOptions()
    equation = options.problem()
    path = Path(volume)
    loaded = load_volume(path)
    _check_size(loaded, options)
    with input_errors():
        check_problem(loaded, equation)
        if isinstance(equation, Poisson):
            check_device(device, equation)
    with open_folder(path, out, force, vector=vector) as (state, _):
        state.begin(*SOLUTION_FILES)
        elsewhere = {"device": device} if device != "cpu" else {}
        command = command_line(f"solve {options.section}", path, options, **elsewhere, out=out)
        _write_certificate(state, path, loaded, command)
        solution = _solve(state, loaded, equation, options, **elsewhere)
        if len(equation.dirichlet) < 6:  # the user names faces: show which is which
            _draw(state, lambda plotting: plotting.draw_face_names(state.folder, loaded))
        return _finish(state, loaded, solution, equation)


def study_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    options: StudyOptions | None = None,
    force: bool = False,
    vector: bool = False,
) -> tuple[Outcome, str]:
    """A convergence study on a saved volume: study.csv, study.png, report.json, and the table.

    Takes and raises what `run` does.
    """
    from solve import check_problem, convergence

    options = options or StudyOptions()
    equation, levels, path = options.problem(), options.levels(), Path(volume)
    loaded = load_volume(path)
    degrees = sorted(options.degree) or [max(loaded.degrees)]
    for degree in degrees:
        check_size(loaded, levels[-1], degree)
    with input_errors():
        check_problem(loaded, equation)
    with open_folder(path, out or f"{path.name.split('.')[0]}-study", force, vector=vector) as (state, _):
        state.begin(*STUDY_FILES)
        _write_certificate(state, path, loaded, command_line("study", path, options, out=out))
        verdict = state.report["parameterization"]["bijective"]
        study = {}
        with state.timed("solve"), input_errors():
            for degree in degrees:
                study[degree] = convergence(loaded, equation, levels, degree, certified=verdict)
                log.info("degree %d: done", degree)
        save_text(state.folder / "study.csv", studies.as_csv(study))
        state.write(study={"exact": equation.exact, "levels": studies.rows_of(study)})
        _draw(state, lambda plotting: plotting.draw_levels(state.folder, "study", study, state.endings))
        return _finish(state, loaded), studies.as_table(study)


def check_surface(
    mesh: str, component: int | None, max_faces: int, decimate: bool = False, strict: bool = False
) -> dict[str, Any]:
    """The section `input` of report.json for a surface that is accepted; raises MeshError where it is not.

    decimate: bring a larger surface down to max_faces. strict: refuse a surface that intersects itself, too.
    """
    surface = _load(mesh, component, max_faces, decimate)
    if strict:
        surface.refuse_crossings()
    return surface.summary()


def check_volume(path: str | Path) -> dict[str, Any]:
    """The certificate of a saved volume. Raises InputError for a file that is none."""
    return _certify(load_volume(path))


def _write_certificate(state: RunFolder, path: Path, volume: BSplineVolume, command: str) -> None:
    """Certify a saved volume, and write the sections of report.json that say what was given."""
    with state.timed("certify"):
        certificate = _certify(volume)
    log.info("certificate: %s", certificate["bijective"])
    _warn_of_meeting(certificate)
    state.write(
        command=command,
        input={"file": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()},
        versions=reports.versions(),
        parameterization=certificate,
    )
    _advise(state)


def _parameterize(
    state: RunFolder,
    mesh: str | Path,
    options: MapOptions,
    progress: ProgressCallback | None,
    command: str,
    equation: Poisson | None = None,
    unknowns: int = 0,
) -> Parameterization:
    config = options.config()
    with state.timed("load"):
        surface = _load(mesh, options.component, options.max_faces, options.decimate)
        corners = read_corners(options.corners) if options.corners else None
    log.info("%s: %d vertices, %d faces", surface.name, len(surface.vertices), len(surface.faces))
    for notice in surface.notices:
        log.warning("%s: %s", surface.name, notice)
    from parameterize.checkpoint import CheckpointError
    from parameterize.corners import PathError
    from parameterize.run import choose_device, corner_vertices, parameterize

    with input_errors():
        device = choose_device(options.device)
        marks = None if corners is None else surface.vertices[corner_vertices(surface, corners)]
    if equation is not None:  # what can be known of its data before there are points inside
        x, y, z = surface.vertices.T
        equation.boundary_at(x, y, z)
        equation.source_at(x, y, z)
        equation.kappa_at(x, y, z)
        equation.reaction_at(x, y, z)
    if options.resume and not has_checkpoint(state.folder):
        log.info("no checkpoint, starting anew")
    state.begin(*MAP_FILES, *DEFECT_FILES, *SOLUTION_FILES)
    with state.timed("load"):
        expected = _announce(forecast(surface, config, device=device, unknowns=unknowns))
    checkpoint = state.folder / CHECKPOINT
    try:
        result = parameterize(
            surface,
            config,
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
    state.seconds.update(result.seconds)
    result.volume.save(state.folder / "volume.npz")
    result.boundary.save(state.folder / "boundary.npz")
    save_arrays(state.folder / "history.npz", **result.history)
    state.write(
        command=command,
        input=surface.summary(),
        config=asdict(config),
        estimate=expected.as_dict(),
        seed=options.seed,
        device=result.device,
        versions=reports.versions(),
        parameterization=result.quality.as_dict() | advice.unproved(result.volume, result.certificate),
    )
    _advise(state, options)
    log.info("certificate: %s", result.certificate.verdict)
    _warn_of_meeting(state.report["parameterization"])
    shutil.rmtree(checkpoint, ignore_errors=True)  # the files above replace it
    _draw(state, lambda plotting: plotting.draw_map(state.folder, result.volume, result.history, state.endings, marks))
    _draw(
        state,
        lambda plotting: plotting.draw_defects(
            state.folder,
            result.volume,
            advice.span_places(result.volume, result.certificate.unproved),
            result.quality.boundary_check.meeting,
        ),
    )
    return result


def _solve(
    state: RunFolder,
    volume: BSplineVolume,
    equation: Poisson | Elasticity,
    options: ProblemOptions,
    **solver: Any,
) -> Solution:
    """Solve on every level, write what is known of all and the finest solution, and return that."""
    from solve import Poisson, rates, solve_problem

    verdict = state.report["parameterization"]["bijective"]
    solutions: list[Solution] = []
    with state.timed("solve"):
        for level in sorted(set(options.refine)):
            if solutions and isinstance(equation, Poisson):
                solver["start"] = solutions[-1]
            with input_errors():
                solution = solve_problem(
                    volume, equation, refine=level, degree=options.degree, certified=verdict, **solver
                )
            solutions.append(solution)
            log.info("solved, refined %d times: %s", level, str(solution.report).splitlines()[0])
            solution.save(state.folder / "solution.npz")  # the finest so far
    found = [solution.report for solution in solutions]
    section = {
        **{name: given for name, given in asdict(options).items() if given and name not in ("refine", "degree")},
        **({"exact": equation.exact} if isinstance(equation.exact, str) else {}),  # the default one, too
        "levels": [item.as_dict() for item in found],
        "rates": rates(found),
        "notices": list(dict.fromkeys(notice for item in found for notice in item.notices)),  # each once
    }
    state.write(**{options.section: section})
    if equation.exact is not None:
        _draw(state, lambda plotting: plotting.draw_solution(state.folder, volume, solutions, equation, state.endings))
    return solutions[-1]


def _finish(
    state: RunFolder,
    volume: BSplineVolume,
    solution: Solution | None = None,
    equation: Poisson | Elasticity | None = None,
) -> Outcome:
    """Close the report, and write the page that shows it."""
    from . import page
    from .scene import scene_of

    with state.timed("report"):
        scene = scene_of(volume, solution, equation)
    outcome = state.finish()
    page.write(outcome.folder, outcome.report, scene)
    return outcome


def _announce(expected: Forecast) -> Forecast:
    """Say what the run will take, and warn where the machine has not that much memory."""
    log.info("estimate: %s", expected)
    free = available_memory_mb()
    if free is not None and expected.memory_mb > free:
        log.warning(
            "%.1f GB of memory are needed, %.1f GB are free: lower --control-points or --refine, or free some",
            expected.memory_mb / 1000.0,
            free / 1000.0,
        )
    return expected


def _check_size(volume: BSplineVolume, options: ProblemOptions) -> int:
    """The largest problem's unknowns."""
    return check_size(volume, max(options.refine), options.degree, 3 if options.section == "elasticity" else 1)


def _load(mesh: str | Path, component: int | None, max_faces: int, decimate: bool) -> Surface:
    from parameterize import mesh_decimate
    from parameterize.mesh import MAX_FACES

    from .data import resolve

    if not decimate:
        return resolve(str(mesh), component=component, max_faces=max_faces)
    surface = resolve(str(mesh), component=component, max_faces=max(max_faces, MAX_FACES))
    return mesh_decimate.decimate(surface, max_faces)


def _certify(volume: BSplineVolume) -> dict[str, Any]:
    """What the section `parameterization` of report.json says of a volume alone."""
    from parameterize.certificate import certify
    from parameterize.injective import check_boundary

    certificate = certify(volume)
    return {
        "control_points": list(volume.shape),
        "degrees": list(volume.degrees),
        "bijective": certificate.verdict,
        **check_boundary(volume).as_dict(),
        "det_lower_bound": certificate.lower_bound,
        "witness": certificate.witness,
        **advice.unproved(volume, certificate),
    }


def _advise(state: RunFolder, options: MapOptions | None = None) -> None:
    """Where the map is not certified, write what to try."""
    if remedies := advice.what_to_try(state.report, options):
        state.write(advice=remedies)


def _warn_of_meeting(quality: dict[str, Any]) -> None:
    """Say where the boundary meets itself: the map is not one-to-one although nowhere folded."""
    if meeting := quality["boundary_meeting"]:
        place = ", ".join(f"{x:.6g}" for x in meeting["point"])
        log.warning("the volume overlaps itself: its boundary passes twice through (%s)", place)


def _draw(state: RunFolder, draw: Callable[[Any], None]) -> None:
    """Figures, timed; importing matplotlib and VTK takes part of it."""
    from . import plotting

    with state.timed("report"):
        draw(plotting)
