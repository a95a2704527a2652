"""Solves a problem on the volume of an output folder, level after level, and writes the results."""

import logging
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from parameterize.checkpoint import Checkpoints
from parameterize.spline.body import BodyLike, as_body
from parameterize.time_limit import OutOfTime, closing, cut_short
from solve import ConvergenceRow, Modes, Solution, SolveOptions, SolveReport, rates
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.frame import UnitFrame
from solve.load_path import InterruptedPath

from ..errors import InputError, expected_errors, input_errors, one_line
from ..figures.fields import NAMED
from ..io.solutions import SOLUTION
from ..options import NO_UNITS, ProblemOptions, Units, check_size
from ..report import document as reports
from ..report import html
from ..report.extremes import peak_notices
from .cost_estimate import span_in_words
from .levels import KeptLevels, Levels
from .output_folder import RunFolder
from .pace import level_seconds, pace
from .refining import each_step, stopped_notice
from .time_limit import demand_time, for_page, is_late

log = logging.getLogger(__name__)


def solve_levels(
    state: RunFolder,
    body: BodyLike,
    problem: BoundaryValueProblem,
    problem_options: ProblemOptions,
    options: SolveOptions,
    kept: KeptLevels | None = None,
) -> Solution:
    """Solve level after level, write the report of all levels, and return the finest solution.

    Each level is in report.json, and its solution in solution.npz, as soon as it is done. Where a later one is
    interrupted or fails, the page, the figures and solution.vtu are those of the finest that is done. A time limit ends
    the levels with what is done; it raises OutOfTime only if nothing is. kept: the levels
    of an interrupted run, and the place for those of this one; None where no run can go on from them.
    """
    options, problem_options = replace(options, certified=verdict_of(state)), in_units(state, problem_options)
    done = kept.load(body, problem) if kept else Levels()
    if done.refine:
        state.write(**{problem_options.section: section_of(problem_options, problem, body, done)})
    if problem.form.components == 1:
        options = replace(options, start=done.finest)

    def show() -> tuple[Any, ...]:
        return _show(state, body, done, problem, problem_options) if done.refine else ()

    def missing() -> str:
        return done.missing(problem_options.refine)

    with reported(state, body, missing, show), state.timed("solve"):
        try:
            with for_page(body):
                for level, more, solution in _each(body, problem, problem_options, options, done, kept):
                    entry = more | level_of(solution)
                    with closing():
                        solution.save(state.folder / SOLUTION)
                        done.add(level, entry, solution)
                        state.write(**{problem_options.section: section_of(problem_options, problem, body, done)})
                        if kept and is_finite(solution) and not solution.report.interrupted:
                            kept.save(done)
        except OutOfTime as error:
            cut_short("the levels of the solve")
            if not done.refine:
                raise
            state.write(not_solved=f"{one_line(error) or 'the time limit is reached'}; {missing()}")
            log.warning("%s", state.report["not_solved"])
        state.write(**{problem_options.section: section_of(problem_options, problem, body, done)})
    for notice in _peaks(problem_options, problem, done):
        log.warning("%s", notice)
    with closing():
        _show(state, body, done, problem, problem_options)
    assert done.finest is not None  # there is one level at least
    return done.finest


def _each(
    body: BodyLike,
    problem: BoundaryValueProblem,
    problem_options: ProblemOptions,
    options: SolveOptions,
    done: Levels,
    kept: KeptLevels | None,
) -> Iterator[tuple[int, dict[str, Any], Solution]]:
    """Yield the levels that are left: how often spans are halved, what their entry has beside, and the solution."""
    if problem_options.wanted is not None:
        yield from each_step(body, problem, problem_options.wanted, options, done)
        return
    left = problem_options.levels[len(done.refine) :]
    checkpoints = None if kept is None else kept.steps
    solutions = each_level(body, problem, problem_options, left, options, checkpoints)
    for level, solution in zip(left, solutions, strict=True):
        yield level, {}, solution


def section_of(
    problem_options: ProblemOptions, problem: BoundaryValueProblem, body: BodyLike, done: Levels
) -> dict[str, Any]:
    """Return the section of report.json on a problem and the levels that are done."""
    known = problem_options.values("refine", "degree") | described(problem, body)
    notices = [
        *stopped_notice(done.refinement),
        *notices_of(done.reports[-1:] if done.grading else done.reports),
        *_peaks(problem_options, problem, done),
    ]
    asked = [answer.as_dict() for answer in done.reports[-1].asked]
    return (
        ({"asked": asked} if asked else {})
        | {name: value for name, value in known.items() if value is not None and value != ()}
        | ({"regions": regions_of(problem, done.reports[-1])} if problem.conditions else {})
        | ({"refinement": done.refinement} if done.refinement else {})
        | {"levels": done.entries, "rates": rates(done.reports), "notices": notices}
    )


