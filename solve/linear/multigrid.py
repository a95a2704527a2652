"""Solves with the matrix of trilinear elements on a grid of a body, approximately: a V-cycle on coarser grids.

Matrices of coarser grids are Galerkin's, smoothers Chebyshev polynomials of the matrix with inverted diagonal blocks
(Adams, Brezina, Hu, Tuminaro, J. Comput. Phys. 188, 2003). On the coarsest grid a factor solves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_array, csr_array, kron

from parameterize.arrays import Array

from .direct import factorized
from .grids import Grid

SMALL = 3500  # nodes of the coarsest grid, where there are inner nodes to leave out
STEPS = 2  # of a smoother
RANGE = 6.0  # of the eigenvalues that a smoother lowers, from the largest one down
POWERS = 10  # of the matrix that find its largest eigenvalue
MARGIN = 1.1  # on the largest eigenvalue
OPEN = 1e-8  # share of the diagonal that is added to the coarsest matrix of a body that nothing holds


@dataclass(frozen=True, eq=False)
class Level:
    """Smooth on one grid. Vectors have the shape (m, c), for c components.

    matrix: (m c, m c) in blocks of c. inverses: (m, c, c), those of its diagonal blocks. largest: a bound on the
    eigenvalues of the matrix with inverted diagonal blocks. coarser: (m, coarser m), the interpolation.
    """

    matrix: bsr_array
    inverses: Array
    largest: float
    coarser: csr_array

    @classmethod
    def of(cls, matrix: bsr_array, coarser: csr_array) -> "Level":
        """Return the level of a matrix."""
        inverses = _inverted(_diagonal(matrix))
        x = np.random.default_rng(0).standard_normal(inverses.shape[:2])
        largest = 1.0
        for _ in range(POWERS):
            x = _blocks(inverses, _product(matrix, x / largest))
            largest = float(np.linalg.norm(x))
        return cls(matrix, inverses, MARGIN * largest, coarser)

    def smooth(self, x: Array | None, residual: Array, is_last: bool = False) -> tuple[Array, Array]:
        """Return x after some steps, zero at first where it is None, and its residual, an earlier one if `is_last`."""
        middle, half = self.largest * (1.0 + 1.0 / RANGE) / 2.0, self.largest * (1.0 - 1.0 / RANGE) / 2.0
        rho = half / middle
        step = _blocks(self.inverses, residual) / middle
        for number in range(STEPS):
            x = step if x is None else x + step
            if is_last and number == STEPS - 1:
                break
            residual = residual - _product(self.matrix, step)
            if number < STEPS - 1:
                following = 1.0 / (2.0 * middle / half - rho)
                step = following * rho * step + 2.0 * following / half * _blocks(self.inverses, residual)
                rho = following
        assert x is not None
        return x, residual


@dataclass(frozen=True, eq=False)
class Multigrid:
    """Apply a V-cycle to vectors (c, m); the same matrix, symmetric and positive, whatever the vector.

    coarsest: solves on the last grid.
    """

    levels: Sequence[Level]
    coarsest: Callable[[Array], Array]

    @classmethod
    def of(cls, grid: Grid, matrix: bsr_array, is_open: bool) -> "Multigrid | None":
        """Return the multigrid of a matrix on a grid; None where the coarsest matrix has no factor.

        is_open: whether motions of the body may cost no energy.
        """
        levels = []
        while grid.count > SMALL and (coarser := grid.coarser()) is not None:
            levels.append(Level.of(matrix, grid.interpolation(coarser)))
            wide = kron(levels[-1].coarser, np.eye(matrix.blocksize[0]), format="bsr")
            matrix = bsr_array(wide.T @ matrix @ wide, blocksize=matrix.blocksize)
            grid = coarser
        solve = _factor(grid, matrix, is_open)
        return None if solve is None else cls(levels, solve)

    def __call__(self, residual: Array) -> Array:
        """Return the approximate solution (c, m)."""
        part, kept = np.ascontiguousarray(residual.T), []
        for level in self.levels:
            kept.append(level.smooth(None, part))
            part = level.coarser.T @ kept[-1][1]
        x = self.coarsest(part)
        for level, (own, rest) in zip(reversed(self.levels), reversed(kept), strict=True):
            step = level.coarser @ x
            x, _ = level.smooth(own + step, rest - _product(level.matrix, step), is_last=True)
        return np.ascontiguousarray(x.T)


def _factor(grid: Grid, matrix: bsr_array, is_open: bool) -> Callable[[Array], Array] | None:
    """Return the function that solves with the matrix of the coarsest grid for vectors (m, c)."""
    if not grid.count:
        return np.zeros_like
    c = matrix.blocksize[0]
    turned = np.arange(c * grid.count).reshape(-1, c).T.ravel()
    solve = factorized(matrix.tocsr()[turned][:, turned].tocsc(), grid.points, OPEN if is_open else 0.0)
    return solve and (lambda x: solve(x.T.ravel()[:, None]).reshape(c, -1).T.copy())


def _product(matrix: bsr_array, x: Array) -> Array:
    return np.asarray(matrix @ x.ravel()).reshape(x.shape)


def _blocks(inverses: Array, x: Array) -> Array:
    """Return diagonal blocks (m, c, c) times x (m, c)."""
    return inverses[:, 0] * x if x.shape[1] == 1 else np.einsum("mij,mj->mi", inverses, x)


def _diagonal(matrix: bsr_array) -> Array:
    """Return the diagonal blocks (m, c, c)."""
    rows = np.repeat(np.arange(len(matrix.indptr) - 1), np.diff(matrix.indptr))
    found = np.zeros((len(matrix.indptr) - 1, *matrix.blocksize))
    on_diagonal = matrix.indices == rows
    found[rows[on_diagonal]] = matrix.data[on_diagonal]
    return found


def _inverted(blocks: Array) -> Array:
    """Return the inverses of blocks (m, c, c); zero along directions on which the matrix does not act."""
    try:
        return np.asarray(np.linalg.inv(blocks))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(blocks, hermitian=True))
