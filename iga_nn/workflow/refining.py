"""Solves step after step until an accuracy is reached, on spans that are finer where it counts."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from parameterize.spline.body import BodyLike
from solve import Grading, Solution, SolveOptions
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.refinement.adaptive import refinement_of
from solve.refinement.loop import Limits

from ..errors import InputError, input_errors
from ..rounding import rounded
from .cost_estimate import available_memory_mb, solve_memory
from .levels import Levels

log = logging.getLogger(__name__)

RAISED = 3.0  # times the memory of a solve: the raised one beside it has some two times as many unknowns


def each_step(
    body: BodyLike, problem: BoundaryValueProblem, accuracy: float, options: SolveOptions, done: Levels
) -> Iterator[tuple[int, dict[str, Any], Solution]]:
    """Yield each step: how often all spans are halved before the first, its entry in report.json, and its solution.

    done: the steps of an interrupted run, after the last of which this one goes on. It gets the grading of each step,
    and in the end what became of the accuracy.
    """
    count, first = len(done.refine), options.refine
    limits = Limits(memory=lambda wanted: _lacking(body, problem, wanted))
    if done.grading is not None:
        options = replace(options, grading=done.grading, refine=0)
    with _refused():
        refinement = refinement_of(body, problem, options, accuracy, limits)
        refinement.start, refinement.is_solved = done.finest, done.grading is not None
        for step in refinement.steps():
            if refinement.is_solved:  # solved before the interruption
                continue
            done.grading = step.grading
            said = str(step.solution.report).splitlines()
            log.info("solved, step %d: %s", count, said[len(step.solution.answers)])
            more = {"graded": count, "energy_error": step.energy_error, "spans": _range(step.grading)}
            yield first, more, step.solution
            count += 1
    done.refinement = {"accuracy": accuracy, "reached": not refinement.stopped, "steps": count}
    if refinement.stopped:
        done.refinement["stopped"] = refinement.stopped
        log.warning("%s", *stopped_notice(done.refinement))


@contextmanager
def _refused() -> Iterator[None]:
    """Turn errors of a first step into InputError."""
    try:
        with input_errors():
            yield
    except MemoryError:
        raise InputError("the memory does not suffice for the first step: free some, or lower --degree") from None


def stopped_notice(found: dict[str, Any]) -> list[str]:
    """Return the notice on an accuracy that is not reached; none where it is, or none was wanted."""
    if "stopped" not in found:
        return []
    return [f"accuracy {100.0 * found['accuracy']:g} % is not reached in {found['steps']} steps: {found['stopped']}"]


def _range(grading: Grading) -> list[int]:
    """Return the least and the largest number of spans of a sheet."""
    return [min(grading.spans), max(grading.spans)]


def _lacking(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions) -> str:
    """Return in words how much memory a step lacks; "" where it has enough, or where that is not known."""
    wanted, free = RAISED * solve_memory(body, problem, options).on(1), available_memory_mb()
    if free is None or wanted <= free:
        return ""
    return f"the next step takes {rounded(wanted / 1000.0, 1)} GB of memory, {rounded(free / 1000.0, 1)} GB are free"
