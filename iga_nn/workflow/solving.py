"""Solves a problem on the volume of an output folder, level after level, and writes the results."""

import logging
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from itertools import zip_longest
from typing import Any

import numpy as np

from solve import ConvergenceError, ConvergenceRow, Modes, SolveOptions, SolveReport, rates, solve_with
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.condition import WITH_FACTOR, Condition
from solve.forms.frame import UnitFrame
from solve.solution import MultiPatchSolution, Solution

from ..errors import InputError, input_errors, one_line
from ..figures.evaluate import Body, fields_on
from ..options import NO_UNITS, ProblemOptions, Units
from ..report import document as reports
from ..report import html
from ..report.extremes import growth_notices
from .output_folder import RunFolder

log = logging.getLogger(__name__)

Found = Solution | MultiPatchSolution


def solve_levels(
    state: RunFolder,
    body: Body,
    problem: BoundaryValueProblem,
    statement: ProblemOptions,
    options: SolveOptions,
) -> Found:
    """Solve level after level, write the report of all levels, and return the finest solution.

    solution.npz holds the finest solution so far.
    """
    options = replace(options, certified=verdict_of(state))
    solutions: list[Found] = []
    levels: list[dict[str, Any]] = []
    with reported(state, body), state.timed("solve"):
        for solution in each_level(body, problem, statement.refine, options):
            solution.save(state.folder / "solution.npz")
            solutions.append(solution)
            levels.append(level_of(solution))
    found = [solution.report for solution in solutions]
    growth = growth_notices({**asdict(statement), "levels": levels}) if problem.exact is None else []
    for notice in growth:
        log.warning("%s", notice)
    asked = {name: given for name, given in asdict(statement).items() if name not in ("refine", "degree")}
    known = asked | described(problem, body)
    state.write(
        **{
            statement.section: {name: value for name, value in known.items() if value is not None and value != ()}
            | ({"regions": regions_of(problem, found[-1])} if problem.conditions else {})
            | {"levels": levels, "rates": rates(found), "notices": [*notices_of(found), *growth]}
        }
    )
    _draw(state, body, solutions, problem, statement.units)
    if len(problem.dirichlet) < 6 or problem.patch_faces:  # the user names faces: show which is which
        state.draw("solution", named_volume=body)
    _write_cells(state, solutions[-1])
    return solutions[-1]


def level_of(solution: Found) -> dict[str, Any]:
    """Return a level of report.json: the report of its solve and the extremes, where the solution has finite ones."""
    level, extremes = solution.report.as_dict(), {}
    started = time.process_time()
    try:
        extremes = {name: found.as_dict() for name, found in solution.all_extremes().items()}
    except ValueError as error:  # not finite: the solver broke down, or det J is zero somewhere
        log.info("no extremes: %s", one_line(error))
    seconds = level["seconds"] | {"extremes": time.process_time() - started}
    return level | {"extremes": extremes, "seconds": seconds}


def each_level(
    body: Body, problem: BoundaryValueProblem, levels: Sequence[int], options: SolveOptions
) -> Iterator[Found]:
    """Solve level after level and yield the solutions; the solve of a scalar problem starts at the last solution.

    All processes of an MPI job call this together.
    """
    for level in sorted(levels):
        try:
            with input_errors():
                solution = solve_with(body, problem, replace(options, refine=level))
        except MemoryError:
            remedy = "free some, lower --refine, or share the solve: mpiexec -n 4 iga-nn solve ... --mpi"
            raise InputError(f"refine {level}: the memory does not suffice; {remedy}") from None
        log.info("solved, refined %d times: %s", level, str(solution.report).splitlines()[0])
        yield solution
        if problem.form.components == 1:
            options = replace(options, start=solution)


@contextmanager
def reported(state: RunFolder, body: Body) -> Iterator[None]:
    """Write the page without a solution, and the reason into the report, where the block does not solve the problem."""
    try:
        yield
    except (InputError, ConvergenceError) as error:
        state.wait_for_figures()
        state.write(not_solved=one_line(error))
        known = reports.plain(state.report | {"seconds": state.seconds})
        html.write(state.folder, known, scene_of(state, body))
        raise


def verdict_of(state: RunFolder) -> str:
    """Return the verdict on det J, which every solve on the volume repeats."""
    return str(state.report["parameterization"]["bijective"])


