"""Carries a run from the surface to the finished output folder: surface -> volume -> solution -> report and figures.

Every file is written as soon as its content is known, so that a late failure loses nothing that was computed before.
"""

import logging
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack, nullcontext
from dataclasses import asdict, replace
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.checkpoint import Checkpoints, differing
from parameterize.files import digest, save_text
from parameterize.progress import ProgressCallback
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import BSplineVolume
from parameterize.time_limit import OutOfTime, closing
from solve import ConvergenceRow, Solution, SolveOptions, check_device, check_problem, convergence, modes
from solve.asked.functional import functional
from solve.discretization.processes import agreed
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.study import with_rates

from ..errors import InputError, input_errors
from ..io.formats import load_volume, volume_file
from ..level_table import Study, as_csv, as_table, rows_of
from ..options import (
    NO_UNITS,
    PROBLEMS,
    MapOptions,
    ModesOptions,
    PoissonOptions,
    ProblemOptions,
    StudyOptions,
    Units,
    check_size,
)
from ..options.load_steps import LoadStepOptions
from ..report import asked, html
from ..report import document as reports
from ..type_check import check_type
from .command_line import command_line
from .cost_estimate import tell_memory
from .levels import KeptLevels
from .mapping import kept_map, map_surface, read_input
from .output_folder import (
    CHECKPOINT,
    Outcome,
    RunFolder,
    changed_file,
    default_folder,
    has_checkpoint,
    open_folder,
)
from .painter import Painter
from .regions import check_asks
from .solving import (
    described,
    each_level,
    in_units,
    moving_scene_of,
    notices_of,
    reported,
    scene_of,
    solve_levels,
    verdict_of,
)
from .time_limit import clock
from .verdict import stays_unsolved, write_certificate

log = logging.getLogger(__name__)


def run(
    problem: str,
    mesh: str | Path,
    out: str | Path | None = None,
    *,
    mapping: MapOptions | None = None,
    force: bool = False,
    vector: bool = False,
    progress: ProgressCallback | None = None,
    time_limit: float | str | None = None,
    **given: ProblemOptions | None,
) -> Outcome:
    """Parameterize a surface, solve a problem on the volume and return the output folder with its report.

    Parameters
    ----------
    problem : str
        "poisson" or "elasticity".
    mesh : str or Path
        Path of a closed surface, or the name of a sample or a model.
    out : str or Path, optional
        The output folder, by default the input's stem in the current folder; docs/output.md lists its files.
    mapping : MapOptions, optional
        How the surface becomes a volume.
    force : bool
        Replace a finished result in that folder.
    vector : bool
        Write plots of curves as PDF, too.
    progress : callable, optional
        Called with a `Progress` at every step.
    time_limit : float or str, optional
        Seconds, or a time such as "10min", after which the run ends with the best result that it has; its report says
        what is `incomplete`, and a run with `mapping.resume` goes on.
    **given : PoissonOptions or ElasticityOptions
        Options of the problem, under its name: poisson=PoissonOptions(...).

    Returns
    -------
    Outcome
        Its `folder`, a Path, and its `report`, the content of report.json.

    Raises
    ------
    MeshError
        For a surface that is not accepted.
    ExpressionError
        For a formula that is refused.
    InputError
        For other options, and for an output folder that holds a result (unless `force`) or cannot be written.
    TimeLimitError
        Where the time limit is reached before there is a map.

    Examples
    --------
    >>> import iga_nn
    >>> quick = iga_nn.MapOptions(steps_factor=0.02, control_points=6)
    >>> outcome = iga_nn.run("poisson", "cube", "out", mapping=quick, poisson=iga_nn.PoissonOptions(refine=(0,)))
    >>> [level["dofs"] for level in outcome.report["poisson"]["levels"]], (outcome.folder / "report.html").exists()
    ([216], True)
    """
    how: dict[str, Any] = {"force": force, "vector": vector, "progress": progress, "time_limit": time_limit}
    return parameterize_to(mesh, out, mapping=mapping, problem_options=chosen(problem, given), **how)


