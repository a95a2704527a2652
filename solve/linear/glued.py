"""Preconditions several patches: the preconditioners of the patches, averaged, and trilinear functions of the vertices.

M = R (preconditioner of each patch, natural at interfaces) R^T + V (V^T A V)^+ V^T, where R averages the copies of each
unknown by weights. The first part is a sum of overlapping subspaces; the second, Galerkin's matrix on the functions
that are trilinear on each patch, moves patches that no boundary data hold as a whole (Toselli, Widlund, Domain
Decomposition Methods, 2005, sections 2.2 and 5).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import shared_numbers
from parameterize.spline.bspline import greville
from parameterize.spline.interface import Interface, face_layer

from ..discretization.groups import OnPatches
from ..discretization.operator import Operator, diagonals, products
from ..discretization.space import TrialSpace
from ..discretization.unknowns import Glued
from .preconditioner import FastDiagonalization
from .stacked import StackedDiagonalization, along_axes, diagonalizations

Inverse = Callable[[Array], Array]

DENSE = 500  # vertices up to which the coarse matrix is inverted, beyond it is factorized
RANK = 1e-10  # of the largest eigenvalue of the coarse matrix: smaller ones belong to motions that nothing resists


@dataclass(frozen=True, eq=False)
class GluedPreconditioner:
    """Apply the preconditioner of one component of a law on several patches to vectors (m,).

    weights: the share of each patch (1, n_u, n_v, n_w) in each unknown; the shares of an unknown sum to one. stacks:
    the preconditioners of patches of one shape, natural at interfaces, with the number of their group and their places
    in it. alone: those of single patches by their numbers, None for a patch without unknowns. singular: whether a
    constant is free.
    """

    unknowns: Glued
    weights: OnPatches
    stacks: Sequence[tuple[int, IntArray, StackedDiagonalization]]
    alone: Mapping[int, FastDiagonalization | None]
    coarse: "Coarse"
    singular: bool = False

    @classmethod
    def of(
        cls, unknowns: Glued, operators: Sequence[Operator], interfaces: Sequence[Interface]
    ) -> "GluedPreconditioner":
        """Return the preconditioner of the operators of one component on the patches."""
        own = diagonals(operators)
        stacks, alone = diagonalizations(operators, own)
        groups = [dict(zip(group, range(len(group)), strict=True)) for group in unknowns.layout.groups]
        group_of = {number: group for group, places in enumerate(groups) for number in places}
        placed = [
            (group_of[numbers[0]], np.array([groups[group_of[numbers[0]]][number] for number in numbers]), stack)
            for numbers, stack in stacks
            if len(numbers)
        ]
        held = {number: block and block.held() for number, block in alone.items()}
        is_open = all(stack.singular.all() for _, stack in stacks)
        is_open &= all(block is not None and block.singular for block in alone.values())
        coarse = Coarse.of(unknowns, operators, interfaces)
        return cls(unknowns, shares_of(unknowns, own), placed, held, coarse, is_open)

    def __call__(self, residual: Array) -> Array:
        """Return the preconditioned residual (m,)."""
        shares = self.unknowns.spread(residual[None])
        shares.flat[:] *= self.weights.flat
        result = self.coarse(shares)
        parts, totals = list(shares.in_groups), list(result.in_groups)
        for group, places, stack in self.stacks:
            totals[group][places, 0] += stack(parts[group][places, 0])
        for number, block in self.alone.items():
            if block is not None:
                window = block.space.window
                result[number][:, *window] += block(np.ascontiguousarray(shares[number][:, *window]))
        result.flat[:] *= self.weights.flat
        found = self.unknowns.collect(result)[0]
        return found - found.mean() if self.singular else found

    @property
    def weakness(self) -> str:
        """Return the first part that a block had to leave out."""
        return next((block.weakness for block in self.alone.values() if block and block.weakness), "")


@dataclass(frozen=True, eq=False)
class Coarse:
    """Solve on the functions that are trilinear on each patch, given by their values at the free vertices.

    hats: for each group the values of the vertices' functions along the three directions, (g, n, 2) each. vertices: for
    each group the places (g, 2, 2, 2) of the vertices of its patches, `count` where they are fixed. inverse: that of
    Galerkin's matrix. count: the number of free vertices.
    """

    hats: Sequence[tuple[Array, Array, Array]]
    vertices: Sequence[IntArray]
    inverse: Inverse
    count: int

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
        places = order[np.stack(numbers)]
        flat = places.reshape(-1, 8)
        entries = galerkin(operators).ravel(), (np.repeat(flat, 8, axis=1).ravel(), np.tile(flat, 8).ravel())
        matrix = coo_array(entries, shape=(free + 1,) * 2).tocsc()[:-1, :-1]  # copies of a vertex are added
        groups = [np.array(group) for group in unknowns.layout.groups]
        hats = [_hats([operators[number].space for number in group]) for group in groups]
        return cls(hats, [places[group] for group in groups], _inverse(matrix), free)

    def __call__(self, shares: OnPatches) -> OnPatches:
        """Return V (V^T A V)^+ V^T r as coefficients (1, n_u, n_v, n_w) of each patch.

        shares: r, divided among the patches.
        """
        result = shares.layout.empty(1)
        if not self.count:
            return result
        right = np.zeros(self.count + 1)
        for (u, v, w), places, share in zip(self.hats, self.vertices, shares.in_groups, strict=True):
            at_vertices = along_axes(u.mT, v.mT, w.mT, share[:, 0])
            right += np.bincount(places.ravel(), at_vertices.ravel(), len(right))
        values = np.append(self.inverse(right[:-1]), 0.0)
        for (u, v, w), places, total in zip(self.hats, self.vertices, result.in_groups, strict=True):
            total[:, 0] = along_axes(u, v, w, values[places])
        return result


def _inverse(matrix: csc_array) -> Inverse:
    """Return the inverse of a matrix (v, v) without the motions that nothing resists; of a large one, with a share."""
    if matrix.shape[0] <= DENSE:
        inverse = np.asarray(np.linalg.pinv(matrix.toarray(), rcond=RANK, hermitian=True), dtype=np.float64)
        return lambda right: np.asarray(inverse @ right)
    shifted = (matrix + RANK * diags_array(matrix.diagonal())).tocsc()
    factor = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return lambda right: np.asarray(factor.solve(right))


def shares_of(unknowns: Glued, diagonals: Sequence[Array]) -> OnPatches:
    """Return the weights of `GluedPreconditioner`: the diagonals (n_u, n_v, n_w) of the operators over their sum.

    An interface between two materials then belongs to the stiffer patch. On a plate of 8 patches, whose conductivities
    are 1 and 10 000 by turns, that takes 18 iterations, with equal shares 107.
    """
    own = unknowns.layout.joined([np.abs(diagonal)[None] for diagonal in diagonals])
    total = unknowns.spread(unknowns.collect(own)).flat
    return replace(own, flat=np.divide(own.flat, total, out=np.zeros_like(total), where=total > 0.0))


def _hats(spaces: Sequence[TrialSpace]) -> tuple[Array, Array, Array]:
    """Return the coefficients (g, n, 2) of 1 - t and t in each direction of spaces of one shape."""
    rows = [np.stack([greville(space.knots[a], space.degrees[a]) for space in spaces]) for a in range(3)]
    u, v, w = (np.stack([1.0 - row, row], axis=-1) for row in rows)
    return u, v, w


def galerkin(operators: Sequence[Operator]) -> Array:
    """Return the matrices (patches, 8, 8) of operators on the trilinear functions of their patches.

    The terms of faces are lumped: a quarter of their factor belongs to each vertex of the face.
    """
    ends = np.array([0.0, 0.0, 1.0, 1.0])
    unit = TrialSpace((1, 1, 1), (ends, ends, ends), ())
    found = products([replace(one, space=unit, faces={}) for one in operators], np.eye(8).reshape(8, 2, 2, 2))
    for matrix, operator in zip(found, operators, strict=True):
        for name, face in operator.faces.items():
            on_face = face_layer(np.arange(8).reshape(2, 2, 2), name).ravel()
            matrix[on_face, on_face] += 0.25 * face.stiffness(operator.component)
    return found
