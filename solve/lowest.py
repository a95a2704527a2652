"""Finds the lowest eigenvalues of K x = lambda M x beside motions that are known to take no energy.

LOBPCG (Knyazev, SIAM J. Sci. Comput. 23 (2001)) on the vectors that are M-orthogonal to these motions. The least values
of x.K x / x.M x in a subspace are found as the largest ones of x.M x / x.K x, in a basis of unit energies: of a foil,
1 : 20 000, the largest eigenvalue is 1e18 times the lowest one, which is below the rounding of the matrix, but not of
energies.
"""

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, eigh, solve_triangular

from parameterize.arrays import Array

from .linear.inverse import NOT_POSITIVE, RoughInverse

Product = Callable[[Array], Array]  # of columns (N, m) -> (N, m)

SPARE = 4  # vectors more than are wanted, and half as many as these again: the last ones converge slowly
DEPENDENT = 1e-9  # least eigenvalue of the energies of unit vectors, below which some are counted as dependent
NEGATIVE = -1e-3  # the same, below which the matrix is not positive
SURE = 1e-8  # share of the largest mass of a unit energy: smaller ones are found anew, beside vectors of larger ones
PATIENCE = 20  # iterations in which the residual must fall by half
TOLD = 10.0  # seconds between two lines on the iterations

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Lowest:
    """Hold n eigenvalues (n,), vectors (N, n) of unit mass, their residuals (n,), and the number of iterations.

    worst: the largest residual, infinite where fewer than n vectors were found. rounding: (n,), the share of each
    eigenvalue that rounding changes. leak: the largest x.K x / x.M x of the motions, which should be zero.
    """

    values: Array
    vectors: Array
    residuals: Array
    iterations: int
    worst: float
    rounding: Array
    leak: float


@dataclass(frozen=True, eq=False)
class Vectors:
    """Hold columns x, K x and M x (N, m)."""

    x: Array
    stiff: Array
    heavy: Array

    @classmethod
    def empty(cls, size: int) -> "Vectors":
        """Return no columns."""
        return cls(*(np.empty((size, 0)),) * 3)

    @property
    def count(self) -> int:
        """Return m."""
        return self.x.shape[1]

    def times(self, weights: Array) -> "Vectors":
        """Return sums of the columns with weights (m, k)."""
        return Vectors(self.x @ weights, self.stiff @ weights, self.heavy @ weights)

    def beside(self, other: "Vectors") -> "Vectors":
        """Return the columns of both."""
        pairs = ((self.x, other.x), (self.stiff, other.stiff), (self.heavy, other.heavy))
        return Vectors(*(np.concatenate(pair, axis=1) for pair in pairs))


