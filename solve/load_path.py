"""Follows a body of a law that is not linear along its load: step after step, halved where a step has no solution."""

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body
from parameterize.threads import one_blas_thread

from .diagnostics import ConvergenceError
from .discretization.groups import OnPatches
from .equilibrium import Equilibrium
from .forms.boundary_value_problem import BoundaryValueProblem
from .options import SolveOptions
from .preparation import prepared
from .solution import LoadStep, Solution

NEWTON_STEPS = 12  # in a load step; more of them take longer than two steps of half the size
PATIENCE = 4  # Newton steps in which the residual of a body that yields must halve; beyond its limit it does not
HALVINGS = 7  # of a step, before the load counts as the largest that the body carries
TOLERANCE = 1e-8  # of the balance, at least: stiff supports leave rounding of 1e-10 and more
LARGEST_STRAIN = 1.0  # plastic: under it the body flows. A spline resists the flow a little, whatever its strain
SMALL_STRAIN = 0.05  # plastic, up to which a law for small strains has no notice
GIVEN_WAY = 0.01  # share of the largest displacement by which supports give way without a notice
GRADING = "the history of a law is kept at the Gauss points of one mesh: leave --accuracy and grading out"

log = logging.getLogger(__name__)


class InterruptedPath(KeyboardInterrupt):
    """Raised where a solve is interrupted after some load steps.

    solution: that of the last one. cause: the interruption by the user, or by the clock.
    """

    def __init__(self, solution: Solution, cause: KeyboardInterrupt) -> None:
        super().__init__(*cause.args)
        self.solution, self.cause = solution, cause