def _write_cells(state: RunFolder, solution: Found) -> None:
    """Write solution.vtu, where the solution is finite; a failure does not end the run."""
    if not is_finite(solution):
        return
    with state.timed("report"), state.drawing("solution.vtu"):
        from ..io import view

        spans = view.write_solution(state.folder / "solution.vtu", solution)
        if spans > 1:
            every = "`iga-nn export --to view --samples 1` writes one for each"
            log.info("solution.vtu: a cell stands for %d x %d x %d elements; %s", spans, spans, spans, every)


def is_finite(solution: Found) -> bool:
    """Return whether all coefficients of a solution are finite; they are not after a failure of the solver."""
    return all(bool(np.all(np.isfinite(field.coefficients))) for field in fields_on(solution))


def _draw(
    state: RunFolder, body: Body, solutions: Sequence[Found], problem: BoundaryValueProblem, units: Units
) -> None:
    """Draw the solution, its error where the exact solution is known, and the convergence of several levels.

    Solutions with coefficients that are not finite, after a failure of the solver, are not drawn.
    """
    if not all(map(is_finite, solutions)):
        return
    known: dict[str, Any] = {"volume": body, "solution": solutions[-1], "units": units}
    if problem.exact is not None:
        known["problem"] = problem
        if len(solutions) > 1:
            rows = [ConvergenceRow(solution.report, None, None) for solution in solutions]
            known["levels"] = {max(max(field.degrees) for field in fields_on(solutions[-1])): rows}
    if problem.conditions:
        known["conditions"] = (problem.placed(UnitFrame.of(body)) if problem.is_scaled else problem).conditions
    state.draw("solution", **known)


def regions_of(problem: BoundaryValueProblem, report: SolveReport) -> list[dict[str, Any]]:
    """Return the conditions of a problem for a report: the kind, the region and the data as text, and the area.

    Whole faces of the cube have no area.
    """
    areas = report.balance.areas if report.balance else {}
    return [
        {"kind": condition.kind, "region": str(condition.region), "data": _as_text(condition)}
        | ({"area": areas[condition.role]} if condition.role in areas else {})
        for condition in problem.conditions
    ]


def _as_text(condition: Condition) -> str:
    """Return data as text; for an exchange or a spring the factor, and the value outside where it is not zero."""
    if condition.kind in WITH_FACTOR:
        factor, outside = map(_joined, condition.data)
        return (
            factor if condition.kind == "spring" and condition.data[1] == [0.0] * 3 else f"{factor}, outside {outside}"
        )
    return _joined(condition.data, condition.free)


def _joined(data: Any, free: Sequence[bool] = ()) -> str:
    """Return a formula or a number, or the entries of a vector with semicolons between them."""
    if isinstance(data, list | tuple):
        held = zip_longest(data, free, fillvalue=False)
        return ";".join("free" if is_free else _joined(entry) for entry, is_free in held)
    if data is None:
        return "that of the exact solution"
    return f"{data:.12g}" if isinstance(data, float) else str(data)


def described(problem: BoundaryValueProblem, body: Body) -> dict[str, Any]:
    """Return the entries of a problem in the report beside its options: the exact solution and the frame of X, Y, Z."""
    given: dict[str, Any] = {"exact": problem.exact} if isinstance(problem.exact, str) else {}
    return given | ({"frame": UnitFrame.of(body).as_dict()} if problem.is_scaled else {})


def notices_of(found: Iterable[SolveReport]) -> list[str]:
    """Return the notices of some solves, each once."""
    return list(dict.fromkeys(notice for item in found for notice in item.notices))


def scene_of(state: RunFolder, body: Body, *solved: Any, units: Units = NO_UNITS) -> Any:
    """Return the interactive view of a body and a solution on it; None where it cannot be drawn."""
    with state.timed("report"), state.drawing("interactive view"):
        from ..report import viewer

        return viewer.scene_of(body, *solved, units=units)
    return None


def moving_scene_of(state: RunFolder, body: Body, found: Modes) -> Any:
    """Return the view in which a body swings in its modes; None where it cannot be drawn."""
    with state.timed("report"), state.drawing("interactive view"):
        from ..report import viewer

        named = enumerate(zip(found.frequencies, found.shapes, strict=True), start=1)
        frames = [viewer.Frame.of(f"mode {i}: {hertz:.4g} Hz", shape) for i, (hertz, shape) in named]
        return viewer.scene_of_frames(body, frames, oscillates=True)
    return None
