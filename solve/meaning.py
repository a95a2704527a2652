"""Numbers that mean nothing: formulas that do not vary on the domain, and solutions that the mesh does not resolve."""

from __future__ import annotations

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .discretization.norms import Errors
from .forms.data import ProblemData, in_scaled

SAMPLES = np.linspace(0.0, 1.0, 9)  # parameters per direction
SMALLEST = 1e-150  # values whose squares underflow
ROUNDING = 1e-13  # share of the size by which a formula must vary
LARGEST_ERROR = 0.5  # relative L2: beyond it more of the solution is wrong than right


def doubts(volume: BSplineVolume, problem: ProblemData, errors: Errors | None, unknowns: int) -> tuple[str, ...]:
    """Why the numbers of a solve mean nothing, one line each; none where they mean something.

    errors: None where they are not known, or compare with the solution of another problem.
    """
    points = np.moveaxis(volume.grid(SAMPLES, SAMPLES, SAMPLES), -1, 0)
    return (*empty_formulas(problem, points), *_unresolved(problem, points, errors, unknowns))


def empty_formulas(problem: ProblemData, points: Array) -> tuple[str, ...]:
    """The formulas of a problem that underflow, or vary by less than rounding, at points (3, ...) of the domain.

    A formula without a variable is meant to be constant. Points where a formula is not finite do not count: data of one
    face need be finite on that face alone.
    """
    found = []
    for name, formula in problem.formulas:
        if not formula.variables or (ends := _range(formula(*points))) is None:
            continue
        low, high = ends
        size = max(abs(low), abs(high))
        if size < SMALLEST:
            fault = "underflows"
        elif high - low <= ROUNDING * size:
            fault = "varies by less than rounding"
        else:
            continue
        found.append(f"{name} {_described(formula.text, ends)}: it {fault}, and means nothing here{in_scaled(formula)}")
    return tuple(found)


def _unresolved(problem: ProblemData, points: Array, errors: Errors | None, unknowns: int) -> tuple[str, ...]:
    if errors is None or errors.l2_relative is None or not errors.l2_relative > LARGEST_ERROR:
        return ()
    formula = dict(problem.formulas).get("exact")
    ends = None if formula is None else _range(formula(*points))
    which = "exact" if formula is None or ends is None else f"exact {_described(formula.text, ends)}"
    share = f"the relative L2 error is {errors.l2_relative:.2g}"
    return (f"{which}: {unknowns:,} unknowns do not resolve it, {share}{in_scaled(formula)}",)


def _range(values: Array) -> tuple[float, float] | None:
    """Lowest and highest of the values that are finite; None where there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else None


def _described(text: str, ends: tuple[float, float]) -> str:
    return f"{text!r} runs from {ends[0]:.3g} to {ends[1]:.3g} on the domain"