@dataclass(frozen=True, eq=False)
class Pencil:
    """Hold products with K, with M and with an approximate inverse of K, and the motions without energy.

    motions: (N, k), of unit mass.
    """

    stiffness: Product
    mass: Product
    inverse: RoughInverse
    motions: Array

    @cached_property
    def _heavy(self) -> Array:
        return self.mass(self.motions)

    def lowest(self, n: int, tolerance: float, most: int) -> Lowest:
        """Return the n lowest eigenvalues beside the motions.

        It ends before the tolerance after `most` iterations, or where the residuals do not fall any more.
        """
        (size, k), rng = self.motions.shape, np.random.default_rng(0)
        block = min(n + n // 2 + SPARE, size - k)
        x, steps, values, history = Vectors.empty(size), Vectors.empty(size), np.empty(0), [np.inf]
        clock = told = time.monotonic()
        while True:
            forces, fill = x.stiff - x.heavy * values, rng.standard_normal((size, block - len(values)))
            fill -= x.heavy @ (x.x.T @ fill)
            forces = self._forces(np.concatenate([forces, fill], axis=1))
            residuals = (np.linalg.norm(forces[:, : x.count], axis=0) / np.linalg.norm(x.stiff, axis=0))[:n]
            if len(residuals) == n and residuals.max() <= tolerance:  # no solve more
                return self._ended(values[:n], x.x[:, :n], residuals, len(history) - 1, float(residuals.max()))
            searched = self.inverse(forces)
            if self.inverse.is_exact:  # in the norm of K^-1 stiff directions, where rounding leaves most, count little
                works = (forces * searched)[:, : x.count].sum(axis=0)
                residuals = np.sqrt(np.abs(works) / values)[:n]
            history.append(float(residuals.max()) if len(residuals) == n else np.inf)
            made = len(history) - 2
            if history[-1] <= tolerance or made >= most or _stalls(history):
                return self._ended(values[:n], x.x[:, :n], residuals, made, history[-1])
            if time.monotonic() - told > TOLD:
                told = time.monotonic()
                log.info("modes: residual %.1e after %d iterations, %.0f seconds", history[-1], made, told - clock)
            new = self._block(searched).beside(steps)
            values, weights = ritz(x.beside(new), block)
            steps = new.times(weights[x.count :])
            x = self._block(x.x @ weights[: x.count] + steps.x)  # products anew: rounding does not add up

    def _ended(self, values: Array, x: Array, residuals: Array, made: int, worst: float) -> Lowest:
        """Return what was found, with what rounding changes: products with a third of x round differently."""
        change = (x * (3.0 * self.stiffness(x / 3.0) - self.stiffness(x))).sum(axis=0)
        energies = np.linalg.eigvalsh(self.motions.T @ self.stiffness(self.motions))
        return Lowest(values, x, residuals, made, worst, np.abs(change) / values, float(energies.max(initial=0.0)))

    def _block(self, columns: Array) -> Vectors:
        """Return columns (N, m) without their part along the motions."""
        moved = columns - self.motions @ (self._heavy.T @ columns)
        moved -= self.motions @ (self._heavy.T @ moved)
        return Vectors(moved, self.stiffness(moved), self.mass(moved))

    def _forces(self, columns: Array) -> Array:
        """Return forces (N, m) without those that would move the body as a whole."""
        return columns - self._heavy @ (self.motions.T @ columns)


def ritz(block: Vectors, count: int) -> tuple[Array, Array]:
    """Return the lowest values of x.K x / x.M x among sums of columns, and the weights (m, .) of unit masses.

    There are `count` of them, or fewer where the columns are dependent. Raises ValueError where an energy is negative.
    """
    energies = np.einsum("ij,ij->j", block.x, block.stiff)
    energies[~block.x.any(axis=0)] = np.inf  # a solve that gave nothing
    if not energies.min() > 0.0:
        raise ValueError(NOT_POSITIVE)
    scale = 1.0 / np.sqrt(energies)
    parts, turned = eigh(_symmetric(scale[:, None] * (block.x.T @ block.stiff) * scale))
    if parts[0] < NEGATIVE:
        raise ValueError(NOT_POSITIVE)
    kept = parts > DEPENDENT
    basis = scale[:, None] * turned[:, kept] / np.sqrt(parts[kept])
    values, weights = np.empty(0), np.empty((len(scale), 0))
    while basis.shape[1] and len(values) < count:
        part = block.times(basis)
        masses, turned = eigh(_symmetric(part.x.T @ part.heavy))
        sure = masses > max(SURE * masses[-1], 0.0)
        values = np.append(values, 1.0 / masses[sure][::-1])
        weights = np.append(weights, (basis @ turned[:, sure] / np.sqrt(masses[sure]))[:, ::-1], axis=1)
        basis = basis @ turned[:, ~sure] if sure.any() else basis[:, :0]
    return values[:count], weights[:, :count]


def _symmetric(matrix: Array) -> Array:
    """Return the symmetric part of a matrix."""
    return 0.5 * (matrix + matrix.T)


def by_columns(product: Callable[[Array], Array]) -> Product:
    """Return the product with columns (N, m), there may be none, from that with a vector (N,)."""

    def apply(columns: Array) -> Array:
        found = np.empty_like(columns)
        for i, column in enumerate(columns.T):
            found[:, i] = product(column)
        return found

    return apply


def of_unit_mass(motions: Array, mass: Product) -> Array:
    """Return a basis (N, k) of independent motions, orthonormal in the mass."""
    scaled = motions / np.sqrt((motions * mass(motions)).sum(axis=0))
    lower = cholesky(scaled.T @ mass(scaled), lower=True)
    return np.asarray(solve_triangular(lower, scaled.T, lower=True).T)


def _stalls(residuals: Sequence[float]) -> bool:
    """Return whether residuals have not fallen by half for a while."""
    before, last = residuals[:-PATIENCE], residuals[-PATIENCE:]
    return bool(before) and not min(last) < 0.5 * min(before)
