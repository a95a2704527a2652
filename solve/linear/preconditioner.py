"""Preconditions by fast diagonalization: the exact inverse of a Laplacian with separable coefficients.

Sangalli, Tani, SIAM J. Sci. Comput. 38 (2016), for constant coefficients; docs/solver.md explains how real maps, a
reaction and Robin's conditions are included.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES
from parameterize.threads import in_parallel

from ..discretization.operator import Operator
from ..discretization.space import TrialSpace
from .shear import IncompleteCholesky, helps, incomplete_cholesky

NO_FACTOR = "an incomplete Cholesky factor of the matrix was not found, the preconditioner works without it"
NO_FACTORS = "the coefficients are too extreme for the preconditioner, the diagonal of the matrix takes its place"
DIAGONAL = (0, 3, 5)  # the places of uu, vv, ww among the six factors
COLUMNS, LAYERS = 4096, 8  # in a piece of work


@dataclass(frozen=True, eq=False)
class FastDiagonalization:
    """Apply D (U (x) U (x) U) L^-1 (U (x) U (x) U)^T D to residuals of the free coefficients.

    vectors: per direction (n, n), generalized eigenvectors in columns. inverse, scaling: the diagonals L^-1, of the
    eigenvectors, and D, (n_u, n_v, n_w).
    singular: whether constants are in the operator's kernel (no Dirichlet face, no reaction, no Robin face); the
    preconditioner then stays in their orthogonal complement. local: the part that is added for a sheared map (`shear`).
    weakness: the part that had to be left out, as a sentence for the report; "" for none. For a slab, `inverse` has the
    columns that `space.to_columns` gives, and all other arrays have the slab's own rows.
    """

    space: TrialSpace
    vectors: tuple[Array, Array, Array]
    inverse: Array
    scaling: Array
    singular: bool = False
    threads: int = 1
    local: IncompleteCholesky | None = None
    weakness: str = ""

    def __call__(self, residual: Array) -> Array:
        """Return the preconditioned residual, both (n_u, n_v, n_w) or (1, n_u, n_v, n_w)."""
        u, v, w = self.vectors
        shape, residual = residual.shape, residual.reshape(self.scaling.shape)
        if self.singular:
            residual = residual - self._mean(residual)
        spectral = self._to_columns(u.T, v.T, w.T, residual, self.scaling, self.inverse)
        result = self._to_rows(u, v, w, spectral, self.scaling)
        if self.local is not None:
            u, v, w = self.local.inverses
            nodes = self.space.to_rows(self._to_columns(u.T, v.T, w.T, residual))
            result += self._to_rows(u, v, w, self.space.to_columns(self.local(nodes)))
        if self.singular:
            result -= self._mean(result)
        return result.reshape(shape)

    def _mean(self, x: Array) -> Any:
        """Return the mean over the free coefficients of all processes."""
        return self.space.total(x.sum()) / len(self.vectors[0]) / math.prod(x.shape[1:])

    def _to_columns(
        self, u: Array, v: Array, w: Array, x: Array, before: Array | None = None, after: Array | None = None
    ) -> Array:
        """Return columns: three small matrices applied along the three axes of own rows x.

        before, after: diagonals that are applied first, in rows, and last, in columns.
        """
        return self._along_u(u, self.space.to_columns(self._across(v, w, x, before=before)), after)

    def _to_rows(self, u: Array, v: Array, w: Array, x: Array, after: Array | None = None) -> Array:
        """Return own rows: three small matrices applied along the three axes of columns x, and then a diagonal."""
        return self._across(v, w, self.space.to_rows(self._along_u(u, x)), after=after)

    def _along_u(self, u: Array, x: Array, after: Array | None = None) -> Array:
        """Return x after a matrix along the first axis, and then a diagonal."""
        result = np.empty((len(u), *x.shape[1:]), dtype=x.dtype)
        columns, rows = x.reshape(len(x), -1), result.reshape(len(u), -1)
        factors = None if after is None else after.reshape(len(u), -1)

        def multiply(start: int) -> None:
            piece = slice(start, start + COLUMNS)
            np.matmul(u, columns[:, piece], out=rows[:, piece])
            if factors is not None:
                rows[:, piece] *= factors[:, piece]

        in_parallel(multiply, range(0, rows.shape[1], COLUMNS), self.threads)
        return result

    def _across(self, v: Array, w: Array, x: Array, before: Array | None = None, after: Array | None = None) -> Array:
        """Return x after a diagonal, two matrices along the second and third axis, and another diagonal."""
        result = np.empty((len(x), len(v), len(w)), dtype=x.dtype)

        def multiply(start: int) -> None:
            for i in range(start, min(start + LAYERS, len(x))):
                layer = x[i] if before is None else before[i] * x[i]
                np.matmul(v @ layer, w.T, out=result[i])
                if after is not None:
                    result[i] *= after[i]

        in_parallel(multiply, range(0, len(x), LAYERS), self.threads)
        return result


def fast_diagonalization(operator: Operator, diagonal: Array | None = None) -> FastDiagonalization:
    """Return the preconditioner of an operator restricted to its free coefficients.

    diagonal: `operator.diagonal()` where it is known. Where the local part does not give finite numbers it is left out;
    where no part does, the inverse of the diagonal is returned. All processes that share the space call this function.
    """
    with np.errstate(all="ignore"):  # it is looked at afterwards
        own = operator.diagonal() if diagonal is None else diagonal.copy()
        operator.space.add(own)
        found = _without_local(operator, own[operator.space.window])
        if not _is_usable(found):
            return _of_the_diagonal(operator, own[operator.space.window], found.singular)
        if found.singular or not helps(operator):
            return found
        whole = replace(found, local=incomplete_cholesky(operator))
        return whole if whole.local is not None and _is_usable(whole) else replace(found, weakness=NO_FACTOR)


@dataclass(frozen=True, eq=False)
class Componentwise:
    """Apply the preconditioners of the components of a law on one patch, (c, n_u, n_v, n_w)."""

    blocks: tuple[FastDiagonalization, ...]

    def __call__(self, residual: Array) -> Array:
        """Return the preconditioned residual."""
        return np.stack([block(part) for block, part in zip(self.blocks, residual, strict=True)])

    @property
    def weakness(self) -> str:
        """Return the first part that a block had to leave out."""
        return next((block.weakness for block in self.blocks if block.weakness), "")


def leaves_constants(operator: Operator) -> bool:
    """Return whether constants are in an operator's kernel: no Dirichlet face, no reaction, no term on faces."""
    stiff = (face.stiffness(operator.component).any() for face in operator.faces.values())
    return not operator.space.dirichlet and not operator.factors[:, 6:].any() and not any(stiff)


