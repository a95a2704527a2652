"""Samples bodies and their fields once for all pictures: on the faces, mid-sections and a lattice of each patch.

Figures and the interactive view colour a field by one range, which counts every sample: on the boundary, on the
mid-sections and inside. Whatever is drawn is among the samples. Where peaks would take most of the colours, the range
is that of 99 % of the body, outside of the places where a stress is infinite; legends say so.

Where something is listed for the faces and sections of all patches, each patch has nine entries: six faces, in the
order of FACE_NAMES, three sections. Their number among those of all patches is their place: nine times the number of
the patch, and the number among the nine.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, wraps
from operator import itemgetter
from typing import Any, Self, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, IntArray, ends_of
from parameterize.quality.distortion import in_boxes, own_boxes, unmirrored
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.orientation import orientation, orientations
from parameterize.spline.patch_groups import PatchGroup
from parameterize.spline.spline_stack import SplineStack
from parameterize.spline.volume import AXES, BSplineVolume
from solve.averaging import averaged_groups
from solve.field import FieldOnBody, Points
from solve.field_groups import FieldGroup, groups_of
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.form import Quantity
from solve.forms.frame import UnitFrame
from solve.outside import RADII
from solve.quantities import group_values
from solve.singular import SingularPlaces

from ..options import Units
from .colors import SMALLEST, ColorRange, error_range, even_range, range_of_most, with_unit

Grid = tuple[Array, Array, Array]  # parameters of a tensor grid; on a face or a section one direction has one value
OnGrid = Callable[[IntArray, Array, Array, Array], Array]  # takes some patches of a group and a tensor grid
Parts = Sequence[tuple[IntArray, OnGrid]]  # groups: the numbers of the patches, and (k, n_u, n_v, n_w, ...) on some
Result = TypeVar("Result")
Found = list[tuple[str, tuple[Any, ...], Any]]  # name of a function that remembers, what it was given, its result

SECTIONS = tuple(f"{axis} = 1/2" for axis in AXES)
PLANES = [(axis, side) for axis in range(3) for side in (0.0, 1.0)] + [(axis, 0.5) for axis in range(3)]
PER_PATCH = len(PLANES)  # faces and sections

SAMPLES = 121  # per direction of a face or mid-section
LATTICE = 41  # per direction of the cube
OF_SEVERAL = 81, 21  # the same of each of several patches
FEW = 8  # patches: of more, only outer faces are sampled beside the lattice
OF_MANY = {150: (25, 11), 1000: (17, 5), 7400: (9, 3), math.inf: (5, 2)}  # of each of as many: pages keep their size
LINED = 10_000  # patches: of more, borders would cover the colours
NAMED = 300  # outer faces whose names can be read in a picture
KEPT = 2  # results of one function
SAMPLED = "points_of", "hand_of", "distortion_of", "vectors_of", "solution_of", "fields_of", "error_of"  # by functions
_REMEMBERED: dict[str, list[tuple[tuple[Any, ...], Any]]] = {}

DISTORTION = "distortion"  # the name of a field that has no unit
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


def points_on(volume: BSplineVolume, grid: Grid) -> Array:
    """Return the points (samples, samples, 3) of a grid on a face or section."""
    points = volume.grid(*grid)
    return np.asarray(points.squeeze(next(a for a in range(3) if points.shape[a] == 1)))


def outer_faces(body: BodyLike) -> IntArray:
    """Return the places of the faces that are not glued among the nine faces and sections of each patch, ascending."""
    patches, faces = np.nonzero(~as_body(body).glued)
    return PER_PATCH * patches + faces


@dataclass(frozen=True, eq=False)
class Samples:
    """Hold values at the same places of each patch's cube.

    places: (m,), of the faces and sections that are sampled themselves, ascending: all nine of each patch, of many
    patches the outer faces. planes: (m, SAMPLES, SAMPLES, ...), on these. lattices: (patches, LATTICE, LATTICE,
    LATTICE, ...), at even steps of u, v and w, both ends included.
    """

    places: IntArray
    planes: Array
    lattices: Array

    @property
    def everywhere(self) -> list[Array]:
        """Return all arrays, of planes and lattices."""
        return [self.planes, self.lattices]

    @property
    def cloud(self) -> Array:
        """Return all samples of points as one array (k, 3)."""
        return np.concatenate([points.reshape(-1, 3) for points in self.everywhere])

    @property
    def diagonal(self) -> float:
        """Return the diagonal of the box of all samples of points."""
        return float(np.linalg.norm(np.subtract(*ends_of(self.cloud))))

    def each(self, change: Callable[[Array], Array]) -> "Samples":
        """Return the samples that a function of arrays makes of these."""
        return Samples(self.places, change(self.planes), change(self.lattices))

    def divided(self, places: IntArray) -> list[IntArray]:
        """Return some places as those that are sampled themselves and those in the lattices, without empty parts."""
        own = np.isin(places, self.places)
        return [part for part in (places[own], places[~own]) if len(part)]

    def on(self, places: IntArray) -> Array:
        """Return the values (k, n, n, ...) at places, all of one of the parts that `divided` returns."""
        if places[0] in self.places:
            return self.planes[np.searchsorted(self.places, places)]
        found = np.empty((len(places), *self.lattices.shape[2:]))
        patches, planes = np.divmod(places, PER_PATCH)
        for number, (axis, value) in enumerate(PLANES):
            chosen, layer = np.flatnonzero(planes == number), round(value * (self.lattices.shape[1] - 1))
            found[chosen] = np.take(self.lattices[patches[chosen]], layer, axis=1 + axis)
        return found


@dataclass(frozen=True, eq=False)
class ColoredField(Samples):
    """Hold the values of a field, its name in the controls of the view, the title of its bar, and its range."""

    name: str
    title: str
    limits: ColorRange

    def titled(self, units: Units) -> str:
        """Return the title with the unit of the field."""
        return with_unit(self.title, self.unit(units))

    def unit(self, units: Units) -> str | None:
        """Return the unit of the values, None where it is not known."""
        return units.stress if self.name == STRESS else None if self.name == DISTORTION else units.displacement

    def said(self, units: Units) -> str:
        """Return what the range of the colours is, "" where it is that of all values."""
        return self.limits.said(self.unit(units), units.length)

    @classmethod
    def ranging(cls, samples: Samples, name: str, title: str) -> Self:
        """Return the field of samples, whose range is from its lowest to its highest value."""
        return cls(samples.places, samples.planes, samples.lattices, name, title, even_range(samples.everywhere))


def remembered(function: Callable[..., Result]) -> Callable[..., Result]:
    """Return a function that finds its last results again for the same objects, so that all pictures share samples."""
    kept = _REMEMBERED[function.__name__] = list[tuple[tuple[Any, ...], Any]]()

    @wraps(function)
    def found(*given: Any) -> Result:
        for known, result in kept:
            if all(old is new for old, new in zip(known, given, strict=True)):
                return cast(Result, result)
        kept.append((given, function(*given)))
        del kept[:-KEPT]
        return cast(Result, kept[-1][1])

    return found


def found_of(objects: Collection[object]) -> Found:
    """Return the samples that are remembered of these objects alone, for `recall` in another process."""
    numbers = {id(one) for one in objects}
    return [
        (name, given, result)
        for name in SAMPLED
        for given, result in _REMEMBERED[name]
        if numbers.issuperset(map(id, given))
    ]


def recall(found: Found) -> None:
    """Remember what another process has found of objects that came with it."""
    for name, given, result in found:
        _REMEMBERED[name].append((given, result))
        del _REMEMBERED[name][:-KEPT]


def sampled(body: BodyLike, parts: Parts) -> Samples:
    """Return the samples of a function on the patches of a body, which is given on groups of them."""
    count, (samples, lattice) = len(as_body(body)), sizes_of(body)
    places = np.arange(PER_PATCH * count) if count <= FEW else outer_faces(body)
    even = np.linspace(0.0, 1.0, lattice)
    every = [(numbers, values_on(np.arange(len(numbers)), even, even, even)) for numbers, values_on in parts]
    return Samples(places, on_planes(parts, places, samples), _in_order(every, count))


def sizes_of(body: BodyLike) -> tuple[int, int]:
    """Return the numbers of samples per direction of a face or section, and of the cube."""
    count = len(as_body(body))
    several = next(sizes for most, sizes in OF_MANY.items() if count <= most)
    return (SAMPLES, LATTICE) if count == 1 else OF_SEVERAL if count <= FEW else several


def lines_of(body: BodyLike, wanted: int) -> int:
    """Return the number of spaces between parameter lines of each patch: fewer of many, of very many no lines."""
    count = len(as_body(body))
    return wanted if count <= next(iter(OF_MANY)) else 1 if count <= LINED else 0


def on_planes(parts: Parts, places: IntArray, samples: int) -> Array:
    """Return values (k, samples, samples, ...) at some places (k,) among the faces and sections of all patches."""
    patches, planes = np.divmod(places, PER_PATCH)
    found = []
    for number, grid in enumerate(all_grids(samples)):
        on_plane = np.flatnonzero(planes == number)
        for numbers, values_on in parts:
            chosen = on_plane[np.isin(patches[on_plane], numbers)]
            if chosen.size:
                values = values_on(np.searchsorted(numbers, patches[chosen]), *grid)
                found.append((chosen, np.squeeze(values, axis=1 + PLANES[number][0])))
    return _in_order(found, len(places))


def _in_order(parts: Sequence[tuple[IntArray, Array]], count: int) -> Array:
    """Return values (count, ...), of which each part has those at its numbers."""
    found = np.empty((count, *parts[0][1].shape[1:]))
    for numbers, values in parts:
        found[numbers] = values
    return found


@remembered
def points_of(body: BodyLike) -> Samples:
    """Return the points (..., 3) of a body."""
    return sampled(body, maps_of(body))


@remembered
def hand_of(body: BodyLike) -> int:
    """Return the orientation of a volume, 1 or -1."""
    return orientation(as_body(body).only)


def maps_of(body: BodyLike) -> Parts:
    """Return the function that gives the points (..., 3) of a body."""
    return [(group.numbers, _grid_of(group.stack)) for group in as_body(body).groups]


def slopes_of(body: BodyLike) -> Parts:
    """Return the function that gives the first derivatives (..., 3, 3) of a body's maps."""
    return [(group.numbers, _slopes_of(group.stack)) for group in as_body(body).groups]


