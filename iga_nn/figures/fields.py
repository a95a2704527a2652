"""Samples bodies and their fields once for all pictures: on the faces, mid-sections and a lattice of each patch.

Figures and the interactive view colour a field by one range, which counts every sample: on the boundary, on the
mid-sections and inside. Whatever is drawn is among the samples, so no value that is drawn lies outside.

Where something is listed for the faces and sections of all patches, each patch has nine entries: six faces, in the
order of FACE_NAMES, three sections.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, wraps
from operator import itemgetter
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array
from parameterize.quality.distortion import arap_on, own_boxes
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import AXES, FACE_NAMES, BSplineVolume
from solve.field import FieldOnBody, Points, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity
from solve.forms.frame import UnitFrame
from solve.quantities import grid_values

from ..options import Units
from .colors import SMALLEST, ColorRange, error_range, even_range, with_unit

Grid = tuple[Array, Array, Array]  # parameters of a tensor grid; on a face or a section one direction has one value
OnGrid = Callable[[Array, Array, Array], Array]  # takes a tensor grid and gives (n_u, n_v, n_w, ...)
Result = TypeVar("Result")

SECTIONS = tuple(f"{axis} = 1/2" for axis in AXES)
PLANES = [(axis, side) for axis in range(3) for side in (0.0, 1.0)] + [(axis, 0.5) for axis in range(3)]
PER_PATCH = len(PLANES)  # faces and sections

SAMPLES = 121  # per direction of a face or mid-section
LATTICE = 41  # per direction of the cube
OF_SEVERAL = 81, 21  # the same of each of several patches
MANY, OF_MANY = 8, (41, 11)  # patches, and the same of each of more: figures and pages keep their seconds and size
KEPT = 2  # results of one function

STRESS = "von Mises"  # the name of the field that a body is drawn in
SHARE = 0.08  # of the diagonal of the body's box: the largest displacement as drawn
DIGITS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)  # first digits of a factor; each is at most 1.5 times the one before


def all_grids(samples: int) -> list[Grid]:
    """Return the grids, samples x samples, of the six faces in the order of FACE_NAMES, then those of SECTIONS."""
    even, grids = np.linspace(0.0, 1.0, samples), []
    for axis, value in PLANES:
        u, v, w = (np.array([value]) if a == axis else even for a in range(3))
        grids.append((u, v, w))
    return grids


def face_window(parameter: ArrayLike, half: float, samples: int) -> Grid:
    """Return the parameters of the part of a face within `half` of a point (3,) on the cube's boundary."""
    place = np.asarray(parameter, dtype=np.float64)
    axis = int(np.abs(place - 0.5).argmax())
    low, high = np.clip(place - half, 0.0, 1.0), np.clip(place + half, 0.0, 1.0)
    u, v, w = (place[[a]] if a == axis else np.linspace(low[a], high[a], samples) for a in range(3))
    return u, v, w


def flat(values: Array) -> Array:
    """Return the values of a grid without the direction that has a single parameter."""
    axis = next(a for a in range(3) if values.shape[a] == 1)
    return np.asarray(values.squeeze(axis))


def points_on(volume: BSplineVolume, grid: Grid) -> Array:
    """Return the points (samples, samples, 3) of a grid on a face or section."""
    return flat(volume.grid(*grid))


def outer_faces(body: BodyLike) -> list[int]:
    """Return the places of the faces that are not glued among the nine faces and sections of each patch."""
    return [PER_PATCH * patch + FACE_NAMES.index(face) for patch, face in as_body(body).outer_faces]


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

    @property
    def cloud(self) -> Array:
        """Return all samples of points as one array (k, 3)."""
        return np.concatenate([points.reshape(-1, 3) for points in self.everywhere])

    @property
    def diagonal(self) -> float:
        """Return the diagonal of the box of all samples of points."""
        return float(np.linalg.norm(np.ptp(self.cloud, axis=0)))

    def each(self, change: Callable[[Array], Array]) -> "Samples":
        """Return the samples that a function of arrays makes of these."""
        return Samples([change(values) for values in self.patches], [change(values) for values in self.lattices])


@dataclass(frozen=True, eq=False)
class ColoredField(Samples):
    """Hold the values of a field, its name in the controls of the view, the title of its bar, and its range."""

    name: str
    title: str
    limits: ColorRange

    def titled(self, units: Units) -> str:
        """Return the title with the unit of the field."""
        return with_unit(self.title, units.stress if self.name == STRESS else units.displacement)

    @classmethod
    def ranging(cls, samples: Samples, name: str, title: str) -> Self:
        """Return the field of samples, whose range is from its lowest to its highest value."""
        return cls(samples.patches, samples.lattices, name, title, even_range(samples.everywhere))


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


def sampled(values_on: Sequence[OnGrid]) -> Samples:
    """Return the samples of a function on each patch."""
    count = len(values_on)
    samples, lattice = (SAMPLES, LATTICE) if count == 1 else OF_SEVERAL if count <= MANY else OF_MANY
    even, grids = np.linspace(0.0, 1.0, lattice), all_grids(samples)
    return Samples(
        [flat(values_at(*grid)) for values_at in values_on for grid in grids],
        [values_at(even, even, even) for values_at in values_on],
    )


@remembered
def points_of(body: BodyLike) -> Samples:
    """Return the points (..., 3) of a body."""
    return sampled([patch.grid for patch in as_body(body)])


def arap_of(body: BodyLike) -> list[OnGrid]:
    """Return for each patch the function that gives the ARAP distortion.

    A volume is measured at volume 1, each of several patches against its own box.
    """
    glued = as_body(body)
    boxes = [UnitFrame.of(glued).length] if glued.is_single else own_boxes(glued)
    return [partial(arap_on, patch, box=box) for patch, box in zip(glued, boxes, strict=True)]


