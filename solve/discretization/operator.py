"""Defines the operators of laws, matrix-free by sum factorization, and assembles an operator with its load in one pass.

For a scalar symmetric law, G = det J J^-1 kappa J^-T is stored, six numbers a quadrature point. Any other law is called
on planes of points: gradients are pulled back, the law turns them into fluxes, and the fluxes are pushed forward.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.sparse import coo_array

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import collocation
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..forms.form import Form, reaction
from . import group_kernels, kernels
from .quadrature import GaussRule, operator_rule
from .space import TrialSpace
from .stack import PatchStack, Piece, colours, of_law, of_patches
from .unknowns import Window

Source = Callable[[Array], Array]
ONE = np.zeros(1, dtype=np.int64)  # the number of the patch of a stack of one


class FaceTerm(Protocol):
    """Define terms of a matrix that are integrals over the images of faces of one name of k patches of one shape."""

    @property
    def name(self) -> str:
        """Return the name of the faces."""

    @property
    def patches(self) -> IntArray:
        """Return the numbers (k,) of the patches."""

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add the product of the terms and coefficients (k, c, n_u, n_v, n_w) to a result of the same shape."""

    def matrix(self, shape: tuple[int, ...]) -> coo_array:
        """Return the matrix of the terms for coefficients of a shape (c, n_u, n_v, n_w) of each patch, as one vector.

        The k patches come one after another.
        """

    def add_diagonal(self, component: int, diagonal: Array) -> None:
        """Add the diagonal of a component's block to an array (k, n_u, n_v, n_w)."""

    def add_lumped(self, component: int, diagonal: Array, share: float = 1.0) -> None:
        """Add the integral of the factor of u . v with each function to an array (k, n_u, n_v, n_w).

        share: of Nitsche's factor that counts where values are held weakly.
        """

    def stiffness(self, component: int) -> Array:
        """Return the integrals (k,) of the factor of u . v for one component, means over the faces' parameters."""


@dataclass(frozen=True, eq=False)
class MatrixFree:
    """Apply a matrix that is never assembled to coefficients (c, n_u, n_v, n_w), or (n_u, n_v, n_w) for one component.

    threads: the number of threads of a product. folded: the number of points of all processes where det J has the wrong
    sign. faces: the terms on the faces of the cube over which this process integrates; those on faces of several
    patches, which are in one term, are part of the body's matrix alone.
    """

    space: TrialSpace
    rule: GaussRule
    threads: int
    folded: int = field(default=0, kw_only=True)
    faces: Mapping[str, FaceTerm] = field(default_factory=dict, kw_only=True)

    @cached_property
    def tables(self) -> kernels.Tables:
        """Return the tables of the trial basis at the points of the quadrature rule."""
        return self.rule.tabulate(self.space.degrees, self.space.knots)

    @property
    def stack(self) -> PatchStack:
        """Return the patch as a stack of one."""
        return PatchStack((self.space,), (self.rule,), self.threads)

    def on_planes(self, task: Callable[[IntArray], None]) -> None:
        """Run a task on all points of u, in pieces.

        A task may add to the coefficients of the functions that are not zero at its points.
        """
        for pieces in colours(self.tables[0][0], self.space.degrees[0], self.threads):
            in_parallel(task, pieces, self.threads)

    def apply(self, coefficients: Array) -> Array:
        """Return the product with all coefficients, fixed ones included; for a slab, the integrals over its spans."""
        source = np.ascontiguousarray(coefficients).reshape(math.prod(coefficients.shape[:-3]), *self.space.shape)
        result = np.zeros_like(source)
        self.on_planes(lambda points: self._multiply(points, source, result))
        for face in self.faces.values():
            face.add_product(source[None], result[None])
        return result.reshape(coefficients.shape)

    def apply_free(self, free: Array) -> Array:
        """Return the product restricted to this process's free coefficients, of shape (c, ..) or (..)."""
        window = Window(self.space)
        return window.collect([self.apply(*window.spread(free))])

    def _multiply(self, points: IntArray, coefficients: Array, result: Array) -> None:
        """Add the part of some points of u to the product with coefficients (c, n_u, n_v, n_w)."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Operator(MatrixFree):
    """Apply the positive semidefinite matrix of a scalar symmetric law, the same for each component.

    factors: (q_u, 6 or 7, q_w, q_v), the six entries of G, and c |det J| where there is a reaction; with weights.
    component: the component of the law whose block this is.
    """

    factors: Array
    component: int = 0

    def _multiply(self, points: IntArray, coefficients: Array, result: Array) -> None:
        for component, total in zip(coefficients, result, strict=True):
            kernels.multiply_planes(component, points, self.tables, self.factors, total)

    def diagonal(self) -> Array:
        """Return the diagonal of the matrix, in the shape `space.shape`: squared basis functions replace the basis.

        For a slab it is the diagonal of the integrals over its spans.
        """
        return diagonals([self])[0]

    def dense(self, axis: int, derivative: int) -> Array:
        """Return the matrix (q, n) of a direction's functions, or of their derivatives, at its points."""
        knots, degree = self.space.knots[axis], self.space.degrees[axis]
        matrix: Array = collocation(knots, degree, self.rule.points[axis], derivative).toarray()
        return matrix