def _slopes_of(splines: SplineStack) -> OnGrid:
    return lambda rows, u, v, w: splines.take(rows).grid_slopes(u, v, w)


def _grid_of(splines: SplineStack) -> OnGrid:
    return lambda rows, u, v, w: splines.take(rows).grid(u, v, w)


def arap_of(body: BodyLike) -> Parts:
    """Return the function that gives the ARAP distortion.

    A volume is measured at volume 1, each of several patches against its own box.
    """
    glued = as_body(body)

    @cache
    def boxes() -> Array:
        return np.full((1, 3), UnitFrame.of(glued).length) if glued.is_single else own_boxes(glued)

    return [(group.numbers, partial(_arap_on, group, boxes)) for group in glued.groups]


def _arap_on(group: PatchGroup, boxes: Callable[[], Array], rows: IntArray, u: Array, v: Array, w: Array) -> Array:
    jacobians = group.stack.take(rows).grid_slopes(u, v, w)
    return in_boxes(unmirrored(jacobians, orientations(group)[rows]), boxes()[group.numbers[rows]])


@remembered
def distortion_of(body: BodyLike) -> ColoredField:
    """Return tanh(sqrt(ARAP) / 2), as the paper colours it, at volume 1; of several patches, each in its own box."""
    shares = sampled(body, arap_of(body)).each(lambda arap: np.tanh(np.sqrt(arap) / 2.0))
    title = f"tanh(√ARAP / 2), {'at volume 1' if as_body(body).is_single else 'each in its own box'}"
    return ColoredField(shares.places, shares.planes, shares.lattices, DISTORTION, title, ColorRange(0.0, 1.0))


