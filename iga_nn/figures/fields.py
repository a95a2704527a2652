"""Samples fields of a body once for all their pictures: on the faces, mid-sections and a lattice of each patch.

Figures and the interactive view colour a field by one range, which counts every sample: on the boundary, on the
mid-sections and inside. Whatever is drawn is among the samples, so no value that is drawn lies outside.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeVar

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body
from solve.field import FieldOnBody, Points, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity
from solve.quantities import grid_values

from .evaluate import Grid, all_grids, arap_of, error_at, flat, problems_on
from .ranges import ColorRange, error_range, even_range

SAMPLES = 121  # per direction of a face or mid-section
LATTICE = 41  # per direction of the cube
OF_SEVERAL = 81, 21  # the same of each of several patches
MANY, OF_MANY = 8, (41, 11)  # patches, and the same of each of more: figures and pages keep their seconds and size
KEPT = 2  # results of one function

STRESS = "von Mises"  # the name of the field that a body is drawn in


@dataclass(frozen=True, eq=False)
class Samples:
    """Hold values at the same places of each patch's cube.

    patches: nine arrays (SAMPLES, SAMPLES, ...) for each patch of the body, on the faces in the order of FACE_NAMES,
    then on u, v, w = 1/2. lattices: (LATTICE, LATTICE, LATTICE, ...) for each patch, at even steps of u, v and w, both
    ends included.
    """

    patches: Sequence[Array]
    lattices: Sequence[Array]

    @property
    def everywhere(self) -> list[Array]:
        """Return all arrays, of patches and lattices."""
        return [*self.patches, *self.lattices]


@dataclass(frozen=True, eq=False)
class Field(Samples):
    """Hold the values of a field, its name in the controls of the view, the title of its bar, and its range."""

    name: str
    title: str
    limits: ColorRange


Result = TypeVar("Result")


def sampled(found_on: Sequence[Callable[[Grid], Array]]) -> Samples:
    """Return the samples of a function on each patch, which takes a tensor grid and gives (n_u, n_v, n_w, ...)."""
    samples, lattice = (SAMPLES, LATTICE) if len(found_on) == 1 else OF_SEVERAL if len(found_on) <= MANY else OF_MANY
    even, grids = np.linspace(0.0, 1.0, lattice), all_grids(samples)
    return Samples(
        [flat(found_at(grid)) for found_at in found_on for grid in grids],
        [found_at((even, even, even)) for found_at in found_on],
    )


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
def points_of(body: BodyLike) -> Samples:
    """Return the points (..., 3) of a body."""
    return sampled([_on_grid(patch) for patch in as_body(body)])


def _on_grid(spline: Any) -> Callable[[Grid], Array]:
    """Return the function that gives the values of a volume or a field on a grid."""
    return lambda grid: spline.grid(*grid)


def diagonal_of(points: Samples) -> float:
    """Return the diagonal of the box of all points."""
    cloud = np.concatenate([where.reshape(-1, 3) for where in points.everywhere])
    return float(np.linalg.norm(np.ptp(cloud, axis=0)))


@remembered
def distortion_of(body: BodyLike) -> Field:
    """Return tanh(sqrt(ARAP) / 2), as the paper colours it, at volume 1; of several patches, each in its own box."""

    def colored(arap_at: Callable[[Grid], Array]) -> Callable[[Grid], Array]:
        return lambda grid: np.tanh(np.sqrt(arap_at(grid)) / 2.0)

    found = sampled([colored(arap_at) for arap_at in arap_of(body)])
    title = f"tanh(√ARAP / 2), {'at volume 1' if as_body(body).is_single else 'each in its own box'}"
    return Field(found.patches, found.lattices, "distortion", title, ColorRange(0.0, 1.0))


@remembered
def vectors_of(solution: FieldOnBody) -> Samples:
    """Return the vectors (..., c) of a solution of several components."""
    return sampled([_on_grid(field) for field in solution.patches])


@remembered
def solution_of(solution: FieldOnBody) -> Field:
    """Return u_h, or the length of a vector u_h."""
    if is_scalar(solution):
        found, name, title = sampled([_on_grid(field) for field in solution.patches]), "solution", "u"
    else:
        found, name, title = _each(vectors_of(solution), lambda values: np.linalg.norm(values, axis=-1)), "|u|", "|u|"
    return Field(found.patches, found.lattices, name, title, even_range(found.everywhere))


def is_scalar(solution: FieldOnBody) -> bool:
    """Return whether a solution has one number a point, without an axis of components."""
    return solution.patches[0].coefficients.ndim == 3


def is_spatial(solution: FieldOnBody) -> bool:
    """Return whether a solution is a vector of three components."""
    return solution.patches[0].coefficients.shape[3:] == (3,)


def components_of(solution: FieldOnBody) -> list[Field]:
    """Return u_x, u_y and u_z of a vector of three components."""
    return [_component(vectors_of(solution), k, f"u_{axis}") for k, axis in enumerate("xyz")]


def _component(vectors: Samples, k: int, name: str) -> Field:
    found = _each(vectors, lambda values: values[..., k])
    return Field(found.patches, found.lattices, name, name, even_range(found.everywhere))


def quantity_of(solution: FieldOnBody, quantity: Quantity | Sequence[Quantity], name: str, title: str) -> Field | None:
    """Return a quantity of one number a point, a function of u, grad and x; None where it is not finite everywhere.

    quantity: of several patches also a function for each, where their materials differ.
    """
    fields = solution.patches
    laws = quantity if isinstance(quantity, Sequence) else [quantity] * len(fields)

    def found_on(field: SplineField, law: Quantity) -> Callable[[Grid], Array]:
        return lambda grid: grid_values(field, law, *grid)

    try:
        found = sampled([found_on(field, law) for field, law in zip(fields, laws, strict=True)])
    except np.linalg.LinAlgError:  # det J = 0
        return None
    if not all(np.all(np.isfinite(values)) for values in found.everywhere):
        return None
    return Field(found.patches, found.lattices, name, title, even_range(found.everywhere))


@remembered
def fields_of(solution: FieldOnBody) -> list[Field]:
    """Return the fields that show a solution, first the field of its picture; of a body that is von Mises' stress."""
    fields = [solution_of(solution)]
    if is_spatial(solution):
        fields += components_of(solution)
    laws = [(quantities_of(field) or {}).get("von_mises") for field in solution.patches]
    if None not in laws:
        stress = quantity_of(solution, [law for law in laws if law], STRESS, "von Mises stress")
        return fields if stress is None else [stress, *fields]
    return fields


@remembered
def error_of(body: BodyLike, solution: FieldOnBody, problem: BoundaryValueProblem) -> Field:
    """Return |u - u_h|, whose range is logarithmic. problem: its exact solution is known."""
    parts = zip(as_body(body), solution.patches, problems_on(problem, body), strict=True)

    def found_on(patch: Any, field: SplineField, own: BoundaryValueProblem) -> Callable[[Grid], Array]:
        return lambda grid: error_at(field.grid(*grid), own, Points.on(patch, *grid))

    found = sampled([found_on(*part) for part in parts])
    limits = error_range([found.everywhere])
    return Field(found.patches, found.lattices, "error", "|u − uₕ|", limits)


def quantities_of(solution: FieldOnBody) -> Mapping[str, Quantity] | None:
    """Return the quantities of the law that is solved, None where it is not known."""
    problem = getattr(solution, "problem", None)
    return None if problem is None else problem.form.quantities


def _each(samples: Samples, change: Callable[[Array], Array]) -> Samples:
    return Samples([change(values) for values in samples.patches], [change(values) for values in samples.lattices])