@dataclass
class _Path:
    """Hold where a body is along its load.

    full: the coefficients. history: the residuals of Newton's method in all load steps. size: of the next step.
    interruption: that which ended it, if any.
    """

    balance: Equilibrium
    full: OnPatches
    history: list[float] = field(default_factory=list)
    steps: list[LoadStep] = field(default_factory=list)
    size: float = 1.0
    interruption: KeyboardInterrupt | None = None

    @property
    def factor(self) -> float:
        """Return the share of the load that is in equilibrium."""
        return self.steps[-1].factor if self.steps else 0.0

    def advance(self, factor: float) -> None:
        """Go to another share of the load. Raises ConvergenceError, and nothing has changed then."""
        history: list[float] = []
        patience = PATIENCE if self.balance.problem.form.history else None
        full = self.balance.found(self.full, factor, history, patience)
        balance = self.balance.advanced(full)
        strain = _plastic_strain(balance)
        if strain is not None and strain > LARGEST_STRAIN:
            raise ConvergenceError(f"the body flows: its plastic strain would be {strain:.2g}, which is not small")
        self.balance, self.full = balance, full
        self.history += history
        largest = max(float(np.linalg.norm(part, axis=0).max()) for part in full)
        self.steps.append(LoadStep(factor, len(history) - 1, largest, strain))

    def kept(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Return what a later process goes on from: arrays, and plain JSON values."""
        arrays = {"coefficients": self.full.flat}
        arrays |= {f"state-{i}": state for i, state in enumerate(self.balance.forces.states)}
        return arrays, {"steps": [step.as_dict() for step in self.steps], "size": self.size, "history": self.history}

    def restore(self, arrays: Mapping[str, Array], state: Mapping[str, Any]) -> bool:
        """Go to where another process was; return whether its arrays are those of this mesh."""
        if arrays["coefficients"].shape != self.full.flat.shape:
            return False
        states = [arrays[f"state-{i}"] for i in range(len(arrays) - 1)]
        self.full = replace(self.full, flat=arrays["coefficients"])
        self.balance = replace(self.balance, forces=replace(self.balance.forces, states=states))
        self.steps = [LoadStep(**step) for step in state["steps"]]
        self.size, self.history = state["size"], list(state["history"])
        return True


def along_the_load(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions) -> Solution:
    """Return the solution under all of the load, or under the largest share of it that is in equilibrium.

    Raises ValueError as `newton` does and for options that only linear laws have, ConvergenceError where not even the
    smallest step has a solution, and InterruptedPath where the user interrupts.
    """
    if options.ask:
        raise ValueError(f"ask {str(options.ask[0])!r}: intervals are known of linear laws only; leave ask out")
    if options.comm is not None and options.comm.size > 1:
        raise ValueError("load steps are taken in one process: leave comm out")
    if problem.form.history:
        if options.grading is not None:
            raise ValueError(GRADING)
        if options.quadrature == "spline":  # has too few points for the splines that are fitted to what they keep
            options = replace(options, quadrature="gauss+1")
    started, whole = time.process_time(), as_body(body)
    options = replace(options, tolerance=max(options.tolerance, TOLERANCE))
    placed, patches = prepared(whole, problem, options)
    problem.demand_held()
    linear, each = options.max_iterations, replace(options, max_iterations=NEWTON_STEPS)
    with one_blas_thread():
        balance = Equilibrium.of(whole, placed, patches, each, linear)
        path = _Path(balance, balance.at_rest, size=1.0 / options.load_steps)
        if options.keep is not None and (found := options.keep.load()) is not None and path.restore(*found):
            log.info("load factor %.4g: reached before the interruption", path.factor)
        setup = time.process_time() - started
        why = _followed(path, options)
        solution = _solution(path, why, {"setup": setup, "solve": time.process_time() - started - setup})
    for notice in solution.report.notices:
        log.warning("%s", notice)
    if path.interruption is not None:
        raise InterruptedPath(solution, path.interruption)
    return solution


def _followed(path: _Path, options: SolveOptions) -> str:
    """Go along the load as far as possible; return why not to its end, "" where it is reached."""
    full, least = 1.0 / options.load_steps, 1.0 / options.load_steps / 2**HALVINGS
    try:
        while path.factor < 1.0:
            goal = path.factor + path.size
            goal = 1.0 if goal > 1.0 - 0.5 * least else goal
            try:
                path.advance(goal)
            except ConvergenceError as error:
                if path.size <= least * 1.01:
                    if not path.steps:
                        raise
                    return str(error)
                path.size *= 0.5
                log.info("load factor %.4g: no equilibrium is found, the step is halved", goal)
                continue
            step = path.steps[-1]
            log.info("load factor %.4g: %d iterations, largest displacement %.4g", *_said(step))
            path.size = min(full, 2.0 * path.size) if step.iterations <= NEWTON_STEPS // 2 else path.size
            if options.keep is not None:
                options.keep.save(*path.kept())
    except KeyboardInterrupt as error:
        if not path.steps:
            raise
        path.interruption = error
        return "interrupted"
    return ""


def _said(step: LoadStep) -> tuple[float, int, float]:
    return step.factor, step.iterations, step.displacement


def _solution(path: _Path, why: str, seconds: dict[str, float]) -> Solution:
    balance, factor = path.balance, path.factor
    notices = []
    if path.interruption is not None:
        notices.append(
            f"interrupted: this is the solution under {factor:.4g} of the load, the last step in equilibrium"
        )
    elif why:
        notices.append(_why_not_all(factor, bool(balance.problem.form.history)))
    if (strain := path.steps[-1].plastic_strain or 0.0) > SMALL_STRAIN:
        notices.append(f"the plastic strain reaches {strain:.2g}, where the law for small strains no longer holds")
    way = balance.given_way(path.full, factor)
    largest = max((step.displacement for step in path.steps), default=0.0)
    if way > GIVEN_WAY * largest:
        notices.append(f"supports on regions give way by up to {way:.2g}, {way / largest:.1%} of the displacement")
    return balance.solution(
        path.full,
        path.history,
        len(path.steps),
        converged=not why,
        load_steps=tuple(path.steps),
        interrupted=path.interruption is not None,
        balance=balance.balance(path.full, factor),
        seconds=seconds,
        notices=tuple(notices),
    )


def _why_not_all(factor: float, flows: bool) -> str:
    """Return the notice on a load that is not carried in full: a limit load is known of bodies that flow alone."""
    if flows:
        return (
            f"the body carries {factor:.4g} of the load: beyond no equilibrium is found, however small the step. It is "
            "the limit load if it hardly changes with --steps and --refine"
        )
    return (
        f"the iteration ends at {factor:.4g} of the load: beyond it finds no equilibrium, however small the step. "
        "Either the body buckles or gives way there, or the iteration itself fails, as it does with a bulk modulus far "
        "above the shear modulus: give K up to 1000 times that, and compare --steps, --refine and --degree"
    )


def _plastic_strain(balance: Equilibrium) -> float | None:
    """Return the largest equivalent plastic strain at a Gauss point; None for a law without a history."""
    states = balance.forces.states
    return max(float(state[:, :, -1].max()) for state in states) if states else None