def chosen(problem: str, given: Mapping[str, ProblemOptions | None]) -> ProblemOptions:
    """Return the options of a problem from keywords, which have its name. Raises InputError for others."""
    check_type("problem", problem, str)
    if problem not in PROBLEMS:
        raise InputError(f"problem {problem!r}: choose one of {', '.join(PROBLEMS)}")
    if others := [name for name, value in given.items() if value is not None and name != problem]:
        raise InputError(f"{others[0]}: is no option of a run of {problem}; give {problem}=...")
    problem_options = given.get(problem) or PROBLEMS[problem]()
    check_type(problem, problem_options, PROBLEMS[problem])
    return problem_options


def parameterize_to(
    mesh: str | Path,
    out: str | Path | None = None,
    *,
    mapping: MapOptions | None = None,
    problem_options: ProblemOptions | None = None,
    force: bool = False,
    vector: bool = False,
    progress: ProgressCallback | None = None,
    painter: Painter | None = None,
    time_limit: float | str | None = None,
) -> Outcome:
    """Parameterize a surface and, where a problem is given, solve it on the volume, as `run` does.

    painter: a process beside the run that draws the figures.
    """
    mapping = mapping or MapOptions()
    check_type("mapping", mapping, MapOptions)
    check_type("mesh", mesh, str | Path)
    check_type("out", out, str | Path | None)
    check_type("progress", progress, Callable | None)
    problem, unknowns = (None, 0) if problem_options is None else checked(mapping, problem_options)
    with clock(time_limit), open_folder(mesh, out, force, mapping.resume, vector) as state:
        state.painter = painter
        with state.timed("load"):
            given = read_input(mesh, mapping, state.finished.report if state.finished else None)
        identity = _identity(given.identity, problem_options)
        if state.finished:
            return _finished_by(identity, state.finished, vector, problem_options)
        known = {"command": _command(mesh, out, mapping, problem_options), "identity": identity}
        body = kept_map(state, given, known, problem) if mapping.resume else None
        options = None if problem_options is None else problem_options.solve_options()
        if body is None:
            if options is not None:
                with input_errors():
                    check_asks(options.ask, given.surface)
            levels = () if problem_options is None else problem_options.levels
            body = map_surface(state, given, mapping, progress, known, problem, unknowns, levels).volume
        if problem_options is None or problem is None or options is None:
            return _finish(state, body)
        if stays_unsolved(state, problem_options.solve_anyway):
            return _finish(state, body)
        problem, options = with_part(problem, options, state.folder / "volume.npz")
        kept = KeptLevels(
            state.folder, Checkpoints(state.folder / CHECKPOINT, given.identity, resume=True), problem_options
        )
        return _solved(state, body, problem, problem_options, options, kept)


def _solved(
    state: RunFolder,
    body: BodyLike,
    problem: BoundaryValueProblem,
    problem_options: ProblemOptions,
    options: SolveOptions,
    kept: KeptLevels | None,
) -> Outcome:
    """Solve the levels, and finish the report; where a time limit ends the first one, with the map alone."""
    try:
        solution = solve_levels(state, body, problem, problem_options, options, kept)
    except OutOfTime:
        return _finish(state, body)
    return _finish(state, body, solution, problem, in_units(state, problem_options).units)


def _command(
    mesh: str | Path, out: str | Path | None, mapping: MapOptions, problem_options: ProblemOptions | None
) -> str:
    """Return the command that repeats such a run."""
    if problem_options is None:
        return command_line("parameterize", mesh, mapping, out=out)
    return command_line(f"run {problem_options.section}", mesh, mapping, problem_options, out=out)


def _identity(of_map: dict[str, Any], problem_options: ProblemOptions | None) -> dict[str, Any]:
    """Return the identity of a run, as plain JSON values: that of its map, and the options of its problem."""
    return reports.plain(
        of_map | ({} if problem_options is None else {problem_options.section: problem_options.values()})
    )


