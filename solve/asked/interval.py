"""Answers what is asked of a solution, each quantity with the interval in which its true value is expected.

The error of a quantity J is J(u+) - J(u_h), with the solution u+ on the raised space. For a linear J it is the residual
of u_h at the adjoint of J in the raised space, the dual weighted residual (Becker, Rannacher, *Acta Numerica*, 2001).
One solve serves all quantities, and those that are not linear. docs/intervals.md says what an interval promises.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from ..answer import NOT_ESTIMATED, Answer
from ..options import SolveOptions
from ..solution import Solution
from ..system import System
from .away import away
from .functional import AtPlace, Extreme, Functional, Reaction
from .geometry import GeometryPart
from .of_geometry import of_geometry
from .raised import Raised, why_not_raised
from .scatter import scatter

# Half of an interval over what the raised solution adds (examples/benchmarks/effectivity.py). Where ends of patches are
# not divided, a singular solution's error is 2.1 times what is added on a heat sink. Energies and reactions are sums
# over the body: they have no place around which errors are seen, and were up to 1.4 times as wrong
# (examples/benchmarks/textbook.py). A held region that ends inside of a face has a rim where nothing is divided: a
# fifth of the error was seen on a wedge (examples/benchmarks/part_intervals.py).
WIDER, WIDER_AT_ENDS, WIDER_OF_SUMS, WIDER_AT_RIMS = 1.5, 2.5, 2.0, 5.0
# A largest value that the raised solution does not confirm is a peak at a place of bad shape as a rule. Then the raised
# solution's value is the answer.
CONFIRMED = 0.2  # largest difference, as a share of the larger value
UNCONFIRMED = 0.5  # half of the interval over the difference
BY_CHANCE = 0.4  # share of the error around a place that counts where the error happens to vanish at the place
ITERATION = 0.1  # share of what the raised solution adds that its iteration leaves, at most


def answers(
    system: System, solution: Solution, functionals: Sequence[Functional], options: SolveOptions
) -> tuple[Answer, ...]:
    """Return the answers to what is asked of the solution of a system. options: those of the solve."""
    functionals = [away(one, solution) for one in functionals]
    if why := why_not_answered(system, solution):
        return tuple(replace(one.answer(solution), why=f"{NOT_ESTIMATED}: {why}") for one in functionals)
    return intervals(system, solution, functionals, Raised.of(system, solution, options))


def intervals(
    system: System, solution: Solution, functionals: Sequence[Functional], raised: Raised
) -> tuple[Answer, ...]:
    """Return the answers to quantities of a solution, with their intervals from its raised solution."""
    found = [answer(one, solution, raised) for one in functionals]
    return tuple(map(_with_geometry, found, of_geometry(system, solution, functionals)))


def _with_geometry(given: Answer, found: GeometryPart | str) -> Answer:
    """Return an answer with the part of the distance to the true surface, or with the line that says it has none."""
    if given.lower is None:
        return given
    if isinstance(found, str):
        return replace(given, why=f"{given.why}; geometry: not known, {found}")
    widened = within(given, {"geometry": found.part})
    return replace(widened, why=f"{given.why}; geometry: {found.distance:.2g} off the surface at most")


def why_not_answered(system: System, solution: Solution) -> str:
    """Return why the quantities of a solution have no interval; "" where they have one."""
    return "the iteration did not converge" if not solution.report.converged else why_not_raised(system)


def answer(asked: Functional, solution: Solution, raised: Raised) -> Answer:
    """Return the answer to one quantity, with its interval from the raised solution."""
    found = asked.answer(solution)
    if math.isnan(found.value):
        return found
    if isinstance(asked, AtPlace | Extreme) and asked.unknown:
        return replace(found, why=f"{NOT_ESTIMATED}: {asked.unknown}")
    higher = asked.answer(raised.solution)
    if math.isnan(higher.value):
        return replace(found, why=f"{NOT_ESTIMATED}: {higher.why}")
    added = abs(higher.value - found.value)
    if isinstance(asked, Extreme) and added > CONFIRMED * max(abs(found.value), abs(higher.value)):
        parts = {"discretization": UNCONFIRMED * added, "iteration": ITERATION * added}
        return within(replace(higher, why=_why_unconfirmed(found, raised)), parts)
    around = 0.0
    if isinstance(asked, AtPlace | Extreme):
        samples = asked.samples(solution)
        around = scatter(samples, solution, raised.solution)
    wider = _wider(asked, raised)
    parts = {"discretization": wider * max(added, BY_CHANCE * around), "iteration": ITERATION * added}
    return within(replace(found, why=_why(wider, raised)), parts)


def within(given: Answer, parts: dict[str, float]) -> Answer:
    """Return an answer with more parts of its interval: half-widths by their source."""
    every = dict(given.parts) | parts
    half = sum(every.values())
    return replace(given, lower=given.value - half, upper=given.value + half, parts=every)


def _why_unconfirmed(found: Answer, raised: Raised) -> str:
    """Return in words that a largest value is that of the raised solution."""
    return (
        f"the value of a solution of degree {_degree(raised)}, which does not confirm the solution's own "
        f"{found.value:.4g}; half of their difference: refine there"
    )


def _degree(raised: Raised) -> int:
    return max(max(patch.space.degrees) for patch in raised.system.stated)


def _wider(asked: Functional, raised: Raised) -> float:
    """Return half of an interval over what the raised solution adds."""
    if raised.has_inner_rim:
        return WIDER_AT_RIMS
    if not raised.is_divided:
        return WIDER_AT_ENDS
    return WIDER_OF_SUMS if isinstance(asked, Reaction) or asked.ask.kind == "energy" else WIDER


def _why(wider: float, raised: Raised) -> str:
    """Return in words what an interval rests on."""
    finer = " and finer at the ends of patches" if raised.is_divided else ""
    slow = ", for a held region ends inside of a face, where convergence is slow" if raised.has_inner_rim else ""
    return f"{wider:g} times what a solution of degree {_degree(raised)}{finer} adds{slow}"