def diagonals(operators: Sequence[Operator]) -> list[Array]:
    """Return the diagonal (n_u, n_v, n_w) of each operator; operators of one shape are passed at once."""
    found: list[Any] = [None] * len(operators)
    for numbers, stack, factors in _stacks(operators):
        for number, result in zip(numbers, stack.diagonals(factors), strict=True):
            on_faces = np.zeros(result.shape)
            for face in operators[number].faces.values():
                face.add_diagonal(operators[number].component, on_faces[None])
            found[number] = result + on_faces if operators[number].faces else result
    return found


def _stacks(operators: Sequence[Operator]) -> Iterator[tuple[list[int], PatchStack, Array]]:
    """Yield the numbers of the operators of one shape, their stack, and their factors (k, q_u, 6 or 7, q_w, q_v)."""
    shapes = defaultdict(list)
    for number, operator in enumerate(operators):
        shapes[operator.space.degrees, operator.space.shape, operator.factors.shape].append(number)
    for numbers in shapes.values():
        own = [operators[number] for number in numbers]
        stack = PatchStack([one.space for one in own], [one.rule for one in own], own[0].threads, runs=(0, len(own)))
        yield numbers, stack, own[0].factors[None] if len(own) == 1 else np.stack([one.factors for one in own])


@dataclass(frozen=True, eq=False)
class FormOperator(MatrixFree):
    """Apply the matrix of any law's form.

    rows: (q_u, 3, 3, q_w, q_v), R of `PatchStack.geometry`, stored for a constant law; for other laws R is computed
    from the map in every product.
    """

    volume: BSplineVolume
    form: Form
    rows: Array | None

    @cached_property
    def stack(self) -> PatchStack:
        """Return the patch as a stack of one, with its map."""
        return PatchStack((self.space,), (self.rule,), self.threads, (self.volume,), (0, 1))

    def _multiply(self, points: IntArray, coefficients: Array, result: Array) -> None:
        rows = None if self.rows is None else self.rows[None]
        multiply_law(self.stack, (ONE, points), ONE, self.form, coefficients[None], result[None], rows)

    def block(self, component: int) -> Operator:
        """Return the symmetric part of a component's diagonal block, for its own gradient and value."""
        law, rule = (self.volume, self.space, self.form), self.rule
        block, _ = assemble(*law, rule=rule, component=component, threads=self.threads)
        assert isinstance(block, Operator)
        return replace(block, faces=self.faces, component=component)


