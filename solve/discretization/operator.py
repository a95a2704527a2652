"""Defines the operators of laws, matrix-free by sum factorization, and assembles an operator with its load in one pass.

For a scalar symmetric law, G = det J J^-1 kappa J^-T is stored, six numbers a quadrature point. Any other law is called
on planes of points: gradients are pulled back, the law turns them into fluxes, and the fluxes are pushed forward.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import collocation
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..forms.form import Form, reaction
from ..forms.jets import PAIRS
from ..forms.mass import WithMass
from . import kernels
from .quadrature import GaussRule, geometry_planes, operator_rule
from .space import TrialSpace
from .unknowns import Window


class FaceTerm(Protocol):
    """Define terms of a matrix that are integrals over the image of a face."""

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add the product of the terms and coefficients (c, n_u, n_v, n_w) to a result of the same shape."""

    def add_diagonal(self, component: int, diagonal: Array) -> None:
        """Add the diagonal of a component's block to an array (n_u, n_v, n_w)."""

    def add_lumped(self, component: int, diagonal: Array) -> None:
        """Add the integral of the factor of u . v with each function to an array (n_u, n_v, n_w)."""

    def stiffness(self, component: int) -> float:
        """Return the integral of the factor of u . v for one component, the mean over the face's parameters."""


SHARES = 4  # of the pieces of one colour a thread: some wait less where others take longer
LAYERS = 4  # of elements in a piece of work, where the degree allows so few


