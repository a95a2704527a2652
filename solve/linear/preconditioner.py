"""Fast diagonalization: the exact inverse of a Laplacian with separable coefficients, as preconditioner.

Sangalli, Tani, SIAM J. Sci. Comput. 38 (2016), for constant coefficients. Two additions make it cheaper on real maps:
every direction carries weights for its stiffness and its mass matrix, so that G_dd is met by a product of functions
of one parameter (after Loli, Sangalli, Tani, CAMWA 2022, who fit by alternating least squares; logarithms turn the fit
into averages), and a diagonal scaling makes the diagonal agree with the operator's. A reaction and Robin's conditions
enter by their averages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES

from ..discretization.operator import Operator
from ..discretization.quadrature import Table
from ..threads import in_parallel

DIAGONAL = (0, 3, 5)  # the places of uu, vv, ww among the six factors


@dataclass(frozen=True, eq=False)
class FastDiagonalization:
    """Applies D (U (x) U (x) U) L^-1 (U (x) U (x) U)^T D to residuals of the free coefficients.

    vectors: per direction (n, n), generalized eigenvectors in columns. inverse, scaling: (n_u, n_v, n_w), the diagonals
    L^-1 and D. singular: constants are in the operator's kernel (no Dirichlet face, no reaction, no Robin face), and
    the preconditioner keeps to their orthogonal complement.
    """

    vectors: tuple[Array, Array, Array]
    inverse: Array
    scaling: Array
    singular: bool = False
    threads: int = 1

    def __call__(self, residual: Array) -> Array:
        """Return the preconditioned residual, both (n_u, n_v, n_w) or (1, n_u, n_v, n_w)."""
        u, v, w = self.vectors
        shape, residual = residual.shape, residual.reshape(self.inverse.shape)
        if self.singular:
            residual = residual - residual.mean()
        spectral = self._transform(u.T, v.T, w.T, self.scaling * residual)
        spectral *= self.inverse
        result = self._transform(u, v, w, spectral)
        result *= self.scaling
        if self.singular:
            result -= result.mean()
        return result.reshape(shape)

    def _transform(self, u: Array, v: Array, w: Array, x: Array) -> Array:
        """Apply three small matrices along the three axes of x, which is overwritten."""
        columns, rows = x.reshape(x.shape[0], -1), np.empty((x.shape[0], x[0].size))
        along_u = rows.reshape(x.shape)

        def first(piece: slice) -> None:
            np.matmul(u, columns[:, piece], out=rows[:, piece])

        def second(piece: slice) -> None:
            for i in range(*piece.indices(len(x))):
                np.matmul(v @ along_u[i], w.T, out=x[i])

        in_parallel(first, _pieces(rows.shape[1], 4096), self.threads)
        in_parallel(second, _pieces(len(x), 8), self.threads)
        return x


def _pieces(length: int, size: int) -> list[slice]:
    return [slice(start, start + size) for start in range(0, length, size)]


def fast_diagonalization(
    operator: Operator, robin: Mapping[str, float] | None = None, extra_diagonal: Array | None = None
) -> FastDiagonalization:
    """Build the preconditioner of an operator restricted to its free coefficients.

    robin: of the faces with Robin's condition, the average over the face's parameters of alpha times the surface
    element. extra_diagonal: (n_u, n_v, n_w), the diagonal of what is added to the operator elsewhere (Robin's terms).
    """
    robin = robin or {}
    slopes, masses, averages = _directional_matrices(operator, robin)
    reaction = operator.mean_mass() / float(np.prod(averages))
    values, vectors = zip(*(eigh(slope, mass) for slope, mass in zip(slopes, masses, strict=True)), strict=True)
    spectrum = _sum_outer(values) + reaction
    scaling = _scaling(operator, slopes, masses, reaction, extra_diagonal)
    whole = all(free == slice(0, n) for free, n in zip(operator.window, operator.space.shape, strict=True))
    singular = whole and reaction == 0.0 and not any(robin.values())
    if singular:
        spectrum[0, 0, 0] = np.inf
    u, v, w = vectors
    return FastDiagonalization((u, v, w), 1.0 / spectrum, scaling, singular, operator.threads)


def _directional_matrices(
    operator: Operator, robin: Mapping[str, float]
) -> tuple[list[Array], list[Array], list[float]]:
    """Return per direction the stiffness matrix K_d and the mass matrix M_d on the free coefficients, and M_d's mean.

    The mean is that of the weight b_d over the direction's parameter.
    """
    along, across = _separable_coefficients(operator)
    averages = [float(w @ b) for w, b in zip(operator.rule.weights, across, strict=True)]
    slopes, masses = [], []
    for axis, (table, n, free) in enumerate(zip(operator.tables, operator.space.shape, operator.window, strict=True)):
        mass = _gram(table, operator.rule.weights[axis] * across[axis], n, 0)
        slope = _gram(table, operator.rule.weights[axis] * along[axis], n, 1)
        for end, name in zip((0, -1), FACE_NAMES[2 * axis : 2 * axis + 2], strict=True):
            # one function only is nonzero at the end, with value 1
            slope[end, end] += robin.get(name, 0.0) * averages[axis] / float(np.prod(averages))
        slopes.append(slope[free, free])
        masses.append(mass[free, free])
    return slopes, masses, averages


def _scaling(
    operator: Operator, slopes: list[Array], masses: list[Array], reaction: float, extra_diagonal: Array | None
) -> Array:
    """Return D, the square root of the diagonal of P over that of the operator, on the free coefficients."""
    stiff, mass = ([np.diag(matrix) for matrix in matrices] for matrices in (slopes, masses))
    terms = [(stiff[0], mass[1], mass[2]), (mass[0], stiff[1], mass[2]), (mass[0], mass[1], stiff[2])]
    diagonal = sum(np.einsum("i,j,k->ijk", *term) for term in terms)
    diagonal += reaction * np.einsum("i,j,k->ijk", *mass)
    wanted = operator.diagonal() + (0.0 if extra_diagonal is None else extra_diagonal)
    # A folded map has diagonal entries below zero; their size is all a scaling can use.
    scaling: Array = np.sqrt(np.abs(diagonal / wanted[operator.window]))
    return scaling


def _separable_coefficients(operator: Operator) -> tuple[list[Array], list[Array]]:
    """Return the weights a_d and b_d at the Gauss points of each direction: two lists of (q_d,).

    G_dd is close to a_d of its own parameter times b_e and b_f of the two others, in the sense of least squares of
    logarithms. There the fit is additive, and its terms are averages of log G_dd over planes. One point a span, the
    middle one, stands for the span.
    """
    starts = [np.unique(table.first, return_index=True)[1] for table in operator.tables]  # of the spans
    counts = [np.diff(s, append=q) for s, q in zip(starts, operator.rule.shape, strict=True)]  # points per span
    lengths = [np.add.reduceat(w, s) for w, s in zip(operator.rule.weights, starts, strict=True)]
    u, v, w = (s + c // 2 for s, c in zip(starts, counts, strict=True))  # the middle points
    means = [[np.zeros(len(s)) for s in starts] for _ in range(3)]  # means[d][axis]: of log G_dd over the other axes
    block, lane = np.divmod(v, operator.factors.shape[4])
    for span, q in enumerate(u):
        weights = operator.rule.plane_weights(int(q))[np.ix_(w, v)]
        factors = operator.factors[q][block, w[:, None], :, lane]  # (spans of w, spans of v, 6 or 7)
        for mean, index in zip(means, DIAGONAL, strict=True):
            logarithm = np.log(np.maximum(np.abs(factors[:, :, index] / weights), 1e-300))
            mean[0][span] = lengths[2] @ logarithm @ lengths[1]
            mean[1] += lengths[0][span] * (lengths[2] @ logarithm)
            mean[2] += lengths[0][span] * (logarithm @ lengths[1])
    overall = [float(lengths[0] @ mean[0]) for mean in means]
    along, across = [], []
    for axis, count in enumerate(counts):
        others = sum(means[d][axis] - overall[d] for d in range(3) if d != axis)
        along.append(np.repeat(np.exp(means[axis][axis]), count))
        across.append(np.repeat(np.exp(0.5 * others), count))
    return along, across


def _gram(table: Table, weights: Array, n: int, derivative: int) -> Array:
    """Return the matrix (n, n) of the integrals of products of one direction's functions, or of their derivatives."""
    dense = np.zeros((len(weights), n))
    columns = table.first[:, None] + np.arange(table.values.shape[2])
    np.put_along_axis(dense, columns, table.values[derivative], axis=1)
    matrix: Array = dense.T @ (weights[:, None] * dense)
    return matrix


def _sum_outer(rows: Sequence[Array]) -> Array:
    total: Array = rows[0][:, None, None] + rows[1][:, None] + rows[2]
    return total