def checked(mapping: MapOptions, problem_options: ProblemOptions) -> tuple[BoundaryValueProblem, int]:
    """Return the problem of a run and its number of unknowns on the finest mesh. Raises InputError."""
    problem, degree = problem_options.problem(), mapping.config().spline.degree
    blank = BSplineVolume.uniform(np.zeros((mapping.most_control_points,) * 3 + (3,)), degree)
    return problem, check_size(blank, max(problem_options.levels), problem_options.degree, problem.form.components)


def finished_run(
    mesh: str | Path,
    out: str | Path,
    mapping: MapOptions,
    problem_options: ProblemOptions | None,
    *,
    vector: bool = False,
) -> Outcome | None:
    """Return the finished result of `parameterize_to` in its folder, None where there is none.

    Raises InputError where another run made the result, or where some of its files are missing or were changed.
    """
    report = reports.read(Path(out))
    if report is None or not reports.is_finished(report):
        return None
    identity = _identity(read_input(mesh, mapping, report).identity, problem_options)
    return _finished_by(identity, Outcome(Path(out), report), vector, problem_options)


def solve_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    problem_options: ProblemOptions | None = None,
    force: bool = False,
    vector: bool = False,
    device: str = "cpu",
    comm: Any = None,
    resume: bool = False,
    time_limit: float | str | None = None,
) -> Outcome | None:
    """Solve a problem on a saved volume and return the output folder with its report.

    resume: go on after the levels that an interrupted solve in the same folder has done.

    device: the device for the linear system, "cpu" or "cuda"; torch is not needed on the CPU. comm: a
    communicator of mpi4py whose processes all call this function and share the solve; the first process writes the
    folder, the others return None. The other options and the errors are those of `run`.
    """
    check_type("volume", volume, str | Path)
    problem_options, path = problem_options or PoissonOptions(), volume_file(volume)
    if comm is not None and device != "cpu":
        raise InputError(f"device {device!r}: --mpi runs on the CPU; leave one of them out")
    if comm is not None and problem_options.wanted is not None:
        raise InputError("--accuracy refines in one process: leave --mpi out")
    if comm is not None and (resume or time_limit is not None):
        raise InputError("--resume and --time-limit are for solves in one process: leave --mpi out")
    if comm is not None and isinstance(problem_options, LoadStepOptions):
        raise InputError(f"solve {problem_options.section} takes its load steps in one process: leave --mpi out")
    problem, options = with_part(problem_options.problem(), problem_options.solve_options(), path)
    loaded, options = load_volume(path), replace(options, device=device, comm=comm)
    processes = 1 if comm is None else comm.size
    if comm is not None and processes == 1:
        log.warning("--mpi in a single process: `mpiexec -n 4 iga-nn solve ... --mpi` takes four")
    check_size(loaded, options.refine, options.degree, problem.form.components, processes)
    with input_errors():
        check_problem(loaded, problem, comm)
        check_device(device, problem)
        for ask in options.ask:
            functional(ask, problem, loaded)
    tell_memory(loaded, problem, options)
    how: dict[str, Any] = {"device": device} if device != "cpu" else {"mpi": True} if comm is not None else {}
    command = command_line(f"solve {problem_options.section}", path, problem_options, **how, out=out)
    kept = None
    with ExitStack() as stack:
        stack.enter_context(clock(time_limit))
        with agreed(comm) if comm is not None else nullcontext():  # no process waits for one whose folder is refused
            state = None
            if comm is None or comm.rank == 0:
                state = stack.enter_context(open_folder(path, out, force, resume, vector))
                identity = {"volume": digest(path), "surface": digest(path.with_name("boundary.npz"))}
                if state.finished:
                    return _finished_by(_identity(identity, problem_options), state.finished, vector, problem_options)
                if not (resume and has_checkpoint(state.folder)):
                    state.begin("solution")
                checkpoints = Checkpoints(state.folder / CHECKPOINT, identity, resume=resume)
                with input_errors():
                    checkpoints.check()
                kept = None if comm is not None else KeptLevels(state.folder, checkpoints, problem_options)
                write_certificate(state, path, loaded, command, _identity(identity, problem_options))
        unsolved = state is not None and stays_unsolved(state, problem_options.solve_anyway)
        unsolved = unsolved if comm is None else comm.bcast(unsolved)
        if unsolved:
            return None if state is None else _finish(state, loaded)
        if state is None:
            deque(each_level(loaded, problem, problem_options, problem_options.levels, options), maxlen=0)
            return None
        return _solved(state, loaded, problem, problem_options, options, kept)


