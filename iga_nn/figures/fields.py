"""Samples fields of a solid once for all their pictures: on its faces, its mid-sections and a lattice through it.

Figures and the interactive view colour a field by one range, which counts every sample: on the boundary, on the
mid-sections and inside. Whatever is drawn is among the samples, so no value that is drawn lies outside.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeVar

import numpy as np

from parameterize.arrays import Array
from parameterize.quality.quality import arap_on
from parameterize.spline.volume import BSplineVolume
from solve.field import Points, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity
from solve.forms.frame import UnitFrame
from solve.quantities import grid_values

from .evaluate import Grid, all_grids, error_at, flat
from .style import ColorRange, error_range, even_range

SAMPLES = 121  # per direction of a face or mid-section
LATTICE = 41  # per direction of the cube
KEPT = 2  # results of one function

STRESS = "von Mises"  # the name of the field that a body is drawn in


@dataclass(frozen=True, eq=False)
class Samples:
    """Hold values at the same places of the cube.

    patches: nine arrays (SAMPLES, SAMPLES, ...), on the faces in the order of FACE_NAMES, then on u, v, w = 1/2.
    lattice: (LATTICE, LATTICE, LATTICE, ...), at even steps of u, v and w, both ends included.
    """

    patches: Sequence[Array]
    lattice: Array

    @property
    def everywhere(self) -> list[Array]:
        """Return all arrays, of patches and lattice."""
        return [*self.patches, self.lattice]


@dataclass(frozen=True, eq=False)
class Field(Samples):
    """Hold the values of a field, its name in the controls of the view, the title of its bar, and its range."""

    name: str
    title: str
    limits: ColorRange


Result = TypeVar("Result")


def sampled(found_at: Callable[[Grid], Array]) -> Samples:
    """Return the samples of a function of a tensor grid, which gives (n_u, n_v, n_w, ...)."""
    even = np.linspace(0.0, 1.0, LATTICE)
    return Samples([flat(found_at(grid)) for grid in all_grids(SAMPLES)], found_at((even, even, even)))


def remembered(function: Callable[..., Result]) -> Callable[..., Result]:
    """Return a function that finds its last results again for the same objects, so that all pictures share samples."""
    kept: list[tuple[tuple[Any, ...], Result]] = []

    @wraps(function)
    def found(*given: Any) -> Result:
        for known, result in kept:
            if all(old is new for old, new in zip(known, given, strict=True)):
                return result
        kept.append((given, function(*given)))
        del kept[:-KEPT]
        return kept[-1][1]

    return found


@remembered
def points_of(volume: BSplineVolume) -> Samples:
    """Return the points (..., 3) of a volume."""
    return sampled(lambda grid: volume.grid(*grid))


def diagonal_of(points: Samples) -> float:
    """Return the diagonal of the box of all points."""
    cloud = np.concatenate([where.reshape(-1, 3) for where in points.everywhere])
    return float(np.linalg.norm(np.ptp(cloud, axis=0)))


@remembered
def distortion_of(volume: BSplineVolume) -> Field:
    """Return tanh(sqrt(ARAP) / 2), as the paper colours it, at volume 1."""
    scale = 1.0 / UnitFrame.of(volume).length
    found = sampled(lambda grid: np.tanh(np.sqrt(arap_on(volume, *grid, scale)) / 2.0))
    return Field(found.patches, found.lattice, "distortion", "tanh(√ARAP / 2), at volume 1", ColorRange(0.0, 1.0))


@remembered
def vectors_of(solution: SplineField) -> Samples:
    """Return the vectors (..., c) of a solution of several components."""
    return sampled(lambda grid: solution.grid(*grid))


@remembered
def solution_of(solution: SplineField) -> Field:
    """Return u_h, or the length of a vector u_h."""
    if solution.coefficients.ndim == 3:
        found, name, title = sampled(lambda grid: solution.grid(*grid)), "solution", "u"
    else:
        found, name, title = _each(vectors_of(solution), lambda values: np.linalg.norm(values, axis=-1)), "|u|", "|u|"
    return Field(found.patches, found.lattice, name, title, even_range(found.everywhere))


def components_of(solution: SplineField) -> list[Field]:
    """Return u_x, u_y and u_z of a vector of three components."""
    return [_component(vectors_of(solution), k, f"u_{axis}") for k, axis in enumerate("xyz")]


def _component(vectors: Samples, k: int, name: str) -> Field:
    found = _each(vectors, lambda values: values[..., k])
    return Field(found.patches, found.lattice, name, name, even_range(found.everywhere))


def quantity_of(solution: SplineField, quantity: Quantity, name: str, title: str) -> Field | None:
    """Return a quantity of one number a point, a function of u, grad and x; None where it is not finite everywhere."""
    try:
        found = sampled(lambda grid: grid_values(solution, quantity, *grid))
    except np.linalg.LinAlgError:  # det J = 0
        return None
    if not all(np.all(np.isfinite(values)) for values in found.everywhere):
        return None
    return Field(found.patches, found.lattice, name, title, even_range(found.everywhere))


@remembered
def fields_of(solution: SplineField) -> list[Field]:
    """Return the fields that show a solution, first the field of its picture; of a body that is von Mises' stress."""
    fields = [solution_of(solution)]
    if solution.coefficients.shape[3:] == (3,):
        fields += components_of(solution)
    if law := (quantities_of(solution) or {}).get("von_mises"):
        stress = quantity_of(solution, law, STRESS, "von Mises stress")
        return fields if stress is None else [stress, *fields]
    return fields


@remembered
def error_of(volume: BSplineVolume, solution: SplineField, problem: BoundaryValueProblem) -> Field:
    """Return |u - u_h|, whose range is logarithmic. problem: its exact solution is known."""
    problem = problem.on(volume)
    found = sampled(lambda grid: error_at(solution.grid(*grid), problem, Points.on(volume, *grid)))
    limits = error_range([found.everywhere])
    return Field(found.patches, found.lattice, "error", "|u − uₕ|", limits)


def quantities_of(solution: SplineField) -> Mapping[str, Quantity] | None:
    """Return the quantities of the law that is solved, None where it is not known."""
    problem = getattr(solution, "problem", None)
    return None if problem is None else problem.form.quantities


def _each(samples: Samples, change: Callable[[Array], Array]) -> Samples:
    return Samples([change(values) for values in samples.patches], change(samples.lattice))
