"""Finds fast diagonalizations of patches of one shape at once: `preconditioner` with a leading dimension of patches.

A function that boundary data fix is decoupled from the others: it has an eigenvector of its own, whose inverse is zero.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.volume import FACE_NAMES

from ..discretization.operator import Operator
from .preconditioner import DIAGONAL, FastDiagonalization, fast_diagonalization, scaling_of
from .shear import helps

PATCHES = 256  # that are taken at a time


@dataclass(frozen=True, eq=False)
class StackedDiagonalization:
    """Apply the fast diagonalizations of k patches that other patches hold (`FastDiagonalization.held`).

    vectors: per direction (k, n, n), eigenvectors in columns. inverse, scaling: (k, n_u, n_v, n_w), as in
    `FastDiagonalization`, zero for fixed functions. singular: (k,), whether nothing on a patch fixes constants.
    """

    vectors: tuple[Array, Array, Array]
    inverse: Array
    scaling: Array
    singular: Mask

    def __call__(self, residuals: Array) -> Array:
        """Return the preconditioned residuals (k, n_u, n_v, n_w)."""
        u, v, w = self.vectors
        spectral = self.inverse * along_axes(u.mT, v.mT, w.mT, self.scaling * residuals)
        return self.scaling * along_axes(u, v, w, spectral)

    @property
    def is_usable(self) -> Mask:
        """Return for each patch whether the numbers are finite."""
        parts = (*self.vectors, self.inverse, self.scaling)
        return np.logical_and.reduce([np.isfinite(part).reshape(len(part), -1).all(axis=1) for part in parts])

    def of(self, chosen: Any) -> StackedDiagonalization:
        """Return the diagonalizations of some patches."""
        u, v, w = (part[chosen] for part in self.vectors)
        return StackedDiagonalization((u, v, w), self.inverse[chosen], self.scaling[chosen], self.singular[chosen])


def along_axes(u: Array, v: Array, w: Array, x: Array) -> Array:
    """Return x (k, n_u, n_v, n_w) after matrices (k, m, n) along each axis."""
    k, _, n_v, n_w = x.shape
    rows = np.matmul(u, x.reshape(k, -1, n_v * n_w)).reshape(k, -1, n_v, n_w)
    columns = np.matmul(v[:, None], rows).reshape(k, -1, n_w)
    return np.matmul(columns, w.mT).reshape(k, u.shape[1], v.shape[1], w.shape[1])


def diagonalizations(
    operators: Sequence[Operator], diagonals: Sequence[Array]
) -> tuple[list[tuple[IntArray, StackedDiagonalization]], dict[int, FastDiagonalization | None]]:
    """Return the preconditioners of patches: held ones in stacks, with the numbers of the patches, and single ones.

    diagonals: of the operators, (n_u, n_v, n_w) each. A single patch is one without a second of its shape and knots,
    one that is glued to itself, and one that needs another part beside fast diagonalization; it has None where it has
    no unknowns.
    """
    kinds = defaultdict(list)
    for number, operator in enumerate(operators):
        space = operator.space
        knots = (row.tobytes() for row in space.knots)
        kinds[space.degrees, *knots, id(operator.rule), operator.factors.shape, len(space.periodic)].append(number)
    stacks, alone = [], []
    for numbers in kinds.values():
        for start in range(0, len(numbers), PATCHES):
            chosen = np.array(numbers[start : start + PATCHES])
            own = [operators[i] for i in chosen]
            is_single = len(numbers) == 1 or own[0].space.periodic
            found = None if is_single else _stack(own, [diagonals[i] for i in chosen])
            if found is None:
                alone += chosen.tolist()
                continue
            good = found.is_usable & ~np.array([helps(operator) for operator in own])
            stacks.append((chosen[good], found.of(good)))
            alone += chosen[~good].tolist()
    return stacks, {number: _alone(operators[number]) for number in alone}


def _alone(operator: Operator) -> FastDiagonalization | None:
    """Return the preconditioner of one patch; None for a patch without unknowns."""
    has_unknowns = all(part.stop > part.start for part in operator.space.free)
    return fast_diagonalization(operator) if has_unknowns else None


def _stack(operators: Sequence[Operator], diagonals: Sequence[Array]) -> StackedDiagonalization | None:
    """Return the preconditioners of operators with equal knots and rules; None where rounding is too large for one."""
    first, factors = operators[0], np.stack([operator.factors for operator in operators])
    along, across = _separable_coefficients(first, factors)
    weights = first.rule.weights
    averages = np.stack([part @ w for part, w in zip(across, weights, strict=True)])  # (3, k)
    volume = averages.prod(axis=0)
    reaction = factors[:, :, 6:].sum(axis=(1, 2, 3, 4)) / volume
    stiff = np.array([_stiffness(operator) for operator in operators])  # (k, 6)
    fixed = [_fixed(operators, axis) for axis in range(3)]
    slopes, masses, values, vectors = [], [], [], []
    for axis in range(3):
        mass = _grams(first, axis, weights[axis] * across[axis], 0)
        slope = _grams(first, axis, weights[axis] * along[axis], 1)
        for end, side in ((0, 2 * axis), (-1, 2 * axis + 1)):
            slope[:, end, end] += stiff[:, side] * averages[axis] / volume
        slopes.append(np.diagonal(slope, axis1=1, axis2=2) * ~fixed[axis])
        masses.append(np.diagonal(mass, axis1=1, axis2=2) * ~fixed[axis])
        try:
            found = _eigen(slope, mass, fixed[axis])
        except np.linalg.LinAlgError:  # a mass that is not positive, or numbers that are not finite
            return None
        values.append(found[0])
        vectors.append(found[1])
    free = [part >= 0.0 for part in values]
    spectrum = _sum(*values) + reaction[:, None, None, None]
    is_free = free[0][:, :, None, None] & free[1][:, None, :, None] & free[2][:, None, None, :]
    singular = np.array([not one.space.dirichlet for one in operators]) & (reaction == 0.0) & ~stiff.any(axis=1)
    with np.errstate(all="ignore"):  # the numbers are looked at afterwards
        spectrum[singular, 0, 0, 0] = np.inf
        inverse = np.where(is_free, 1.0 / spectrum, 0.0)
        inverse[singular, 0, 0, 0] = inverse[singular].max(axis=(1, 2, 3))
        mean = _diagonal(slopes, masses) + reaction[:, None, None, None] * _product(*masses)
        scaling = scaling_of(mean, np.stack(diagonals))
    return StackedDiagonalization((vectors[0], vectors[1], vectors[2]), inverse, scaling, singular)


def _stiffness(operator: Operator) -> list[float]:
    """Return the stiffness of the terms on each face of a patch, zero where there are none."""
    faces = operator.faces
    return [faces[name].stiffness(operator.component) if name in faces else 0.0 for name in FACE_NAMES]


def _fixed(operators: Sequence[Operator], axis: int) -> Mask:
    """Return the mask (k, n) of the functions of a direction that boundary data fix."""
    fixed = np.zeros((len(operators), operators[0].space.shape[axis]), dtype=bool)
    for own, operator in zip(fixed, operators, strict=True):
        low, high = FACE_NAMES[2 * axis : 2 * axis + 2]
        own[0], own[-1] = low in operator.space.dirichlet, high in operator.space.dirichlet
    return fixed


def _eigen(slope: Array, mass: Array, fixed: Mask) -> tuple[Array, Array]:
    """Return generalized eigenvalues (k, n) and eigenvectors (k, n, n), negative values for fixed functions."""
    diagonals = [np.diagonal(part, axis1=1, axis2=2) for part in (slope, mass)]
    below = -(1.0 + np.abs(diagonals[0] / diagonals[1]).max(axis=1, keepdims=True))
    coupled = ~fixed[:, :, None] & ~fixed[:, None, :]
    unit = np.eye(slope.shape[1]) * fixed[:, None, :]
    lower = np.linalg.cholesky(np.where(coupled, mass, unit))
    half = np.linalg.solve(lower, np.where(coupled, slope, unit * below[:, :, None]))
    values, vectors = np.linalg.eigh(np.linalg.solve(lower, half.mT))
    vectors = np.linalg.solve(lower.mT, vectors)
    return np.where(values < 0.5 * below, -np.inf, np.maximum(values, 0.0)), vectors


def _separable_coefficients(first: Operator, factors: Array) -> tuple[list[Array], list[Array]]:
    """Return the weights a_d and b_d (k, q_d) of each direction, as `preconditioner` defines them."""
    starts = [np.unique(own, return_index=True)[1] for own, _, _ in first.tables]  # of the spans
    counts = [np.diff(s, append=q) for s, q in zip(starts, first.rule.shape, strict=True)]  # points per span
    lengths = [np.add.reduceat(w, s) for w, s in zip(first.rule.weights, starts, strict=True)]
    u, v, w = (s + c // 2 for s, c in zip(starts, counts, strict=True))  # the middle points
    w_u, w_v, w_w = first.rule.weights
    sizes = np.abs(factors[:, u[:, None, None, None], np.array(DIAGONAL)[:, None, None], w[:, None], v])
    weights = w_u[u][:, None, None, None] * w_w[w][:, None] * w_v[v]
    logarithms = np.log(np.maximum(sizes / weights, 1e-300))  # (k, s_u, 3, s_w, s_v)
    means = [
        np.einsum("kudwv,w,v->kdu", logarithms, lengths[2], lengths[1]),
        np.einsum("kudwv,u,w->kdv", logarithms, lengths[0], lengths[2]),
        np.einsum("kudwv,u,v->kdw", logarithms, lengths[0], lengths[1]),
    ]
    overall = means[0] @ lengths[0]
    along, across = [], []
    for axis, count in enumerate(counts):
        others = np.delete(means[axis] - overall[:, :, None], axis, axis=1).sum(axis=1)
        along.append(np.repeat(np.exp(means[axis][:, axis]), count, axis=1))
        across.append(np.repeat(np.exp(0.5 * others), count, axis=1))
    return along, across


def _grams(first: Operator, axis: int, weights: Array, derivative: int) -> Array:
    """Return the matrices (k, n, n) of integrals of products of one direction's functions, for weights (k, q)."""
    basis = first.dense(axis, derivative)
    return np.matmul(basis.T * weights[:, None, :], basis)


def _sum(u: Array, v: Array, w: Array) -> Array:
    """Return u + v + w (k, n_u, n_v, n_w) of rows (k, n)."""
    return np.asarray(u[:, :, None, None] + v[:, None, :, None] + w[:, None, None, :])


def _product(u: Array, v: Array, w: Array) -> Array:
    """Return u v w (k, n_u, n_v, n_w) of rows (k, n)."""
    return np.asarray(u[:, :, None, None] * v[:, None, :, None] * w[:, None, None, :])


def _diagonal(slopes: Sequence[Array], masses: Sequence[Array]) -> Array:
    """Return the diagonals (k, n_u, n_v, n_w) of the separable stiffness."""
    (su, sv, sw), (mu, mv, mw) = slopes, masses
    return _product(su, mv, mw) + _product(mu, sv, mw) + _product(mu, mv, sw)
