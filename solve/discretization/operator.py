"""The operator of a scalar symmetric law, matrix-free: -div(kappa grad u) + c u.

In parametric coordinates the form is the integral of grad v . G grad u with G = det J J^-1 kappa J^-T; six numbers a
quadrature point hold it, and sum factorization applies it (Antolin, Buffa, Calabro, Martinelli, Sangalli, CMAME 2015).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import FACE_NAMES

from ..forms.data import check_faces
from ..threads import colours, in_parallel
from . import kernels, product
from .quadrature import GaussRule, GroupTable, Table
from .space import TrialSpace

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the order of the six factors
Window = tuple[slice, slice, slice]


def free_window(space: TrialSpace, dirichlet: Collection[str] = FACE_NAMES) -> Window:
    """Return the coefficients that Dirichlet data on the named cube faces ("u0" ... "w1") leave free, a box.

    Raises ValueError for a name that is no face.
    """
    check_faces("dirichlet", dirichlet)
    sides = [[name in dirichlet for name in FACE_NAMES[2 * a : 2 * a + 2]] for a in range(3)]
    u, v, w = (slice(int(low), n - int(high)) for (low, high), n in zip(sides, space.shape, strict=True))
    return u, v, w


@dataclass(frozen=True, eq=False)
class Operator:
    """Symmetric positive semidefinite matrix of the form, never assembled.

    tables: the trial basis at the points of the rule. window: the free coefficients. threads: of a product.
    factors: (q_u, v blocks, q_w, 6 or 7, LANES), the six of G and c w det J where there is a reaction; weights
    included, points of v in blocks, the last one filled up with zeros.
    Coefficients are (n_u, n_v, n_w), or with a leading axis of one.
    """

    space: TrialSpace
    rule: GaussRule
    tables: tuple[Table, Table, Table]
    factors: Array
    window: Window
    threads: int = 1

    @classmethod
    def empty(
        cls, space: TrialSpace, rule: GaussRule, has_reaction: bool, window: Window, threads: int = 1
    ) -> Operator:
        """Return an operator whose factors are still to be written."""
        blocks, terms = -(-rule.shape[1] // kernels.LANES), 6 + has_reaction
        factors = np.empty((rule.shape[0], blocks, rule.shape[2], terms, kernels.LANES))
        return cls(space, rule, rule.tabulate(space.degrees, space.knots), factors, window, threads)

    @cached_property
    def _groups(self) -> tuple[GroupTable, GroupTable]:
        """Of directions v and w."""
        return self.tables[1].grouped(), self.tables[2].grouped()

    @cached_property
    def _pieces(self) -> tuple[list[IntArray], list[IntArray]]:
        return colours(self.tables[0].first, self.space.degrees[0], self.threads)

    def apply(self, coefficients: Array) -> Array:
        """Return the product with coefficients of shape `space.shape`, those that are not free included."""
        return self._multiply(coefficients, (0, 0, 0))

    def apply_free(self, free: Array) -> Array:
        """Return the product restricted to the free coefficients, an array of the window's shape."""
        u, v, w = self.window
        return self._multiply(free, (u.start, v.start, w.start))

    def _multiply(self, values: Array, start: tuple[int, int, int]) -> Array:
        """Return the block of the matrix that belongs to values (m_u, m_v, m_w) from `start` on, times them."""
        n_u, n_v, n_w = self.space.shape
        packed = np.zeros((n_u, -(-n_w // product.ROWS), n_v, product.ROWS))
        total, box = np.zeros_like(packed), values.shape[-3:]
        product.pack(values.reshape(box), *start, packed)
        for pieces in self._pieces:
            in_parallel(lambda points: self.multiply_planes(points, packed, total), pieces, self.threads)
        result = np.empty(box)
        product.unpack(total, *start, result)
        return result.reshape(values.shape)

    def multiply_planes(self, points: IntArray, packed: Array, total: Array) -> None:
        """Add the part of some points of u to a packed total."""
        q_u, v_blocks, q_w, terms, lanes = self.factors.shape
        factors = self.factors.reshape(q_u, v_blocks, q_w * terms * lanes)
        tables = (self.tables[0], *self._groups)
        product.multiply_planes(packed, points, *tables, factors, (0,) * terms, self.space.shape[2], total)

    def diagonal(self) -> Array:
        """Return the diagonal of the matrix, shape `space.shape`: squared basis functions in place of the basis."""
        result = np.zeros(self.space.shape)
        u, v, w = self.tables
        products = [  # per direction, (q, degree + 1): values of B B, B B' and B' B' at index sum of derivatives
            (t.values[0] ** 2, t.values[0] * t.values[1], t.values[1] ** 2) for t in self.tables
        ]
        pairs = (*PAIRS, ())[: self.factors.shape[3]]

        def add(points: IntArray) -> None:
            plane = np.empty(self.space.shape[1:])
            for q in points:
                window = slice(u.first[q], u.first[q] + u.values.shape[2])
                for index, pair in enumerate(pairs):
                    in_u, in_v, in_w = (products[a][pair.count(a)] for a in range(3))
                    kernels.integrate_plane(self.factors[q], index, v.first, in_v, w.first, in_w, plane)
                    twice = 2.0 if len(set(pair)) == 2 else 1.0
                    result[window] += twice * np.multiply.outer(in_u[q], plane)

        for pieces in self._pieces:
            in_parallel(add, pieces, self.threads)
        return result

    def mean_mass(self) -> float:
        """Return the average over the cube of c det J."""
        if self.factors.shape[3] < 7:
            return 0.0
        return float(sum(plane[:, :, 6].sum() for plane in self.factors))


def prepare(space: TrialSpace, rule: GaussRule, reaction: bool = False) -> None:
    """Compile the product for a space's degrees and a rule, or load it from the cache: no timing contains it."""
    # A large block freed teaches glibc (mallopt(3), M_MMAP_THRESHOLD) to keep freed memory. Else every temporary of a
    # plane goes back to the system and is faulted in again: formulas take five times as long.
    np.empty(2**21)
    tables = rule.tabulate(space.degrees, space.knots)
    factors = np.zeros((0, 0, 0, 6 + reaction, kernels.LANES))
    packed = np.zeros((1, 1, 1, product.ROWS))
    Operator(space, rule, tables, factors, free_window(space)).multiply_planes(np.arange(0), packed, packed)


def to_blocks(plane: Array) -> Array:
    """A plane (q_w, q_v) in blocks of points of v: (v blocks, q_w, LANES), filled up with zeros."""
    q_w, q_v = plane.shape
    padded = np.zeros((q_w, -(-q_v // kernels.LANES) * kernels.LANES))
    padded[:, :q_v] = plane
    return padded.reshape(q_w, -1, kernels.LANES).transpose(1, 0, 2)
