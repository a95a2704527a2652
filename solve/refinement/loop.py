"""Solves, estimates, marks and halves, until an accuracy is reached or something stops it.

A step is a solve on a grading. Its raised solution says which spans of which sheets miss the most (`indicators`), for
an asked quantity in the product with the raised adjoint: what both miss changes the quantity (Becker, Rannacher, *Acta
Numerica* 10, 2001). Those that gain most for each unknown are halved (`marking`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import Body

from ..answer import Answer
from ..asked.adjoint import why_no_adjoint
from ..asked.away import away
from ..asked.functional import Functional
from ..asked.interval import intervals, within
from ..asked.raised import Raised, why_not_raised
from ..discretization.grading import Grading
from ..field import BodyField
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..mixed import MixedSystem
from ..options import SolveOptions
from ..preparation import discretized
from ..solution import Solution
from ..system import System
from .indicators import Elements, along_directions, directional_energies, energies
from .marking import SheetSpans, marked

GROWTH = 2.0  # of the unknowns, a step: all solves together then cost about twice the last one
LEAST_GROWTH = 1.2  # that is worth a step
SAFETY = 0.5  # of what is allowed: the next step is to be the last one, though what it predicts is rough
FREE = 4  # steps; then the radius around singular places stays, or largest values outside of it would grow for ever
STALLED = 4  # steps without progress that end the refinement
PROGRESS = 0.97  # of the least excess so far: less than this is progress
MOST_EXCESS = 1e6
TINY = 1e-300


class _NotEstimatedError(ValueError):
    """A space that has no raised space."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Hold what ends a refinement before its accuracy is reached.

    unknowns: the most of one solve. seconds: of the clock, of all steps. memory: returns in words what a solve lacks,
    "" for nothing; it is asked before each solve but the first.
    """

    unknowns: float = 2e6
    seconds: float = math.inf
    memory: Callable[[SolveOptions], str] = field(default=lambda options: "", repr=False)


@dataclass(frozen=True, eq=False)
class Step:
    """Hold one solve of a refinement.

    Attributes
    ----------
    grading : Grading
        The breakpoints of its trial space.
    solution : Solution
        With its answers.
    energy_error : float
        Estimated error in the energy norm, over the norm of the solution.
    excess : float
        Largest relative half-width of an answer's interval over the accuracy; without asks the relative energy error
        over the accuracy. At 1 or below the accuracy is reached.
    seconds : dict of str to float
        Seconds of the clock: "solve", "estimate".

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> first = iga_nn.adaptive(benchmark_volume(1), iga_nn.Poisson(exact="x*y*z"), 0.01).steps[0]
    >>> first.grading.spans, first.excess == first.energy_error / 0.01
    ((2, 2, 2), True)
    """

    grading: Grading
    solution: Solution
    energy_error: float
    excess: float
    seconds: dict[str, float]


@dataclass
class AdaptiveSolve:
    """Refine a problem on a body step after step; `stopped` then says what ended it, "" for its accuracy.

    grading: of the first step. functionals: the quantities whose accuracy counts, none for the energy. start: where the
    first solve starts, a solution on this grading or a coarser one. is_solved: whether it is the solution of the first
    step, until that step is yielded.
    """

    body: Body
    problem: BoundaryValueProblem
    options: SolveOptions
    grading: Grading
    accuracy: float
    functionals: Sequence[Functional] = ()
    limits: Limits = field(default_factory=Limits)
    start: Solution | None = None
    is_solved: bool = False
    stopped: str = field(init=False, default="")
    _spans: SheetSpans | None = field(init=False, default=None)
    _asked: Sequence[Functional] = field(init=False, default=())
    _count: int = field(init=False, default=0)  # of steps

    def steps(self) -> Iterator[Step]:
        """Yield each step as soon as it is done."""
        began, best, stalled = time.monotonic(), math.inf, 0
        while True:
            options = replace(self.options, refine=0, grading=self.grading, ask=())
            self.stopped = self.limits.memory(options) if self._count else ""
            if self.stopped:
                return
            try:
                step, finer = self._step(options)
            except MemoryError:
                if not self._count:
                    raise
                self.stopped = "the memory does not suffice for the next step"
                return
            except _NotEstimatedError as error:
                if not self._count:
                    raise
                self.stopped = str(error)
                return
            self._count += 1
            yield step
            self.is_solved = False
            stalled = 0 if step.excess < PROGRESS * best else stalled + 1
            best = min(best, step.excess)
            if step.excess <= 1.0:
                return
            self.stopped = self._why_no_more(step, finer, stalled, time.monotonic() - began)
            if self.stopped:
                return
            self.grading, self.start = finer, step.solution

    def _step(self, options: SolveOptions) -> tuple[Step, Grading]:
        """Return a step and the grading of the next one."""
        clock = [time.monotonic()]
        system = discretized(self.body, self.problem, options)
        if why := why_not_raised(system):
            raise _NotEstimatedError(f"the error is not estimated: {why}")
        solution = self._solved(system, options)
        clock.append(time.monotonic())
        raised = Raised.of(system, solution, options)
        missed = _missed(system, raised.system, raised.solution)
        error = math.sqrt(_sum(missed) / max(_sum(_energy(system, raised.system, raised.solution)), TINY))
        if self._count < FREE:
            self._asked = [away(one, solution) for one in self.functionals]
        answers = intervals(system, solution, self._asked, raised)
        before = self.start.report.asked if self.start is not None and not self.is_solved else ()
        if before:
            answers = tuple(_changed(now, last) for now, last in zip(answers, before, strict=True))
        solution = replace(solution, report=replace(solution.report, asked=answers))
        excesses = [_excess(one, self.accuracy) for one in answers] or [error / self.accuracy]
        finer = self._finer(system, raised, missed, excesses)
        clock.append(time.monotonic())
        seconds = dict(zip(("solve", "estimate"), np.diff(clock).tolist(), strict=True))
        return Step(self.grading, solution, error, max(excesses), seconds), finer

    def _solved(self, system: System, options: SolveOptions) -> Solution:
        """Return the solution, which starts at the last one; a solution that is there already is taken."""
        if self.is_solved:
            assert self.start is not None
            return self.start
        start = self.start if self.problem.form.components == 1 else None  # as from level to level
        return system.solve_with(replace(options, start=start, estimate=False))

    def _finer(self, system: System, raised: Raised, missed: Elements, excesses: Sequence[float]) -> Grading:
        """Return the grading of the next step. excesses: of each functional, or that of the energy."""
        worst = [number for number, excess in enumerate(excesses) if excess > 1.0]
        plain, weighed = np.zeros((2, sum(self.grading.spans)))
        for number in worst:
            of_goal = _weighed(missed, self._dual(number, system, raised))
            own = np.concatenate(self.grading.collected(along_directions(of_goal)))
            power = 1.0 if self.functionals else 2.0  # an energy is the square of its norm
            plain += own
            weighed += own * (min(excesses[number], MOST_EXCESS) ** power / max(float(own.sum()), TINY))
        degree = max(max(patch.space.degrees) for patch in system.stated)
        self._spans = SheetSpans.of(self.grading, plain, degree, self._spans)
        counts = np.array([patch.space.shape for patch in system.stated])
        most = self.limits.unknowns / (self.problem.form.components * system.unknowns.count)
        spans = replace(self._spans, value=weighed)
        return marked(self.grading, spans, counts, degree, min(GROWTH, most), SAFETY * len(worst))

    def _dual(self, number: int, system: System, raised: Raised) -> Elements | None:
        """Return what the raised adjoint of a functional misses; None where that of the energy stands for it."""
        if not self.functionals or why_no_adjoint(system):
            return None
        samples = self._asked[number].samples(raised.solution)
        return None if samples is None else _missed(system, raised.system, raised.dual(samples))

    def _why_no_more(self, step: Step, finer: Grading, stalled: int, seconds: float) -> str:
        """Return why there is no further step; "" where there is one."""
        report, wanted = step.solution.report, GROWTH * sum(step.seconds.values())
        unknown = [one for one in report.asked if one.width is None]
        far = [one for one in report.asked if one.parts.get("geometry", 0.0) > self.accuracy * abs(one.value)]
        reasons = {
            f"the linear solver did not converge in {report.iterations} iterations": not report.converged,
            f"{unknown[0].ask!r} has no interval: {unknown[0].why}" if unknown else "": bool(unknown),
            f"{far[0].ask!r}: the distance to the true surface alone leaves more" if far else "": bool(far),
            f"no progress in {STALLED} steps, as where a quantity is infinite": stalled >= STALLED,
            f"the limit of {self.limits.unknowns:.0f} unknowns": report.dofs * LEAST_GROWTH > self.limits.unknowns,
            f"the limit of {self.limits.seconds:g} seconds": seconds + wanted > self.limits.seconds,
            "no span is left to halve": finer.spans == step.grading.spans,
        }
        return next((reason for reason, holds in reasons.items() if holds), "")


def _changed(now: Answer, last: Answer) -> Answer:
    """Return an answer whose interval holds half of what the last step changed: as much may still be missing."""
    known = now.parts.get("discretization", math.inf)
    change = 0.5 * abs(now.value - last.value)
    if now.width is None or not change > known:
        return now
    return replace(within(now, {"discretization": change}), why=f"half of what the last step changed; {now.why}")


def _missed(system: System, raised: System, found: BodyField) -> Elements:
    """Return what the space of a system misses of a field of the raised space, in the energy of the law."""
    spaces = [patch.space for patch in raised.stated]
    return directional_energies(_law(system).stated, spaces, _coefficients(found), system.matrix.parts[0].threads)


def _energy(system: System, raised: System, found: BodyField) -> list[Array]:
    """Return the energies of the elements of a field of the raised space."""
    spaces = [patch.space for patch in raised.stated]
    return energies(_law(system).stated, spaces, _coefficients(found), system.matrix.parts[0].threads)


def _law(system: System) -> System:
    """Return the system whose law gives energies: of a nearly incompressible body that of shear."""
    return system.displacement if isinstance(system, MixedSystem) else system


def _coefficients(found: BodyField) -> list[Array]:
    """Return the coefficients (c, n_u, n_v, n_w) of a field on each patch."""
    rows = (own.coefficients for own in found.patches)
    return [np.moveaxis(own.reshape(*own.shape[:3], -1), -1, 0) for own in rows]


def _sum(of_patches: Sequence[Array]) -> float:
    return sum(float(own.sum()) for own in of_patches)


def _weighed(missed: Elements, dual: Elements | None) -> Elements:
    """Return what both miss of each element, as a part of the quantity; of the energy its own."""
    return missed if dual is None else [np.sqrt(one * other) for one, other in zip(missed, dual, strict=True)]


def _excess(answer: Answer, accuracy: float) -> float:
    """Return the relative half-width of an answer's interval over the accuracy; infinite where there is none."""
    return math.inf if answer.width is None else answer.width / accuracy