def colours(first: IntArray, degree: int, threads: int) -> list[list[IntArray]]:
    """Return consecutive points in pieces, as two lists that take the pieces by turns.

    first: (q,), the number of the first function that is not zero at each point. A piece covers at least as many layers
    of elements as the degree, so that no two pieces of one list share a basis function: these pieces may be added to
    the same array at the same time, and each sum has one order. The pieces of one list are joined to a few shares a
    thread, or to one share for a single thread.
    """
    layers = np.unique(first, return_inverse=True)[1]
    pieces = np.split(np.arange(len(first)), np.flatnonzero(np.diff(layers // max(degree, LAYERS))) + 1)
    shares = SHARES * threads if threads > 1 else 1
    halves = pieces[0::2], pieces[1::2]
    return [[np.concatenate(half[i::shares]) for i in range(min(len(half), shares))] for half in halves]


@dataclass(frozen=True, eq=False)
class MatrixFree:
    """Apply a matrix that is never assembled to coefficients (c, n_u, n_v, n_w), or (n_u, n_v, n_w) for one component.

    threads: the number of threads of a product. folded: the number of points of all processes where det J has the wrong
    sign. faces: the terms on the faces of the cube over which this process integrates.
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
            face.add_product(source, result)
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
        result = np.zeros(self.space.shape)
        products = [  # per direction, (3, q, degree + 1): values of B B, B B' and B' B' at index sum of derivatives
            (first, np.stack([b[0] ** 2, b[0] * b[1], b[1] ** 2]), functions) for first, b, functions in self.tables
        ]

        def add(points: IntArray) -> None:
            for q in points:
                for entry, pair in zip(self.factors[q], (*PAIRS, ()), strict=False):
                    twice = 2.0 if len(set(pair)) == 2 else 1.0
                    add_integrals(products, q, twice * entry, result, tuple(pair.count(a) for a in range(3)))

        self.on_planes(add)
        on_faces = np.zeros(self.space.shape)
        for face in self.faces.values():
            face.add_diagonal(self.component, on_faces)
        return result + on_faces

    def dense(self, axis: int, derivative: int) -> Array:
        """Return the matrix (q, n) of a direction's functions, or of their derivatives, at its points."""
        knots, degree = self.space.knots[axis], self.space.degrees[axis]
        matrix: Array = collocation(knots, degree, self.rule.points[axis], derivative).toarray()
        return matrix


@dataclass(frozen=True, eq=False)
class FormOperator(MatrixFree):
    """Apply the matrix of any law's form.

    rows: (q_u, 3, 3, q_w, q_v), R of `geometry_planes`, stored for a constant law; for other laws R is computed from
    the map in every product.
    """

    volume: BSplineVolume
    form: Form
    rows: Array | None

    def _multiply(self, points: IntArray, coefficients: Array, result: Array) -> None:
        form, shape = self.form, self.rule.plane_shape
        fields, gradient = np.empty((len(coefficients), 4, *shape)), np.empty((len(coefficients), 3, *shape))
        kept = self.rows
        planes: Iterable[tuple[int, Array, Any, Any]] = geometry_planes(self.volume, self.rule, points)
        if kept is not None:
            planes = ((q, kept[q], None, None) for q in points)
        for q, rows, measure, x in planes:
            for component, plane in zip(coefficients, fields, strict=True):
                kernels.evaluate_plane(component, q, self.tables, plane)
            kernels.turn(rows, fields[:, 1:], gradient, False)
            values = fields[:, 0]
            if measure is not None:
                scale = np.sqrt(np.abs(measure))
                values = values * scale
                fields[:, 0] = reaction(form, values, gradient, x) * scale
            flux = np.ascontiguousarray(form.flux(values, gradient, x), dtype=np.float64)
            kernels.turn(rows, flux, fields[:, 1:], True)
            for plane, total in zip(fields, result, strict=True):
                kernels.spread_plane(plane, q, self.tables, form.has_reaction, total)

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
    source: Callable[[Array], Array] | None = None,
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
    parts = space, rule, threads
    basis, part = MatrixFree(*parts), component or 0
    load = np.zeros((form.components, *space.shape))
    negative = []
    factors = kept = None

    def fill(points: IntArray) -> None:
        for q, rows, measure, x in geometry_planes(volume, rule, points):
            negative.append(_count_negative(measure, rule, q))
            size = np.abs(measure)
            if kept is not None:
                kept[q] = rows
            if factors is not None:
                kernels.tensor_factors(rows, np.ascontiguousarray(form.tensor(x, part)), factors[q])
                if form.has_reaction:
                    np.multiply(form.mass(x, part), size, out=factors[q, 6])
            if source is not None:
                for density, total in zip(source(x), load, strict=True):
                    add_integrals(basis.tables, q, density * size, total)

    with space.agreed():
        if component is not None:
            factors = np.empty((rule.shape[0], 6 + form.has_reaction, *rule.plane_shape))
        elif form.constant:
            kept = np.empty((rule.shape[0], 3, 3, *rule.plane_shape))
        basis.on_planes(fill)
    folded = space.total(sum(negative))
    if folded and orientation(volume) < 0:
        folded = space.total(int(np.prod(rule.shape))) - folded
    if factors is None:
        return FormOperator(*parts, volume, form, kept, folded=folded), load
    return Operator(*parts, factors, folded=folded), load


def with_mass(
    volume: BSplineVolume, operator: Operator | FormOperator, form: Form, factor: float
) -> Operator | FormOperator:
    """Return the operator of a law on a volume plus `factor` times the mass matrix, with the terms on faces."""
    law = WithMass(form, factor)
    if isinstance(operator, FormOperator):
        return replace(operator, form=law, rows=None)
    whole, _ = assemble(volume, operator.space, law, rule=operator.rule, threads=operator.threads)
    assert isinstance(whole, Operator)
    return replace(operator, factors=whole.factors)


def add_integrals(
    tables: Collection[kernels.Table], q: int, field: Array, result: Array, kinds: tuple[int, ...] = (0, 0, 0)
) -> None:
    """Add the integrals of a field (q_w, q_v) of a plane, with weights, times each function to (n_u, n_v, n_w).

    kinds: for each direction, 0 for the values in its table and 1 for the derivatives.
    """
    (first, u, _), (first_v, v, functions_v), (first_w, w, functions_w) = tables
    _, n_v, n_w = result.shape
    lines, plane = np.zeros((n_w, field.shape[1])), np.zeros((n_v, n_w))
    kernels.spread(first_w, w[kinds[2]], functions_w, field, lines)
    kernels.spread(first_v, v[kinds[1]], functions_v, np.ascontiguousarray(lines.T), plane)
    result[first[q] : first[q] + u.shape[2]] += np.multiply.outer(u[kinds[0], q], plane)


def _count_negative(measure: Array, rule: GaussRule, q: int) -> int:
    """Return the number of points with det J < 0 on the plane of point `q`, from measure (q_w, q_v) = w det J."""
    if measure.min() > 0.0:
        return 0
    flat = np.argwhere(measure == 0.0)
    if flat.size:
        w, v = flat[0]
        where = tuple(float(rule.points[a][i]) for a, i in enumerate((q, v, w)))
        raise ValueError(f"volume: det J is zero at the parameters {where}; such a map has no inverse there")
    return int(np.count_nonzero(measure < 0.0))