def _peaks(problem_options: ProblemOptions, problem: BoundaryValueProblem, done: Levels) -> list[str]:
    """Return the notices on where stresses are infinite or yet grow; none where the exact solution is known."""
    return peak_notices({**problem_options.values(), "levels": done.entries}) if problem.exact is None else []


def _show(
    state: RunFolder, body: BodyLike, done: Levels, problem: BoundaryValueProblem, problem_options: ProblemOptions
) -> tuple[Solution, BoundaryValueProblem, Units]:
    """Draw the finest solution, write it for ParaView, and return what its view takes."""
    assert done.finest is not None
    _draw(state, body, done, problem, problem_options.units)
    are_named = len(problem.dirichlet) < 6 or problem.patch_faces
    if are_named and len(as_body(body).outer_faces) <= NAMED:  # show which is which
        state.draw("solution", named_volume=body)
    _write_cells(state, done.finest)
    return done.finest, problem, problem_options.units


def level_of(solution: Solution) -> dict[str, Any]:
    """Return a level of report.json: that of its solve, singular places, and extremes if they are finite."""
    level, found = solution.report.as_dict(), dict[str, Any]()
    started = time.process_time()
    try:
        found["singular"] = [place.as_dict() for place in solution.singular]
        found["extremes"] = {name: one.as_dict() for name, one in solution.all_extremes().items()}
    except (ValueError, MemoryError) as error:  # not finite: the solver broke down, or det J is zero somewhere
        log.info("no extremes: %s", one_line(error) or "the memory does not suffice")
    seconds = level["seconds"] | {"extremes": time.process_time() - started}
    return level | {"extremes": {}, "seconds": seconds} | found


def each_level(
    body: BodyLike,
    problem: BoundaryValueProblem,
    problem_options: ProblemOptions,
    levels: Sequence[int],
    options: SolveOptions,
    checkpoints: Checkpoints | None = None,
) -> Iterator[Solution]:
    """Solve level after level and yield the solutions; the solve of a scalar problem starts at the last solution.

    checkpoints: for the load steps of each level. All processes of an MPI job call this together.
    """
    began, unknowns, processes = 0.0, 0, 1 if options.comm is None else options.comm.size
    for level in sorted(levels):
        count = check_size(body, level, options.degree, problem.form.components, processes)
        taken = (time.monotonic() - began) * count / unknowns if unknowns else 0.0
        demand_time(level, taken)
        if type(problem_options).solved is ProblemOptions.solved:  # others keep their load steps
            first = level_seconds(count, problem.form.components, len(as_body(body)))
            _tell_level(level, count, taken or pace() * first)
        began, unknowns = time.monotonic(), count
        steps = Checkpoints.none() if checkpoints is None else checkpoints.of_part(f"level{level}")
        try:
            with input_errors():
                solution = problem_options.solved(body, problem, replace(options, refine=level), steps)
        except InterruptedPath as error:
            yield error.solution  # of the last load step
            raise error.cause from None
        except MemoryError:
            remedy = "free some, lower --refine, or share the solve: mpiexec -n 4 iga-nn solve ... --mpi"
            raise InputError(f"refine {level}: the memory does not suffice; {remedy}") from None
        lines = str(solution.report).splitlines()
        log.info("solved, refined %d times: %s", level, lines[len(solution.answers)])
        yield solution
        if problem.form.components == 1:
            options = replace(options, start=solution)


def _tell_level(level: int, unknowns: int, seconds: float) -> None:
    """Log what a level takes, and what an interruption of it loses."""
    about = span_in_words(seconds, seconds)
    log.info("refine %d: %s unknowns, about %s; an interruption loses this level alone", level, f"{unknowns:,}", about)


@contextmanager
def reported(
    state: RunFolder,
    body: BodyLike,
    missing: Callable[[], str] = str,
    show: Callable[[], tuple[Any, ...]] = tuple,
) -> Iterator[None]:
    """Where the block ends early, write the reason into the report, show what is done, and write the page.

    missing: returns in words what is done and what is not; "" where nothing is done. show: draws what is done, and
    returns what the view of it takes, see `scene_of`.
    """
    try:
        yield
    except (Exception, KeyboardInterrupt) as error:
        if isinstance(error, KeyboardInterrupt) and not isinstance(error, OutOfTime):
            log.warning("interrupted: what is done is written; interrupt again to stop at once")
        said = one_line(error) or "interrupted"
        if not isinstance(error, (*expected_errors(), KeyboardInterrupt)):
            said = f"internal error, {type(error).__name__}: {said}"
        state.write(not_solved=f"{said}; {rest}" if (rest := missing()) else said)
        scene = scene_of(state, body, *show())
        state.wait_for_figures()
        html.write(state.folder, reports.plain(state.report | {"seconds": state.seconds}), scene)
        raise


