"""Numbers that mean nothing: formulas that do not vary on the domain, and solutions that the mesh does not resolve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import AXES, FACE_NAMES, BSplineVolume

from .discretization.norms import Errors
from .estimate import Estimate
from .forms.data import in_scaled
from .forms.parser import Expression
from .forms.problem import BoundaryValueProblem

# Parameters per direction: the ends, and between them places without a pattern that a periodic formula could share.
SAMPLES = np.concatenate([[0.0], np.sort(np.random.default_rng(0).uniform(0.0, 1.0, 7)), [1.0]])
_RANDOM = np.random.default_rng(1)  # points of all sizes, somewhere among which a formula that can vary does so
ANYWHERE = _RANDOM.choice([-1.0, 1.0], (3, 300)) * 10.0 ** _RANDOM.uniform(-3.0, 4.0, (3, 300))
SMALLEST = 1e-150  # values whose squares underflow
ROUNDING = 1e-13  # share of the size by which a formula must vary
LARGEST_ERROR = 0.5  # relative L2: beyond it more of the solution is wrong than right
DECISIVE = ("exact", "source", "boundary")  # without these nothing is solved


@dataclass(frozen=True)
class Doubts:
    """What is doubtful in the numbers of a solve, one line each, and whether they mean something all the same."""

    notices: tuple[str, ...]
    meaningful: bool


def doubts(volume: BSplineVolume, problem: BoundaryValueProblem, errors: Errors | None, unknowns: int) -> Doubts:
    """Judge the formulas of a problem on a volume, and the errors of its solution.

    errors: None where they are not known, or compare with the solution of another problem.
    """
    points = np.moveaxis(volume.grid(SAMPLES, SAMPLES, SAMPLES), -1, 0)
    ends = {name: np.take(points, -int(name[1]), 1 + AXES.index(name[0])) for name in FACE_NAMES}
    empty = empty_formulas(problem, points, ends)
    unresolved = _unresolved(problem, points, errors, unknowns)
    is_solved = not unresolved and not any(role in DECISIVE for role, _ in empty)
    return Doubts((*(notice for _, notice in empty), *unresolved), is_solved)


def doubtful_estimate(estimate: Estimate | None) -> tuple[str, ...]:
    """Say that an estimated error is too large, or not finite; nothing where it is not."""
    if estimate is None or estimate.l2_relative is None or estimate.l2_relative <= LARGEST_ERROR:
        return ()
    return (
        f"the mesh does not resolve the solution: its relative L2 error is estimated as {estimate.l2_relative:.2g}",
    )


def empty_formulas(
    problem: BoundaryValueProblem, points: Array, faces: Mapping[str, Array] | None = None
) -> list[tuple[str, str]]:
    """Return the data whose formulas underflow, or vary by less than rounding, at points (3, ...): role, notice.

    faces: the points of each face, where data of that face are judged; without them at all points. A formula that is
    constant everywhere else, too, is meant to be constant. Points where a formula is not finite do not count.
    """
    found = []
    for role, datum, formula in problem.formulas:
        where = (faces or {}).get(datum.face, points)
        ends = _range(formula(*where))
        if ends is None or (fault := _fault(ends)) is None or _is_constant(formula, where):
            continue
        place = f"face {datum.face}" if where is not points else "the domain"
        described = f"{datum.name} {formula.text!r} runs from {ends[0]:.3g} to {ends[1]:.3g} on {place}"
        found.append((role, f"{described}: it {fault}, and means nothing here{in_scaled(formula, where)}"))
    return found


def _fault(ends: tuple[float, float]) -> str | None:
    size = max(abs(ends[0]), abs(ends[1]))
    if size < SMALLEST:
        return "underflows"
    return "varies by less than rounding" if ends[1] - ends[0] <= ROUNDING * size else None


def _is_constant(formula: Expression, where: Array) -> bool:
    """Whether a formula has one value anywhere, coordinates that do not vary at the points (3, ...) apart.

    On a face x = 0 the formula x*y is meant to be zero.
    """
    if not formula.variables:
        return True
    middle, length = (0.0, 1.0) if formula.frame is None else (np.array(formula.frame.center), formula.frame.length)
    anywhere = np.transpose(length * ANYWHERE.T + middle)
    for i, row in enumerate(where):
        if np.ptp(row) <= ROUNDING * np.abs(where).max():
            anywhere[i] = row.flat[0]
    ends = _range(formula(*anywhere))
    return ends is not None and ends[0] == ends[1]


def _unresolved(problem: BoundaryValueProblem, points: Array, errors: Errors | None, unknowns: int) -> tuple[str, ...]:
    if errors is None or errors.l2_relative is None or not errors.l2_relative > LARGEST_ERROR:
        return ()
    exact = problem.exact_formulas
    ends = [found for formula in exact if (found := _range(formula(*points)))]
    described = "exact"
    if ends:
        low, high = min(low for low, _ in ends), max(high for _, high in ends)
        text = ";".join(formula.text for formula in exact)
        described = f"exact {text!r} runs from {low:.3g} to {high:.3g} on the domain"
    remedy = in_scaled(exact[0], points) if len(exact) == 1 else ""
    share = f"the relative L2 error is {errors.l2_relative:.2g}"
    return (f"{described}: {unknowns:,} unknowns do not resolve it, {share}{remedy}",)


def _range(values: Array) -> tuple[float, float] | None:
    """Lowest and highest of the values that are finite; None where there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else None
