"""Preconditions several patches: the preconditioners of the patches, averaged, and trilinear functions of the vertices.

M = R (preconditioner of each patch, natural at interfaces) R^T + V (V^T A V)^+ V^T, where R averages the copies of each
unknown by weights. The first part is a sum of overlapping subspaces; the second, Galerkin's matrix on the functions
that are trilinear on each patch, moves patches that no boundary data hold as a whole (Toselli, Widlund, Domain
Decomposition Methods, 2005, sections 2.2 and 5).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import shared_numbers
from parameterize.spline.bspline import greville
from parameterize.spline.interface import Interface, face_layer

from ..discretization.operator import Operator, diagonals
from ..discretization.space import TrialSpace
from ..discretization.unknowns import Glued
from .preconditioner import FastDiagonalization

RANK = 1e-10  # of the largest eigenvalue of the coarse matrix: smaller ones belong to motions that nothing resists


@dataclass(frozen=True, eq=False)
class GluedPreconditioner:
    """Apply the preconditioner of one component of a law on several patches to vectors (m,).

    weights: (1, n_u, n_v, n_w) for each patch, the share of the patch in each unknown; the shares of an unknown sum to
    one. blocks: the preconditioners of the patches, natural at interfaces; None for a patch without unknowns. singular:
    whether a constant is free.
    """

    unknowns: Glued
    weights: tuple[Array, ...]
    blocks: tuple[FastDiagonalization | None, ...]
    coarse: "Coarse"
    singular: bool = False

    def __call__(self, residual: Array) -> Array:
        """Return the preconditioned residual (m,)."""
        spread = zip(self.weights, self.unknowns.spread(residual[None]), strict=True)
        shares = [weight * full for weight, full in spread]
        parts = self.coarse(shares)
        for block, weight, share, part in zip(self.blocks, self.weights, shares, parts, strict=True):
            if block is not None:
                window = block.space.window
                part[:, *window] += block(np.ascontiguousarray(share[:, *window]))
            part *= weight
        result = self.unknowns.collect(parts)[0]
        return result - result.mean() if self.singular else result

    @property
    def weakness(self) -> str:
        """Return the first part that a block had to leave out."""
        return next((block.weakness for block in self.blocks if block and block.weakness), "")


@dataclass(frozen=True, eq=False)
class Coarse:
    """Solve on the functions that are trilinear on each patch, given by their values at the free vertices.

    hats: for each patch the values of its vertices' functions along the three directions, (n, 2) each. inverse: (v, v),
    of Galerkin's matrix. vertices: for each patch the places (2, 2, 2) of its vertices, v where they are fixed.
    """

    hats: Sequence[tuple[Array, Array, Array]]
    vertices: Sequence[IntArray]
    inverse: Array

    @classmethod
    def of(cls, unknowns: Glued, operators: Sequence[Operator], interfaces: Sequence[Interface]) -> "Coarse":
        """Return the coarse solve of the operators of one component on the patches."""
        numbers, count = shared_numbers([(2, 2, 2)] * len(operators), interfaces)
        fixed = np.zeros(count, dtype=bool)
        for own, coefficients in zip(numbers, unknowns.numbers, strict=True):
            n_u, n_v, n_w = coefficients.shape
            fixed[own] |= unknowns.fixed[coefficients[:: n_u - 1, :: n_v - 1, :: n_w - 1]]
        free = count - int(fixed.sum())
        order = np.where(fixed, free, np.cumsum(~fixed) - 1)
        vertices = [order[own] for own in numbers]
        matrix = np.zeros((free + 1, free + 1))
        for operator, places in zip(operators, vertices, strict=True):
            flat = places.ravel()
            np.add.at(matrix, np.ix_(flat, flat), _galerkin(operator))  # a patch glued to itself has a vertex twice
        hats = [_hats(operator.space) for operator in operators]
        inverse = np.linalg.pinv(matrix[:-1, :-1], rcond=RANK, hermitian=True)
        return cls(hats, vertices, np.asarray(inverse, dtype=np.float64))

    def __call__(self, shares: Sequence[Array]) -> list[Array]:
        """Return V (V^T A V)^+ V^T r as coefficients (1, n_u, n_v, n_w) of each patch.

        shares: r, divided among the patches.
        """
        if not len(self.inverse):
            return [np.zeros_like(share) for share in shares]
        right = np.zeros(len(self.inverse) + 1)
        for (u, v, w), places, share in zip(self.hats, self.vertices, shares, strict=True):
            along_u = (u.T @ share.reshape(len(u), -1)).reshape(2, len(v), len(w))
            np.add.at(right, places, v.T @ along_u @ w)
        values = np.append(self.inverse @ right[:-1], 0.0)
        return [
            (u @ (v @ values[places] @ w.T).reshape(2, -1)).reshape(1, len(u), len(v), len(w))
            for (u, v, w), places in zip(self.hats, self.vertices, strict=True)
        ]


def shares_of(unknowns: Glued, operators: Sequence[Operator]) -> tuple[Array, ...]:
    """Return the weights of `GluedPreconditioner`: the diagonals of the operators over their sum.

    An interface between two materials then belongs to the stiffer patch. On a plate of 8 patches, whose conductivities
    are 1 and 10 000 by turns, that takes 18 iterations, with equal shares 107.
    """
    sizes = [np.abs(diagonal)[None] for diagonal in diagonals(operators)]
    sums = unknowns.spread(unknowns.collect(sizes))
    return tuple(
        np.divide(own, total, out=np.zeros_like(own), where=total > 0.0) for own, total in zip(sizes, sums, strict=True)
    )


def _hats(space: TrialSpace) -> tuple[Array, Array, Array]:
    """Return the coefficients (n, 2) of 1 - t and t in each direction of a space."""
    rows = (greville(knots, degree) for knots, degree in zip(space.knots, space.degrees, strict=True))
    u, v, w = (np.stack([1.0 - row, row], axis=1) for row in rows)
    return u, v, w


def _galerkin(operator: Operator) -> Array:
    """Return the matrix (8, 8) of an operator on the trilinear functions of a patch.

    The terms of faces are lumped: a quarter of their factor belongs to each vertex of the face.
    """
    ends = np.array([0.0, 0.0, 1.0, 1.0])
    small = replace(operator, space=TrialSpace((1, 1, 1), (ends, ends, ends), ()), faces={})
    matrix = np.stack([small.apply(unit.reshape(2, 2, 2)).ravel() for unit in np.eye(8)])
    for name, face in operator.faces.items():
        on_face = face_layer(np.arange(8).reshape(2, 2, 2), name).ravel()
        matrix[on_face, on_face] += 0.25 * face.stiffness(operator.component)
    return matrix