def assemble(
    volume: BSplineVolume,
    space: TrialSpace,
    form: Form,
    source: Source | None = None,
    rule: GaussRule | None = None,
    *,
    component: int | None = 0,
    threads: int = 1,
) -> tuple[Operator | FormOperator, Array]:
    """Return operator and load (c, n_u, n_v, n_w) of a law on a volume; a slab has its part of the load.

    source: a function of the points (3, q_w, q_v) of a plane that returns (c, q_w, q_v); None for zero. component: the
    component whose symmetric part is assembled, without coupling of u and its gradient; None for the whole law.
    threads: the number of threads of the assembly and of the operator; the functions must then be safe for calls from
    several threads.

    |det J| takes the place of det J. This is right for a left-handed volume; on a folded map the form stays positive,
    and the solution can be shown but not trusted. The geometry is the volume's own, evaluated exactly in every trial
    space. Raises a ValueError that names a point where det J is zero.
    """
    rule = rule or operator_rule(space, "spline")
    stack = PatchStack((space,), (rule,), threads, (volume,), (0, 1))
    found, _, loads = assemble_stack(stack, [form], [source], component)
    return found[0], loads[0]


def assemble_stack(
    stack: PatchStack, forms: Sequence[Form], sources: Sequence[Source | None], component: int | None
) -> tuple[list[Any], Array | None, Array]:
    """Return the operators and the loads (k, c, n_u, n_v, n_w) of the laws of a stack's patches, as `assemble` does.

    A law's initial flux, tested with the gradients, is a part of the load where there is a source.

    What the operators store at the points, factors or rows, is part of one array (k, q_u, .., q_w, q_v), which is
    returned between them; None where they store nothing.
    """
    form, part, count, q_u = forms[0], component or 0, len(stack), stack.shape[0]
    loads = np.zeros((count, form.components, *stack.space.shape))
    negative, volumes = np.zeros((count, q_u), dtype=np.int64), np.zeros((count, q_u))
    factors = kept = None

    def fill(piece: Piece) -> None:
        patches, _ = piece
        law, source, shape = forms[patches[0]], sources[patches[0]], (len(patches), *stack.plane_shape)
        for q, rows, measure, x in stack.geometry(piece):
            _demand_invertible(stack, patches, q, measure)
            negative[patches, q], volumes[patches, q] = (measure < 0.0).sum(axis=(1, 2)), measure.sum(axis=(1, 2))
            size = np.abs(measure)
            if kept is not None:
                kept[patches, q] = rows
            if factors is not None:
                kappa = np.moveaxis(law.tensor(x, part).reshape(6, *shape), 1, 0)
                group_kernels.tensors_of_rows(rows, np.ascontiguousarray(kappa), patches, q, factors)
                if law.has_reaction:
                    factors[patches, q, 6] = law.mass(x, part).reshape(shape) * size
            if source is not None:
                densities = source(x).reshape(-1, *shape) * size
                stack.add_integrals(patches, q, np.moveaxis(densities, 1, 0), loads)
                if law.has_initial_flux:
                    flux = of_patches(
                        law.initial_flux(x) * (np.sqrt(size) if len(size) > 1 else np.sqrt(size[0])), size
                    )
                    _add_initial(stack, patches, q, flux, rows, loads)

    with stack.space.agreed():
        if component is not None:
            factors = np.empty((count, q_u, 6 + form.has_reaction, *stack.plane_shape))
        elif form.constant:
            kept = np.empty((count, q_u, 3, 3, *stack.plane_shape))
        stack.on_pieces(fill)
    folded = _folded(stack, negative.sum(axis=1), volumes.sum(axis=1))
    stored = kept if factors is None else factors
    own: Any = [None] * count if stored is None else stored
    found: list[Any] = []
    for i, (space, rule, at_points) in enumerate(zip(stack.spaces, stack.rules, own, strict=True)):
        if factors is None:
            law = stack.volumes[i], forms[i], at_points
            found.append(FormOperator(space, rule, stack.threads, *law, folded=folded[i]))
        else:
            found.append(Operator(space, rule, stack.threads, at_points, folded=folded[i]))
    return found, stored, loads


def _add_initial(stack: PatchStack, patches: IntArray, q: int, flux: Array, rows: Array, loads: Array) -> None:
    """Subtract a flux (m, c, 3, q_w, q_v), times the root of the measure, tested with gradients, from loads."""
    fields = np.empty((len(flux), flux.shape[1], 4, *stack.plane_shape))
    group_kernels.turn_fields(rows, np.ascontiguousarray(-flux), fields[:, :, 1:], True)
    group_kernels.spread_splines(fields, patches, stack.kinds[patches], q, stack.tables, False, loads)


