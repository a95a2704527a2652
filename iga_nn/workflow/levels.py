"""Holds the levels that a problem was solved on so far, and keeps them for a run that goes on with the next one."""

import logging
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from parameterize.checkpoint import Checkpoints
from parameterize.files import digest
from parameterize.spline.body import BodyLike
from solve import Answer, Grading, SolveReport
from solve.discretization.error_norms import Errors
from solve.field import BodyField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.reactions import Balance
from solve.solution import LoadStep, Solution

from ..io.solutions import SOLUTION, VOLUME, solution_on
from ..options import UNITS, ProblemOptions
from ..report import document as reports

log = logging.getLogger(__name__)

_CHECKPOINT = "solve"


@dataclass
class Levels:
    """Hold the levels that are done, coarsest first.

    refine: how many times each one halves the spans. entries: what report.json has of them. finest: the last solution.
    grading: where an accuracy is wanted, the breakpoints of its space. refinement: how that ended, the section
    `refinement` of report.json; empty before.
    """

    refine: list[int] = field(default_factory=list)
    entries: list[dict[str, Any]] = field(default_factory=list)
    reports: list[SolveReport] = field(default_factory=list)
    finest: Solution | None = None
    grading: Grading | None = None
    refinement: dict[str, Any] = field(default_factory=dict)

    def add(self, refine: int, entry: dict[str, Any], solution: Solution) -> None:
        """Add a level with its entry of report.json and its solution."""
        self.refine.append(refine)
        self.entries.append(entry)
        self.reports.append(solution.report)
        self.finest = solution

    def missing(self, asked: Iterable[int]) -> str:
        """Return in words which of the levels that were asked for are done, and which is missing; "" for none done."""
        if not self.refine:
            return ""
        if self.grading is not None:
            return f"{self.in_words} done, the accuracy is not reached"
        rest = sorted(asked)[len(self.refine) :]
        return f"{self.in_words} is complete, refine {_listed(rest)} is missing"

    @property
    def in_words(self) -> str:
        """Return which levels are done."""
        if self.grading is None:
            return f"refine {_listed(self.refine)}"
        return f"{len(self.refine)} steps towards the accuracy"


@dataclass(frozen=True, eq=False)
class KeptLevels:
    """Keep the levels of a run in a checkpoint, whose solution is the file in the output folder.

    folder: the output folder. checkpoints: those of the run's map. problem_options: the options of the problem.
    """

    folder: Path
    checkpoints: Checkpoints
    problem_options: ProblemOptions

    @property
    def _asked(self) -> dict[str, Any]:
        """Return the options on which the numbers of a level depend, as plain JSON values."""
        return {name: reports.plain(value) for name, value in self.problem_options.values("refine", *UNITS).items()}

    @property
    def steps(self) -> Checkpoints:
        """Return the checkpoints of load steps, which belong to this problem on this map."""
        return self.checkpoints.with_options({"asked": self._asked, "volume": digest(self.folder / VOLUME)})

    def save(self, done: Levels) -> None:
        """Keep the levels whose finest solution the output folder holds."""
        state = {"asked": self._asked, "refine": done.refine, "entries": reports.plain(done.entries)}
        state |= {"reports": [reports.plain(asdict(report)) for report in done.reports]}
        state |= {"solution": digest(self.folder / SOLUTION), "volume": digest(self.folder / VOLUME)}
        state |= {"grading": None if done.grading is None else done.grading.as_dict}
        self.checkpoints.save(_CHECKPOINT, {}, state)

    def load(self, body: BodyLike, problem: BoundaryValueProblem) -> Levels:
        """Return the levels that are kept; none where others were asked for, or where the solution is not theirs.

        Raises CheckpointError for a checkpoint of another run.
        """
        saved = self.checkpoints.load(_CHECKPOINT)
        if saved is None:
            return Levels()
        _, state = saved
        refine = state["refine"]
        levels = self.problem_options.levels
        is_graded = self.problem_options.wanted is not None
        if state["asked"] != self._asked or refine != [*levels, *levels * len(refine) * is_graded][: len(refine)]:
            log.info("the levels that are done are those of another problem: all are solved anew")
            return Levels()
        if state["volume"] != digest(self.folder / VOLUME):
            log.info("the map has changed since: all levels are solved anew")
            return Levels()
        if state["solution"] != digest(self.folder / SOLUTION):
            log.info("%s is not the solution of the last level: all are solved anew", self.folder / SOLUTION)
            return Levels()
        found = [_report(values) for values in state["reports"]]
        finest = solution_on(BodyField.load(self.folder / SOLUTION), body, problem, found[-1])
        grading = Grading.from_dict(body, state["grading"]) if is_graded else None
        done = Levels(refine, state["entries"], found, finest, grading)
        log.info("%s: solved before the interruption", done.in_words)
        return done


def _listed(levels: Iterable[int]) -> str:
    return ", ".join(map(str, levels))


def _report(values: dict[str, Any]) -> SolveReport:
    """Return the report of a solve from the values of its fields."""
    parts = {name: Errors(**values[name]) if values[name] else None for name in ("errors", "estimate")}
    given: dict[str, Any] = values | parts | {name: tuple(values[name]) for name in ("notices", "residuals")}
    if balance := values["balance"]:
        reactions = {name: tuple(row) for name, row in balance["reactions"].items()}
        given["balance"] = Balance(**balance | {"load": tuple(balance["load"]), "reactions": reactions})
    given["load_steps"] = tuple(LoadStep(**step) for step in values["load_steps"])
    given["asked"] = tuple(Answer(**entry | {"at": entry["at"] and tuple(entry["at"])}) for entry in values["asked"])
    return SolveReport(**given)
