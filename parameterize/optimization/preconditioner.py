"""Approximates the inverse of the energy's second derivative, for the directions of Newton's method.

At the identity, and with the surface's data spread over all faces in all directions, the second derivative is a sum of
Kronecker products, whose inverse is fast. The true one is far from it at the boundary, which the data hold along the
normals alone, and wherever the penalties act. So the 3 x 3 blocks A on the diagonal of the true one are made those of
the approximation: with the Cholesky factors A = a L L^T, where a is the entry of the Kronecker products K on the same
place, it is L K L^T. It takes a sixth of the iterations that K alone takes.

Several blocks keep to K alone: each block has its own inverse, and scaled inverses disagree at interfaces. With them a
hand of several blocks folded in 499 spans as it approached its surface, and in none without.
"""

import numba
import numpy as np

from ..arrays import Array, Floats
from ..spline.spline_map import ControlNets
from .bending import Fairness
from .tensor_product import KroneckerInverse

_PULL = 1e-2  # share of the surface's weight in K: enough to bound its longest waves
_PULL_OF_K = 3e-4  # the same of K alone: more would hold back slides along the surface
_LEAST = 1e-6  # of a pivot, relative to its entry on the diagonal: in single precision a block may be singular


class Preconditioner:
    """Hold the inverse of K for each block, and the factors L of a second derivative.

    The results of several blocks are averaged at interfaces.
    """

    def __init__(self, nets: ControlNets, fairness: Fairness, surface: float, *, scaled: bool) -> None:
        """Make the inverse with the weight `surface` of the surface's data; L is the identity at first.

        scaled: whether `scale` will be called.
        """
        self._nets, self._inverses, entries = nets, list[KroneckerInverse](), []
        pull = _PULL if scaled else _PULL_OF_K
        for term in fairness.terms:
            rough = term.with_stiffness()
            for matrix in rough:
                matrix[[0, -1], [0, -1]] += pull * surface / 6.0
            self._inverses.append(KroneckerInverse(rough, term.mass, dtype=np.float32))
            entries.append(_diagonal(rough, term.mass).ravel())
        self._entries = np.concatenate(entries)
        self._factors: Floats | None = None

    def scale(self, blocks: Floats) -> None:
        """Set the blocks (6, n) on the diagonal of the second derivative, as operators.py explains them."""
        self._factors = _cholesky(self._nets.merged(blocks) / self._entries).astype(np.float32)

    def __call__(self, residual: Floats) -> Floats:
        """Return the inverse applied to a residual (3, n)."""
        nets, factors = self._nets, self._factors
        scaled = residual if factors is None else _forward(factors, residual)
        found = nets.joined([part(nets.of_block(scaled, block)) for block, part in enumerate(self._inverses)])
        return nets.merged(found if factors is None else _backward(factors, found))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _forward(factors: Floats, right: Floats) -> Floats:
    """Return the solution of L x = right, (3, n), with factors L as `_cholesky` returns them."""
    found = np.empty_like(right)
    a, b, c, d, e, f = factors
    for i in range(right.shape[1]):
        x = right[0, i] * a[i]
        y = (right[1, i] - b[i] * x) * c[i]
        found[0, i], found[1, i], found[2, i] = x, y, (right[2, i] - d[i] * x - e[i] * y) * f[i]
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _backward(factors: Floats, right: Floats) -> Floats:
    """Return the solution of L^T x = right, (3, n), with factors L as `_cholesky` returns them."""
    found = np.empty_like(right)
    a, b, c, d, e, f = factors
    for i in range(right.shape[1]):
        z = right[2, i] * f[i]
        y = (right[1, i] - e[i] * z) * c[i]
        found[0, i], found[1, i], found[2, i] = (right[0, i] - b[i] * y - d[i] * z) * a[i], y, z
    return found


def _diagonal(matrices: tuple[Array, ...], mass: tuple[Array, ...]) -> Array:
    """Return the diagonal (n_u, n_v, n_w) of the operator that `KroneckerInverse` inverts."""
    (a_u, a_v, a_w), (m_u, m_v, m_w) = (map(np.diag, three) for three in (matrices, mass))
    outer = "i,j,k->ijk"
    own = np.einsum(outer, a_u, m_v, m_w) + np.einsum(outer, m_u, a_v, m_w) + np.einsum(outer, m_u, m_v, a_w)
    return np.asarray(own)


def _cholesky(blocks: Array) -> Array:
    """Return the Cholesky factors (6, n) of blocks (6, n), with the inverses of the entries on their diagonals."""
    xx, yx, yy, zx, zy, zz = blocks
    a = 1.0 / np.sqrt(xx)
    b, d = yx * a, zx * a
    c = 1.0 / np.sqrt(np.maximum(yy - b * b, _LEAST * yy))
    e = (zy - b * d) * c
    f = 1.0 / np.sqrt(np.maximum(zz - d * d - e * e, _LEAST * zz))
    return np.stack([a, b, c, d, e, f])