def multiply_law(
    stack: PatchStack,
    piece: Piece,
    places: IntArray,
    form: Form,
    coefficients: Array,
    result: Array,
    kept: Array | None = None,
) -> None:
    """Add the part of some patches and points of u to the products of a law and coefficients of a group.

    places: (k,), the place of each patch of the stack in its group. coefficients, result: (g, c, n_u, n_v, n_w), of the
    group. kept: the rows of a constant law at all points; None where they are computed.
    """
    patches, points = piece
    which, kinds, count = places[patches], stack.kinds[patches], len(patches)
    fields = np.empty((count, coefficients.shape[1], 4, *stack.plane_shape))
    gradient = np.empty((count, coefficients.shape[1], 3, *stack.plane_shape))
    planes: Iterable[tuple[int, Array, Any, Any]] = stack.geometry(piece)
    if kept is not None:
        planes = ((q, kept[patches[0] : patches[-1] + 1, q], None, None) for q in points)
    for q, rows, measure, x in planes:
        group_kernels.evaluate_splines(coefficients, which, kinds, q, stack.tables, fields)
        group_kernels.turn_fields(rows, fields[:, :, 1:], gradient, False)
        values, slopes = of_law(fields[:, :, 0]), of_law(gradient)
        if measure is not None:
            scale = np.sqrt(np.abs(measure))
            scale = scale[0] if count == 1 else scale
            values = values * scale
            fields[:, :, 0] = of_patches(reaction(form, values, slopes, x) * scale, measure)
        flux = of_patches(np.asarray(form.flux(values, slopes, x), dtype=np.float64), fields[:, 0, 0])
        group_kernels.turn_fields(rows, np.ascontiguousarray(flux), fields[:, :, 1:], True)
        group_kernels.spread_splines(fields, which, kinds, q, stack.tables, form.has_reaction, result)


def derivative_of(form: Form, stack: PatchStack, piece: Piece) -> Array:
    """Return the matrices (m, q, c, 4, c, 4, q_w, q_v) of a linear law at some points, with weights.

    They lead from u and its parametric derivatives to the reaction and the flux that are integrated with the test
    functions' ones.
    """
    (patches, points), c = piece, form.components
    found = np.empty((len(patches), len(points), c, 4, c, 4, *stack.plane_shape))
    for place, (_, rows, measure, x) in enumerate(stack.geometry(piece)):
        scale, zero = np.sqrt(np.abs(measure)), np.zeros((len(patches), c, *stack.plane_shape))
        for d, b in np.ndindex(c, 4):
            value, slopes = zero.copy(), np.zeros((len(patches), c, 3, *stack.plane_shape))
            if b == 0:
                value[:, d] = scale
            else:
                slopes[:, d] = rows[:, b - 1]
            fields = of_law(value), of_law(slopes)
            flux = of_patches(np.asarray(form.flux(*fields, x), dtype=np.float64), measure)
            found[:, place, :, 0, d, b] = of_patches(reaction(form, *fields, x), measure) * scale[:, None]
            found[:, place, :, 1:, d, b] = np.einsum("maiwv,mciwv->mcawv", rows, flux)
    return found


def _demand_invertible(stack: PatchStack, patches: IntArray, q: int, measure: Array) -> None:
    """Raise ValueError where det J is zero on the planes of point `q`, from measure (m, q_w, q_v) = w det J."""
    if measure.all():
        return
    m, w, v = np.argwhere(measure == 0.0)[0]
    where = tuple(float(stack.rules[patches[m]].points[a][i]) for a, i in enumerate((q, v, w)))
    raise ValueError(f"volume: det J is zero at the parameters {where}; such a map has no inverse there")


def _folded(stack: PatchStack, negative: IntArray, volumes: Array) -> list[int]:
    """Return the number of points of each patch where det J has the other sign than its integral.

    negative: (k,), the number of points with det J < 0. volumes: (k,), the integrals of det J over a process's points.
    """
    total = stack.space.total
    points = total(math.prod(stack.shape))
    numbers: Any = total(negative)
    return [int(n) for n in np.where(total(volumes) < 0.0, points - numbers, numbers)]