def with_part(
    problem: BoundaryValueProblem, options: SolveOptions, volume: Path
) -> tuple[BoundaryValueProblem, SolveOptions]:
    """Return a problem and options whose regions know the original surface of a volume: boundary.npz, which is beside.

    Raises InputError where regions name faces or groups of that surface, and the file does not exist.
    """
    beside = volume.with_name("boundary.npz")
    is_needed = problem.needs_surface or any(ask.region is not None and ask.region.needs_surface for ask in options.ask)
    if not (problem.conditions or options.ask) or not (is_needed or beside.is_file()):
        return problem, options
    from parameterize.cube.boundary_map import read_part

    if not beside.is_file():
        needed = "regions by faces of the part, such as 'bore 1', face4, face(x, y, z) or group:NAME, need it"
        raise InputError(f"{beside}: is not there, and {needed}: keep it beside the volume, or use x, y, z, nx, ny, nz")
    with input_errors():
        part = read_part(beside)
        return problem.on_surface(part), replace(options, ask=tuple(ask.placed(surface=part) for ask in options.ask))


def study_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    problem_options: ProblemOptions | None = None,
    study_options: StudyOptions | None = None,
    force: bool = False,
    vector: bool = False,
    time_limit: float | str | None = None,
) -> tuple[Outcome, str]:
    """Make a convergence study on a saved volume; return the output folder with its report, and the table.

    problem_options: the problem, with its exact solution; its meshes are those of `study_options`. The other options
    and the errors are those of `run`.
    """
    check_type("volume", volume, str | Path)
    study_options, path = study_options or StudyOptions(), volume_file(volume)
    problem_options = problem_options or PoissonOptions()
    levels, is_known = (
        study_options.levels(),
        bool(problem_options.exact) or isinstance(problem_options, PoissonOptions),
    )
    if not path.exists():
        raise InputError(f"{path}: no such file")
    problem = problem_options.problem() if is_known else None
    if problem is None or problem.exact is None:
        raise InputError("no solution to compare with: give it as --exact 'x*y', of a body as --exact 'x*y;sin(z);x'")
    loaded = load_volume(path)
    degrees = sorted(study_options.degree) or [max(max(patch.degrees) for patch in as_body(loaded))]
    for degree in degrees:
        check_size(loaded, levels[-1], degree, problem.form.components)
    with input_errors():
        check_problem(loaded, problem)
    folder = f"{default_folder(path)}-study" if out is None else out
    with clock(time_limit), open_folder(path, folder, force, vector=vector) as state:
        state.begin("study")
        command = "study" if isinstance(problem_options, PoissonOptions) else f"study {problem_options.section}"
        write_certificate(state, path, loaded, command_line(command, path, problem_options, study_options, out=out))
        if stays_unsolved(state, problem_options.solve_anyway):
            return _finish(state, loaded), ""
        known = described(problem, loaded) | ({"exact": problem_options.exact} if problem_options.exact else {})
        study: dict[int, list[ConvergenceRow]] = {}

        def missing() -> str:
            count = len(degrees) * len(levels) - sum(map(len, study.values()))
            return f"{count} of the solves are missing, those before are complete" if study else ""

        def show() -> tuple[()]:
            if study:
                state.draw("study", study=study)
            return ()

        with reported(state, loaded, missing, show), state.timed("solve"), input_errors():
            for degree, level in product(degrees, levels):
                solved = convergence(loaded, problem, (level,), degree, certified=verdict_of(state))
                before = [row.report for row in study.get(degree, [])]
                study[degree] = with_rates([*before, *(row.report for row in solved)])
                _write_study(state, study, known)
                log.info("degree %d, refine %d: solved", degree, level)
        show()
        return _finish(state, loaded), as_table(study)


