"""Solves with the matrix of trilinear elements on a grid of a body, approximately: a V-cycle on coarser grids.

Matrices of coarser grids are Galerkin's, smoothers Chebyshev polynomials of the matrix with inverted diagonal blocks
(Adams, Brezina, Hu, Tuminaro, J. Comput. Phys. 188, 2003). On the coarsest grid a factor solves.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import bsr_array, csr_array

from parameterize.arrays import Array

from ..discretization.unknowns import Glued
from .direct import factorized
from .grids import Grid

SMALL = 3500  # nodes of the coarsest grid, where there are inner nodes to leave out
STEPS = 2  # of a smoother
RANGE = 6.0  # of the eigenvalues that a smoother lowers, from the largest one down
POWERS = 10  # of the matrix that find its largest eigenvalue
MARGIN = 1.1  # on the largest eigenvalue
OPEN = 1e-8  # share of the diagonal that is added to the coarsest matrix of a body that nothing holds


@dataclass(frozen=True, eq=False)
class GridLevel:
    """Smooth on one grid. Vectors have the shape (m, c), for c components.

    unknowns: those of this process. matrix: (k c, k c) in blocks of c, the part of the patches here. inverses: (m, c,
    c), those of its diagonal blocks. largest: a bound on the eigenvalues of the matrix with inverted diagonal blocks.
    coarser: (m, coarser m), the interpolation.
    """

    unknowns: Glued
    matrix: bsr_array
    inverses: Array
    largest: float
    coarser: csr_array

    @classmethod
    def of(cls, unknowns: Glued, matrix: bsr_array, coarser: csr_array) -> "GridLevel":
        """Return the level of a matrix; coarser: the interpolation to all unknowns of the body."""
        diagonal = _diagonal(matrix)
        own = unknowns.without_copies(diagonal.reshape(len(diagonal), -1))
        inverses = _inverted(own.reshape(len(own), *diagonal.shape[1:]))
        found = cls(unknowns, matrix, inverses, 1.0, coarser[unknowns.own_rows])
        x = np.random.default_rng(0).standard_normal((coarser.shape[0], inverses.shape[1]))[unknowns.own_rows]
        largest = 1.0
        for _ in range(POWERS):
            x = _blocks(inverses, found.product(x / largest))
            largest = math.sqrt(unknowns.processes.total(float(np.square(x).sum())))
        return replace(found, largest=MARGIN * largest)

    def product(self, x: Array) -> Array:
        """Return the matrix times x."""
        copied = self.unknowns.with_copies(x)
        return self.unknowns.without_copies(np.asarray(self.matrix @ copied.ravel()).reshape(copied.shape))

    def restricted(self, residual: Array) -> Array:
        """Return the residual on the next coarser grid, which all processes have whole."""
        return np.asarray(self.unknowns.processes.total(self.coarser.T @ residual))

    def smooth(self, x: Array | None, residual: Array, is_last: bool = False) -> tuple[Array, Array]:
        """Return x after some steps, zero at first where it is None, and its residual, an earlier one if `is_last`."""
        middle, half = self.largest * (1.0 + 1.0 / RANGE) / 2.0, self.largest * (1.0 - 1.0 / RANGE) / 2.0
        rho = half / middle
        step = self.relaxed(residual) / middle
        for number in range(STEPS):
            x = step if x is None else x + step
            if is_last and number == STEPS - 1:
                break
            residual = residual - self.product(step)
            if number < STEPS - 1:
                following = 1.0 / (2.0 * middle / half - rho)
                step = following * rho * step + 2.0 * following / half * self.relaxed(residual)
                rho = following
        assert x is not None
        return x, residual

    def relaxed(self, residual: Array) -> Array:
        """Return the inverted diagonal blocks times a residual."""
        return _blocks(self.inverses, residual)


@dataclass(frozen=True, eq=False)
class Multigrid:
    """Apply a V-cycle to vectors (c, m); the same matrix, symmetric and positive, whatever the vector.

    coarsest: solves on the last grid.
    """

    levels: Sequence[GridLevel]
    coarsest: Callable[[Array], Array]

    @classmethod
    def of(cls, grid: Grid, unknowns: Glued, matrix: bsr_array, is_open: bool) -> "Multigrid | None":
        """Return the multigrid of a matrix on a grid; None where the coarsest matrix has no factor.

        unknowns: those of this process, to whose patches the matrix belongs. All processes have the coarser grids
        whole, also one that is no coarser where the first has few nodes. is_open: whether motions of the body may cost
        no energy.
        """
        levels: list[GridLevel] = []
        is_shared = unknowns.of_body is not unknowns
        while grid.count > SMALL or (is_shared and not levels):
            coarser = grid.coarser() if grid.count > SMALL else None
            if coarser is None and (levels or not is_shared):
                break
            coarser = coarser or grid
            interpolation = grid.interpolation(coarser)
            levels.append(GridLevel.of(unknowns, matrix, interpolation))
            wide = _in_blocks(interpolation[unknowns.rows], matrix.blocksize[0])
            coarse = unknowns.processes.total(wide.T @ matrix @ wide)
            matrix, grid, unknowns = bsr_array(coarse, blocksize=matrix.blocksize), coarser, coarser.unknowns
        solve = _factor(grid, matrix, is_open)
        return None if solve is None else cls(levels, solve)

    def __call__(self, residual: Array) -> Array:
        """Return the approximate solution (c, m)."""
        part, kept = _turned(residual), []
        for level in self.levels:
            kept.append(level.smooth(None, part))
            part = level.restricted(kept[-1][1])
        x = self.coarsest(part)
        for level, (own, rest) in zip(reversed(self.levels), reversed(kept), strict=True):
            step = level.coarser @ x
            x, _ = level.smooth(own + step, rest - level.product(step), is_last=True)
        return _turned(x)


def _factor(grid: Grid, matrix: bsr_array, is_open: bool) -> Callable[[Array], Array] | None:
    """Return the function that solves with the matrix of the coarsest grid for vectors (m, c)."""
    if not grid.count:
        return np.zeros_like
    c = matrix.blocksize[0]
    turned = np.arange(c * grid.count).reshape(-1, c).T.ravel()
    solve = factorized(matrix.tocsr()[turned][:, turned].tocsc(), grid.points, OPEN if is_open else 0.0)
    return solve and (lambda x: solve(x.T.ravel()[:, None]).reshape(c, -1).T.copy())


def _in_blocks(matrix: csr_array, c: int) -> bsr_array:
    """Return a matrix (m, n) that acts on c components alike, in blocks (c, c) as other matrices have them."""
    m, n = matrix.shape
    return bsr_array((matrix.data[:, None, None] * np.eye(c), matrix.indices, matrix.indptr), shape=(c * m, c * n))


def _turned(x: Array) -> Array:
    """Return the transpose (m, c) of an array or a tensor (c, m), in C order."""
    return x.T.reshape(-1).reshape(x.T.shape)


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
