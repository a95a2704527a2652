"""The operator of -div(kappa grad u) + c u, matrix-free, and the load vector assembled in the same pass.

In parametric coordinates the form is the integral of grad v . G grad u with G = det J J^-1 kappa J^-T; six numbers a
Gauss point hold it, and sum factorization applies it (Antolin, Buffa, Calabro, Martinelli, Sangalli, CMAME 2015).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from ..threads import colours, in_parallel
from . import kernels, product
from .planes import count_folded, map_planes
from .quadrature import GaussRule, SpanTable, Table, gauss_rule, span_tables
from .space import TrialSpace

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the order of the six factors
Window = tuple[slice, slice, slice]
ScalarFunction = Callable[[Array, Array, Array], Array]


def free_window(space: TrialSpace, dirichlet: Collection[str] = FACE_NAMES) -> Window:
    """The coefficients that Dirichlet data on the named cube faces ("u0" ... "w1") leave free, a box of the array.

    Raises ValueError for a name that is no face.
    """
    unknown = sorted(set(dirichlet) - set(FACE_NAMES))
    if unknown:
        raise ValueError(f"dirichlet: {unknown[0]!r} is no face of the cube; the faces are {', '.join(FACE_NAMES)}")
    sides = [[name in dirichlet for name in FACE_NAMES[2 * a : 2 * a + 2]] for a in range(3)]
    u, v, w = (slice(int(low), n - int(high)) for (low, high), n in zip(sides, space.shape, strict=True))
    return u, v, w


@dataclass(frozen=True, eq=False)
class Operator:
    """Symmetric positive semidefinite matrix of the form, never assembled.

    tables: the trial basis at the Gauss points. window: the free coefficients. threads: of a product.
    factors: (q_u, v blocks, q_w, 6 or 7, LANES), the six of G and c w det J where there is a reaction; weights
    included, points of v in blocks, the last one filled up with zeros.
    """

    space: TrialSpace
    tables: tuple[Table, Table, Table]
    factors: Array
    window: Window
    threads: int = 1

    @cached_property
    def _spans(self) -> tuple[SpanTable, SpanTable, SpanTable]:
        return span_tables(self.space, self.tables)

    def apply(self, coefficients: Array) -> Array:
        """The product with a coefficient array of shape `space.shape`, rows and columns that are not free included."""
        return self._multiply(coefficients, (0, 0, 0))

    def apply_free(self, free: Array) -> Array:
        """The product restricted to the free coefficients, an array of the window's shape."""
        u, v, w = self.window
        return self._multiply(free, (u.start, v.start, w.start))

    def _multiply(self, values: Array, start: tuple[int, int, int]) -> Array:
        """The block of the matrix that belongs to values (m_u, m_v, m_w) from `start` on, times them."""
        n_u, n_v, n_w = self.space.shape
        packed = np.zeros((n_u, -(-n_w // product.ROWS), n_v, product.ROWS))
        total = np.zeros_like(packed)
        product.pack(values, *start, packed)
        for pieces in colours(len(self._spans[0].first), self.space.degrees[0]):
            in_parallel(lambda layers: self._run(layers, packed, total), pieces, self.threads)
        result = np.empty(values.shape)
        product.unpack(total, *start, result)
        return result

    def _run(self, layers: NDArray[np.int64], packed: Array, total: Array) -> None:
        """Add the part of some layers of elements to a packed total."""
        q_u, v_blocks, q_w, terms, lanes = self.factors.shape
        spans_w = len(self._spans[2].first)
        factors = self.factors.reshape(q_u, v_blocks, spans_w, q_w // spans_w * terms * lanes)
        product.multiply_layers(packed, layers, *self._spans, factors, (0,) * terms, self.space.shape[2], total)

    def diagonal(self) -> Array:
        """The diagonal of the matrix, shape `space.shape`: squared basis functions in place of the basis."""
        result = np.zeros(self.space.shape)
        u, v, w = self.tables
        products = [  # per direction, (q, degree + 1): values of B B, B B' and B' B' at index sum of derivatives
            (t.values[0] ** 2, t.values[0] * t.values[1], t.values[1] ** 2) for t in self.tables
        ]
        pairs = (*PAIRS, ())[: self.factors.shape[3]]

        def add(layers: NDArray[np.int64]) -> None:
            plane = np.empty(self.space.shape[1:])
            per_span = len(u.first) // len(self._spans[0].first)
            for q in range(per_span * layers[0], per_span * (layers[-1] + 1)):
                window = slice(u.first[q], u.first[q] + u.values.shape[2])
                for index, pair in enumerate(pairs):
                    in_u, in_v, in_w = (products[a][pair.count(a)] for a in range(3))
                    field = from_blocks(self.factors[q, :, :, index], len(v.first))
                    kernels.integrate_plane(field, v.first, in_v, w.first, in_w, plane)
                    twice = 2.0 if len(set(pair)) == 2 else 1.0
                    result[window] += twice * np.multiply.outer(in_u[q], plane)

        for pieces in colours(len(self._spans[0].first), self.space.degrees[0]):
            in_parallel(add, pieces, self.threads)
        return result

    def mean_mass(self) -> float:
        """The average over the cube of c det J."""
        if self.factors.shape[3] < 7:
            return 0.0
        return float(sum(plane[:, :, 6].sum() for plane in self.factors))


@dataclass(frozen=True, eq=False)
class System:
    """Operator, load vector (n_u, n_v, n_w), and how many of the Gauss points have det J < 0."""

    operator: Operator
    load: Array
    folded: int
    points: int


def assemble(
    volume: BSplineVolume,
    space: TrialSpace,
    source: ScalarFunction,
    rule: GaussRule | None = None,
    *,
    kappa: ScalarFunction | None = None,
    reaction: ScalarFunction | None = None,
    window: Window | None = None,
    threads: int = 1,
) -> System:
    """One pass over the Gauss points: operator and load vector of -div(kappa grad u) + c u = source on the volume.

    source, kappa, reaction: functions of x, y, z, called with arrays (q_w, q_v), one plane of Gauss points at a time.
    kappa: returns an array of that shape or, for a symmetric tensor, (6, q_w, q_v) in the order xx, xy, xz, yy, yz, zz;
        None for the identity. reaction: c; None for zero.
    window: the free coefficients, as `free_window` gives them (default: all but those of the six faces).
    threads: of this pass and of the operator; the functions must then be safe to call from several at a time.

    Where the map is folded, |det J| takes the place of det J.

    The geometry is the volume's own, evaluated exactly whatever the trial space.
    Raises ValueError where det J is zero at a Gauss point, naming it.
    """
    rule = rule or gauss_rule(space)
    tables = rule.tabulate(space.degrees, space.knots)
    u, v, w = tables
    terms = 6 if reaction is None else 7
    factors = np.empty((rule.shape[0], -(-rule.shape[1] // kernels.LANES), rule.shape[2], terms, kernels.LANES))
    load = np.zeros(space.shape)
    spans = span_tables(space, tables)[0]
    per_span = spans.values.shape[1]
    folded = []

    def fill(layers: NDArray[np.int64]) -> None:
        measure, plane = np.empty(rule.plane_shape), np.empty(space.shape[1:])
        ones = np.ones(rule.plane_shape)
        for q, fields in map_planes(volume, rule, range(per_span * layers[0], per_span * (layers[-1] + 1))):
            weights, where = rule.plane_weights(q), fields[:, 0]
            coefficient = ones if kappa is None else kappa(*where)
            factorize = kernels.plane_factors if coefficient.ndim == 2 else kernels.plane_tensor_factors
            factorize(fields, weights, np.ascontiguousarray(coefficient), factors[q], measure)
            turned = count_folded(measure, rule, q)
            if turned:  # measured with |det J|, the form stays positive: an answer to show, if not to trust
                folded.append(turned)
                factors[q, :, :, :6] *= to_blocks(np.sign(measure))[:, :, None]
                np.abs(measure, out=measure)
            if reaction is not None:
                factors[q, :, :, 6] = to_blocks(reaction(*where) * measure)
            kernels.integrate_plane(source(*where) * measure, v.first, v.values[0], w.first, w.values[0], plane)
            load[u.first[q] : u.first[q] + u.values.shape[2]] += np.multiply.outer(u.values[0, q], plane)

    for pieces in colours(len(spans.first), space.degrees[0]):
        in_parallel(fill, pieces, threads)
    operator = Operator(space, tables, factors, window or free_window(space), threads)
    return System(operator, load, sum(folded), int(np.prod(rule.shape)))


def prepare(space: TrialSpace, reaction: bool = False) -> None:
    """Compile the product for a space's degrees, or load it from the cache, so that no timing contains it."""
    # A large block freed teaches glibc (mallopt(3), M_MMAP_THRESHOLD) to keep freed memory. Else every temporary of a
    # plane goes back to the system and is faulted in again: formulas take five times as long.
    np.empty(2**21)
    tables = gauss_rule(space).tabulate(space.degrees, space.knots)
    spans = span_tables(space, tables)[2]
    factors = np.zeros((0, 0, spans.values.shape[0] * spans.values.shape[1], 6 + reaction, kernels.LANES))
    packed = np.zeros((1, 1, 1, product.ROWS))
    Operator(space, tables, factors, free_window(space))._run(np.arange(0), packed, packed)


def to_blocks(plane: Array) -> Array:
    """A plane (q_w, q_v) in blocks of points of v: (v blocks, q_w, LANES), filled up with zeros."""
    q_w, q_v = plane.shape
    padded = np.zeros((q_w, -(-q_v // kernels.LANES) * kernels.LANES))
    padded[:, :q_v] = plane
    return padded.reshape(q_w, -1, kernels.LANES).transpose(1, 0, 2)


def from_blocks(blocks: Array, q_v: int) -> Array:
    """The plane (q_w, q_v) that `to_blocks` has cut, in memory of its own."""
    plane = blocks.transpose(1, 0, 2).reshape(blocks.shape[1], -1)
    return np.ascontiguousarray(plane[:, :q_v])