def _is_usable(preconditioner: FastDiagonalization) -> bool:
    """Return whether the preconditioner gives finite numbers for a residual without a pattern."""
    residual = np.random.default_rng(0).uniform(-1.0, 1.0, preconditioner.scaling.shape)
    return all(preconditioner.space.shared(bool(np.isfinite(preconditioner(residual)).all())))


def _without_local(operator: Operator, diagonal: Array) -> FastDiagonalization:
    """Return fast diagonalization without a local part; its numbers are not finite for extreme coefficients.

    diagonal: that of the operator, on the own free coefficients.
    """
    space = operator.space
    here = {name: face.stiffness(operator.component).sum() for name, face in operator.faces.items()}
    stiff = {name: float(space.total(here.get(name, 0.0))) for name in FACE_NAMES}
    slopes, masses, averages = _directional_matrices(operator, stiff)
    mean_mass = float(space.total(sum(plane[6:].sum() for plane in operator.factors)))  # of c |det J|, over the cube
    reaction = mean_mass / float(np.prod(averages))
    values, vectors = zip(*(_eigh(slope, mass) for slope, mass in zip(slopes, masses, strict=True)), strict=True)
    spectrum = values[0][:, None, None] + values[1][space.columns, None] + values[2] + reaction
    scaling = _scaling(_diagonal(space, slopes, masses, reaction), diagonal)
    singular = not space.dirichlet and reaction == 0.0 and not any(stiff.values())
    if singular:
        spectrum[0, : int(space.columns.start == 0), 0] = np.inf
    u, v, w = vectors
    return FastDiagonalization(space, (u, v, w), 1.0 / spectrum, scaling, singular, operator.threads)


def _eigh(slope: Array, mass: Array) -> tuple[Array, Array]:
    """Return generalized eigenvalues and eigenvectors; NaN where double precision does not suffice."""
    try:
        values, vectors = eigh(slope, mass)
    except (np.linalg.LinAlgError, ValueError):  # a mass that is not positive, or numbers that are not finite
        return np.full(len(slope), np.nan), np.full_like(slope, np.nan)
    return values, vectors


def _of_the_diagonal(operator: Operator, diagonal: Array, singular: bool) -> FastDiagonalization:
    """Return the inverse of the operator's diagonal as a FastDiagonalization, whose eigenvectors are unit vectors."""
    space = operator.space
    u, v, w = (np.eye(free.stop - free.start) for free in space.free)
    spectrum = np.ones((len(u), space.columns.stop - space.columns.start, len(w)))
    scaling = _scaling(1.0, diagonal)
    return FastDiagonalization(space, (u, v, w), spectrum, scaling, singular, operator.threads, weakness=NO_FACTORS)