def _write_study(state: RunFolder, study: Study, known: dict[str, Any]) -> None:
    """Write the table of a study, as far as it is solved, and its section of the report."""
    save_text(state.folder / "study.csv", as_csv(study))
    notices = notices_of(row.report for row in chain(*study.values()))
    state.write(study=known | {"levels": rows_of(study), "notices": notices})


def modes_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    modes_options: ModesOptions | None = None,
    force: bool = False,
    vector: bool = False,
    time_limit: float | str | None = None,
) -> tuple[Outcome, str]:
    """Find the lowest vibrations of a saved volume; return the output folder with its report, and their table.

    The other options are those of `run`. Raises the errors of `run`, and ConvergenceError.
    """
    check_type("volume", volume, str | Path)
    modes_options, path = modes_options or ModesOptions(), volume_file(volume)
    body, _ = with_part(modes_options.problem(), SolveOptions(), path)
    asks, loaded = modes_options.asks(), load_volume(path)
    check_size(loaded, modes_options.refine, modes_options.degree, body.form.components)
    folder = f"{default_folder(path)}-modes" if out is None else out
    with clock(time_limit), open_folder(path, folder, force, vector=vector) as state:
        state.begin("modes")
        write_certificate(state, path, loaded, command_line("modes", path, modes_options, out=out))
        if stays_unsolved(state, modes_options.solve_anyway):
            return _finish(state, loaded), ""
        with reported(state, loaded), state.timed("solve"), input_errors():
            found = modes(
                loaded,
                body,
                modes_options.densities,
                modes_options.number,
                refine=modes_options.refine,
                degree=modes_options.degree,
                ask=asks,
            )
        found.save(state.folder / "modes.npz")
        state.write(modes=asdict(modes_options) | found.as_dict())
        state.draw("modes", volume=loaded, modes=found)
        table = "\n".join([*asked.lines(state.report), str(found)])
        return _finish(state, loaded, scene=moving_scene_of(state, loaded, found)), table


def _finished_by(
    identity: dict[str, Any], finished: Outcome, vector: bool, problem_options: ProblemOptions | None
) -> Outcome:
    """Return the finished result that a resumed run of this identity finds.

    Raises InputError where another run made the result, or where some of its files are missing or were changed.
    """
    folder, made_by, known = finished.folder, finished.report.get("command", ""), finished.report.get("identity")
    unfit = reports.why_not_solved(finished.report)
    if (
        problem_options is not None
        and problem_options.section not in finished.report
        and (problem_options.solve_anyway or not unfit)
    ):
        path, anyway = folder / "volume.npz", " --solve-anyway" if unfit else ""
        command = f"iga-nn solve {problem_options.section} {path}{anyway}"
        raise InputError(f"{folder}: holds a finished volume; `{command}` solves on it")
    if known is None or (names := differing(identity, known)):
        why = ", whose report has no identity" if known is None else f" (different: {', '.join(names)})"
        remedy = "--force replaces it, --out names another folder"
        raise InputError(f"{folder}: holds the result of `{made_by}`{why}; {remedy}")
    is_map = "config" in finished.report  # of a training here
    wanted = ["volume.npz", "boundary.npz"] * is_map + ["solution.npz"] * bool(reports.solved(finished.report))
    if name := changed_file(folder, finished.report, wanted):
        what = "has changed since" if (folder / name).exists() else "is gone from"
        raise InputError(f"{folder}: {name} {what} this finished result; --force makes it anew")
    if vector and is_map and not (folder / "history.pdf").is_file():
        raise InputError(f"{folder}: is finished, without PDFs; leave --vector out, or make it anew with --force")
    log.info("%s: finished already", folder)
    return finished


def _finish(
    state: RunFolder,
    body: BodyLike,
    solution: Solution | None = None,
    problem: BoundaryValueProblem | None = None,
    units: Units = NO_UNITS,
    scene: Any = None,
) -> Outcome:
    """Finish the report, write the page that shows it and return the output folder; a time limit does not end this."""
    with closing():
        scene = scene or scene_of(state, body, solution, problem, units=units)
        return state.finish(lambda folder, report: html.write(folder, report, scene))