@remembered
def distortion_of(body: BodyLike) -> ColoredField:
    """Return tanh(sqrt(ARAP) / 2), as the paper colours it, at volume 1; of several patches, each in its own box."""
    shares = sampled(arap_of(body)).each(lambda arap: np.tanh(np.sqrt(arap) / 2.0))
    title = f"tanh(√ARAP / 2), {'at volume 1' if as_body(body).is_single else 'each in its own box'}"
    return ColoredField(shares.patches, shares.lattices, "distortion", title, ColorRange(0.0, 1.0))


@remembered
def vectors_of(solution: FieldOnBody) -> Samples:
    """Return the vectors (..., c) of a solution of several components, or its values (...)."""
    return sampled([field.grid for field in solution.patches])


@remembered
def solution_of(solution: FieldOnBody) -> ColoredField:
    """Return u_h, or the length of a vector u_h."""
    if solution.patches[0].coefficients.ndim == 3:  # one number a point, without an axis of components
        return ColoredField.ranging(vectors_of(solution), "solution", "u")
    return ColoredField.ranging(vectors_of(solution).each(lambda u: np.linalg.norm(u, axis=-1)), "|u|", "|u|")


def is_spatial(solution: FieldOnBody) -> bool:
    """Return whether a solution is a vector of three components."""
    return solution.patches[0].coefficients.shape[3:] == (3,)


def components_of(solution: FieldOnBody) -> list[ColoredField]:
    """Return u_x, u_y and u_z of a vector of three components."""
    parts = [vectors_of(solution).each(itemgetter((..., k))) for k in range(3)]
    return [ColoredField.ranging(part, name, name) for part, name in zip(parts, ("u_x", "u_y", "u_z"), strict=True)]


def quantity_of(
    solution: FieldOnBody, quantity: Quantity | Sequence[Quantity], name: str, title: str
) -> ColoredField | None:
    """Return a quantity of one number a point, a function of u, grad and x; None where it is not finite everywhere.

    quantity: of several patches also a function for each, where their materials differ.
    """
    laws = quantity if isinstance(quantity, Sequence) else [quantity] * len(solution.patches)
    try:
        samples = sampled([partial(grid_values, *pair) for pair in zip(solution.patches, laws, strict=True)])
    except np.linalg.LinAlgError:  # det J = 0
        return None
    if not all(np.all(np.isfinite(values)) for values in samples.everywhere):
        return None
    return ColoredField.ranging(samples, name, title)


@remembered
def fields_of(solution: FieldOnBody) -> list[ColoredField]:
    """Return the fields that show a solution, first the field of its picture; of a body that is von Mises' stress."""
    fields = [solution_of(solution)]
    if is_spatial(solution):
        fields += components_of(solution)
    laws = [(quantities_of(field) or {}).get("von_mises") for field in solution.patches]
    if None not in laws:
        stress = quantity_of(solution, [law for law in laws if law], STRESS, "von Mises stress")
        return fields if stress is None else [stress, *fields]
    return fields


def problems_on(problem: BoundaryValueProblem, body: BodyLike) -> list[BoundaryValueProblem]:
    """Return the problem on each patch, with X, Y, Z measured in the body."""
    return problem.on(body).on_patches(as_body(body))


def error_at(values: Array, problem: BoundaryValueProblem, x: Points) -> Array:
    """Return |u - u_h| at points x (3, ...). values: u_h there, (...), or vectors (..., 3)."""
    exact, _ = problem.exact_at(x)
    if values.ndim < x.ndim:
        return np.abs(values - exact[0])
    return np.asarray(np.linalg.norm(values - np.moveaxis(exact, 0, -1), axis=-1))


@remembered
def error_of(body: BodyLike, solution: FieldOnBody, problem: BoundaryValueProblem) -> ColoredField:
    """Return |u - u_h|, whose range is logarithmic. problem: its exact solution is known."""
    parts = zip(as_body(body), solution.patches, problems_on(problem, body), strict=True)
    samples = sampled([partial(_error_on, *part) for part in parts])
    limits = error_range([samples.everywhere])
    return ColoredField(samples.patches, samples.lattices, "error", "|u − uₕ|", limits)


def _error_on(
    patch: BSplineVolume, field: SplineField, problem: BoundaryValueProblem, u: Array, v: Array, w: Array
) -> Array:
    return error_at(field.grid(u, v, w), problem, Points.on(patch, u, v, w))


def quantities_of(solution: FieldOnBody) -> Mapping[str, Quantity] | None:
    """Return the quantities of the law that is solved, None where it is not known."""
    problem = getattr(solution, "problem", None)
    return None if problem is None else problem.form.quantities


def is_displacement(solution: FieldOnBody) -> bool:
    """Return whether a solution is a vector of three components whose law gives von Mises' stress, or is not known."""
    quantities = quantities_of(solution)
    return is_spatial(solution) and (quantities is None or "von_mises" in quantities)


def warp_of(solution: FieldOnBody, size: float) -> float:
    """Return the factor at which the largest displacement is drawn as 5 to 8 % of a size, 0 for no displacement.

    size: the diagonal of the body's box.
    """
    if not is_displacement(solution):
        return 0.0
    return factor_for(size, max(float(values.max()) for values in solution_of(solution).everywhere))


def factor_for(size: float, largest: float) -> float:
    """Return the round factor at which `largest` is drawn as 5 to 8 % of a size; 0 where it is zero or not finite."""
    if not SMALLEST < largest < np.inf:
        return 0.0
    decade = 10.0 ** math.floor(math.log10(SHARE * size / largest))
    return max((digit for digit in DIGITS if digit * decade * largest <= SHARE * size), default=1.0) * decade