def _directional_matrices(
    operator: Operator, stiff: Mapping[str, float]
) -> tuple[list[Array], list[Array], list[float]]:
    """Return per direction the stiffness matrix K_d and the mass matrix M_d on the free coefficients, and M_d's mean.

    The mean is that of the weight b_d over the direction's parameter. stiff: by face, the average over its parameters
    of the factor of u v, from Robin's or Nitsche's terms, times the surface element.
    """
    along, across = _separable_coefficients(operator)
    averages = [float(w @ b) for w, b in zip(operator.rule.weights, across, strict=True)]
    averages[0] = operator.space.total(averages[0])
    slopes, masses = [], []
    for axis, free in enumerate(operator.space.free):
        mass = _gram(operator, axis, operator.rule.weights[axis] * across[axis], 0)
        slope = _gram(operator, axis, operator.rule.weights[axis] * along[axis], 1)
        for end, name in zip((0, -1), FACE_NAMES[2 * axis : 2 * axis + 2], strict=True):
            # one function only is nonzero at the end, with value 1
            slope[end, end] += stiff[name] * averages[axis] / float(np.prod(averages))
        slopes.append(slope[free, free])
        masses.append(mass[free, free])
    return slopes, masses, averages


def _diagonal(space: TrialSpace, slopes: list[Array], masses: list[Array], reaction: float) -> Array:
    """Return the diagonal of the preconditioner's separable matrix P on the own free coefficients."""
    place = space.place, slice(None), slice(None)
    stiff, mass = (
        [np.diag(matrix)[own] for matrix, own in zip(matrices, place, strict=True)] for matrices in (slopes, masses)
    )
    terms = [(stiff[0], mass[1], mass[2]), (mass[0], stiff[1], mass[2]), (mass[0], mass[1], stiff[2])]
    diagonal = sum(np.einsum("i,j,k->ijk", *term) for term in terms)
    return np.asarray(diagonal + reaction * np.einsum("i,j,k->ijk", *mass))


def _scaling(diagonal: Array | float, wanted: Array) -> Array:
    """Return the square root of a diagonal over a wanted one, zero where the law does not act and that one is zero.

    A folded map has diagonal entries below zero; their size is all a scaling can use.
    """
    return np.sqrt(np.abs(np.divide(diagonal, wanted, out=np.zeros(wanted.shape), where=wanted != 0.0)))


def _separable_coefficients(operator: Operator) -> tuple[list[Array], list[Array]]:
    """Return the weights a_d and b_d at the Gauss points of each direction: two lists of arrays (q_d,).

    G_dd is close to a_d of its own parameter times b_e and b_f of the two others, in the sense of least squares of
    logarithms. For logarithms the fit is additive, and its terms are averages of log G_dd over planes. One point a
    span, the middle one, represents the span.
    """
    starts = [np.unique(first, return_index=True)[1] for first, _, _ in operator.tables]  # of the spans
    counts = [np.diff(s, append=q) for s, q in zip(starts, operator.rule.shape, strict=True)]  # points per span
    lengths = [np.add.reduceat(w, s) for w, s in zip(operator.rule.weights, starts, strict=True)]
    u, v, w = (s + c // 2 for s, c in zip(starts, counts, strict=True))  # the middle points
    means = [np.zeros((3, len(s))) for s in starts]  # of log G_dd, d = u, v, w, over the other two directions
    for span, q in enumerate(u):
        weights = operator.rule.plane_weights(int(q))[np.ix_(w, v)]
        logarithm = np.log(np.maximum(np.abs(operator.factors[q][np.ix_(DIAGONAL, w, v)] / weights), 1e-300))
        over_w = lengths[2] @ logarithm
        means[0][:, span] = over_w @ lengths[1]
        means[1] += lengths[0][span] * over_w
        means[2] += lengths[0][span] * (logarithm @ lengths[1])
    total = operator.space.total
    means, overall = [means[0], total(means[1]), total(means[2])], total(means[0] @ lengths[0])
    along, across = [], []
    for axis, count in enumerate(counts):
        others = np.delete(means[axis] - overall[:, None], axis, axis=0).sum(axis=0)
        along.append(np.repeat(np.exp(means[axis][axis]), count))
        across.append(np.repeat(np.exp(0.5 * others), count))
    return along, across


def _gram(operator: Operator, axis: int, weights: Array, derivative: int) -> Array:
    """Return the matrix (n, n) of the integrals of products of one direction's functions, or of their derivatives."""
    basis = operator.dense(axis, derivative)
    matrix: Array = basis.T @ (weights[:, None] * basis)
    if axis > 0:
        return matrix
    space = operator.space
    whole = np.zeros((space.whole.shape[0],) * 2)
    whole[space.rows, space.rows] = matrix
    return np.asarray(space.total(whole))