@remembered
def vectors_of(solution: FieldOnBody) -> Samples:
    """Return the vectors (..., c) of a solution of several components, or its values (...)."""
    return sampled(solution.on_body, vectors_on(solution))


def vectors_on(solution: FieldOnBody) -> Parts:
    """Return the function that gives the vectors (..., c) of a solution of several components, or its values (...)."""
    return [(group.numbers, partial(_values_on, group, is_vector(solution))) for group in known_groups(solution)]


def is_vector(solution: FieldOnBody) -> bool:
    """Return whether a solution has an axis of components."""
    return solution.patches[0].coefficients.ndim == 4


def _values_on(group: FieldGroup, with_axis: bool, rows: IntArray, u: Array, v: Array, w: Array) -> Array:
    values = group.take(rows).function_on(u, v, w)
    return values if with_axis else values[..., 0]


@remembered
def solution_of(solution: FieldOnBody) -> ColoredField:
    """Return u_h, or the length of a vector u_h."""
    if not is_vector(solution):
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

    quantity: also a function for each group of patches, whose materials differ, see `solve.field_groups`.
    """
    try:
        groups = known_averages(solution)
        laws = quantity if isinstance(quantity, Sequence) else [quantity] * len(groups)
        parts = [(group.numbers, partial(_quantity_on, group, law)) for group, law in zip(groups, laws, strict=True)]
        samples = sampled(solution.on_body, parts)
    except np.linalg.LinAlgError:  # det J = 0
        return None
    if not all(np.all(np.isfinite(values)) for values in samples.everywhere):
        return None
    return ColoredField.ranging(samples, name, title)


def _quantity_on(group: FieldGroup, quantity: Quantity, rows: IntArray, u: Array, v: Array, w: Array) -> Array:
    return group_values(group.take(rows), quantity, u, v, w)


@remembered
def fields_of(solution: FieldOnBody) -> list[ColoredField]:
    """Return the fields that show a solution, first the field of its picture; of a body that is von Mises' stress."""
    fields = [solution_of(solution)]
    if is_spatial(solution):
        fields += components_of(solution)
    laws = [group.problem.form.quantities.get("von_mises") for group in known_groups(solution) if group.problem]
    if laws and None not in laws:
        stress = quantity_of(solution, [law for law in laws if law], STRESS, "von Mises stress")
        fields = fields if stress is None else [stress, *fields]
    return [_ranging(solution, field) for field in fields]