def in_units(state: RunFolder, problem_options: ProblemOptions) -> ProblemOptions:
    """Return options with the unit of lengths of the input's file, where they name none."""
    given = state.report.get("input", {}).get("unit")
    return replace(problem_options, unit=given) if given and problem_options.unit is None else problem_options


def verdict_of(state: RunFolder) -> str:
    """Return the verdict on det J, which every solve on the volume repeats."""
    return str(state.report["parameterization"]["bijective"])


def _write_cells(state: RunFolder, solution: Solution) -> None:
    """Write solution.vtu, where the solution is finite; a failure does not end the run."""
    if not is_finite(solution):
        return
    with state.timed("report"), state.drawing("solution.vtu"):
        from ..io import view

        spans = view.write_solution(state.folder / "solution.vtu", solution)
        if spans > 1:
            every = "`iga-nn export --to view --samples 1` writes one for each"
            log.info("solution.vtu: a cell stands for %d x %d x %d elements; %s", spans, spans, spans, every)


def is_finite(solution: Solution) -> bool:
    """Return whether all coefficients of a solution are finite; they are not after a failure of the solver."""
    return all(bool(np.all(np.isfinite(field.coefficients))) for field in solution.patches)


def _draw(state: RunFolder, body: BodyLike, done: Levels, problem: BoundaryValueProblem, units: Units) -> None:
    """Draw the finest solution, its error where the exact solution is known, and the convergence of several levels.

    A solution with coefficients that are not finite, after a failure of the solver, is not drawn.
    """
    assert done.finest is not None
    if not is_finite(done.finest):
        return
    known: dict[str, Any] = {"volume": body, "solution": done.finest, "units": units}
    if problem.exact is not None:
        known["problem"] = problem
        if len(done.reports) > 1:
            rows = [ConvergenceRow(report, None, None) for report in done.reports]
            known["levels"] = {max(max(field.degrees) for field in done.finest.patches): rows}
    if steps := done.reports[-1].load_steps:
        known["load_steps"] = steps
    if problem.conditions:
        known["conditions"] = (problem.placed(UnitFrame.of(body)) if problem.is_scaled else problem).conditions
    state.draw("solution", **known)


def regions_of(problem: BoundaryValueProblem, report: SolveReport) -> list[dict[str, Any]]:
    """Return the conditions of a problem for a report: the kind, the region and the data as text, and the area.

    Whole faces of the cube have no area.
    """
    areas = report.balance.areas if report.balance else {}
    return [
        {"kind": condition.kind, "region": str(condition.region), "data": condition.text}
        | ({"area": areas[condition.role]} if condition.role in areas else {})
        for condition in problem.conditions
    ]


def described(problem: BoundaryValueProblem, body: BodyLike) -> dict[str, Any]:
    """Return the entries of a problem in the report beside its options: the exact solution and the frame of X, Y, Z."""
    given: dict[str, Any] = {"exact": problem.exact} if isinstance(problem.exact, str) else {}
    return given | ({"frame": UnitFrame.of(body).as_dict()} if problem.is_scaled else {})


def notices_of(found: Iterable[SolveReport]) -> list[str]:
    """Return the notices of some solves, each once."""
    return list(dict.fromkeys(notice for item in found for notice in item.notices))


def scene_of(
    state: RunFolder,
    body: BodyLike,
    solution: Solution | None = None,
    problem: BoundaryValueProblem | None = None,
    units: Units = NO_UNITS,
) -> Any:
    """Return the interactive view of a body and a solution on it; None where it cannot be drawn, or time is over."""
    if is_late():
        return None
    with state.timed("report"), state.drawing("interactive view"):
        from ..report import viewer

        if units == NO_UNITS:  # of a map alone
            units = Units(length=state.report.get("input", {}).get("unit"))
        return viewer.scene_of(body, solution, problem, units=units)
    return None


def moving_scene_of(state: RunFolder, body: BodyLike, found: Modes) -> Any:
    """Return the view in which a body swings in its modes; None where it cannot be drawn."""
    with state.timed("report"), state.drawing("interactive view"):
        from ..report import viewer

        named = enumerate(zip(found.frequencies, found.shapes, strict=True), start=1)
        frames = [viewer.Frame.of(f"mode {i}: {hertz:.4g} Hz", shape) for i, (hertz, shape) in named]
        return viewer.scene_of_frames(body, frames, oscillates=True)
    return None