def _ranging(solution: FieldOnBody, field: ColoredField) -> ColoredField:
    """Return a field with the range of most of the body, outside of singular places as far as samples lie there.

    The range knows the places of the largest and the least value, if these lie outside of it.
    """
    none = SingularPlaces()
    places: SingularPlaces = getattr(solution, "singular", none) if field.name == STRESS else none  # u is finite there
    body = solution.on_body
    lattices, counted = points_of(body).lattices, None
    for spans in RADII if len(places) else ():
        outside = ~places.is_near(lattices.reshape(-1, 3), spans).reshape(lattices.shape[:-1])
        if outside.any():
            counted = outside
            break
    limits = range_of_most(field.everywhere, volumes_of(body), counted=counted)
    if limits.is_part:
        limits = replace(limits, places=_places(field, body), without=counted is not None)
    return replace(field, limits=limits)


def _places(field: ColoredField, body: BodyLike) -> tuple[list[float], list[float]]:
    """Return the places of the largest and of the least value of a field."""
    pairs = list(zip(field.everywhere, points_of(body).everywhere, strict=True))
    largest = max(pairs, key=lambda pair: float(pair[0].max()))
    least = min(pairs, key=lambda pair: float(pair[0].min()))
    ends = (largest[0].argmax(), largest[1]), (least[0].argmin(), least[1])
    at, last = (points.reshape(-1, 3)[number].tolist() for number, points in ends)
    return at, last


@remembered
def volumes_of(body: BodyLike) -> Array:
    """Return the volume (patches, n, n, n) that each sample of the lattices stands for, over its cell's."""
    points = points_of(body).lattices
    slopes = np.stack([np.gradient(points, axis=1 + axis) for axis in range(3)], axis=-1)
    ends = np.ones(points.shape[1])
    ends[[0, -1]] = 0.5
    return np.asarray(np.abs(np.linalg.det(slopes)) * np.einsum("i,j,k->ijk", ends, ends, ends))


known_groups = remembered(groups_of)
known_averages = remembered(averaged_groups)  # the same groups with one gradient where patches meet


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
    is_own = getattr(solution, "problem", None) is problem.on(body)
    groups = known_groups(solution) if is_own else groups_of(solution, as_body(body), problems_on(problem, body))
    parts = [(group.numbers, partial(_error_on, group, is_vector(solution))) for group in groups]
    samples = sampled(body, parts)
    limits = error_range([samples.everywhere])
    return ColoredField(samples.places, samples.planes, samples.lattices, "error", "|u − uₕ|", limits)


def _error_on(group: FieldGroup, with_axis: bool, rows: IntArray, u: Array, v: Array, w: Array) -> Array:
    chosen = group.take(rows)
    assert chosen.problem is not None  # it is given
    return error_at(
        _values_on(chosen, with_axis, np.arange(len(rows)), u, v, w), chosen.problem, chosen.points_on(u, v, w)
    )


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
