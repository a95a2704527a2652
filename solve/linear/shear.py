"""The local part of the preconditioner, for maps whose parameter lines meet at small angles.

Fast diagonalization knows G's diagonal alone. Where the map shears cubes flat, what it leaves are errors that oscillate
across the shear, many and local. Trilinear elements on the Greville points see the whole of G, and their values
correspond to spline coefficients by collocation, uniformly in the mesh width: an incomplete Cholesky factorization of
their stiffness matrix without fill (Meijerink, van der Vorst, Math. Comp. 31 (1977)) reduces these errors.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import collocation, greville

from ..discretization.kernels import compiled
from ..discretization.operator import Operator
from ..forms.jets import PAIRS

OFFSETS = np.array(list(product((-1, 0, 1), repeat=3)))[:14]  # to the 13 neighbours that come before a node, to itself
SAMPLES, FLAT, SHARE = 16, 0.1, 0.02
HIGHEST = 3  # degree: of degree 4 the iterations saved just pay for the factors, of degree 5 they become more


@dataclass(frozen=True, eq=False)
class IncompleteCholesky:
    """Solves L L^T x = r on the nodes of a grid.

    factor: (nodes, 14), L at the nodes of OFFSETS, the inverse of its diagonal last. steps: (14,), what OFFSETS add to
    the number of a node. inverses: per direction (n, n), from values at the free nodes to coefficients.
    """

    factor: Array
    steps: IntArray
    inverses: tuple[Array, Array, Array]

    def __call__(self, values: Array) -> Array:
        """Return x for values r, arrays of any shape with as many entries as nodes."""
        reach = -self.steps[0]
        padded = np.pad(values.ravel(), reach)
        _substitute(self.factor, self.steps, padded)
        return padded[reach:-reach].reshape(values.shape)


def helps(operator: Operator) -> bool:
    """Whether degrees are low and the map is flat in enough places.

    There G, scaled to ones on its diagonal, has a small determinant.
    """
    if max(operator.space.degrees) > HIGHEST:
        return False
    u, v, w = (np.unique(np.linspace(0, q - 1, SAMPLES).astype(int)) for q in operator.rule.shape)
    uu, uv, uw, vv, vw, ww = np.moveaxis(operator.factors[np.ix_(u, np.arange(6), w, v)], 1, 0)
    determinant = uu * (vv * ww - vw**2) - uv * (uv * ww - vw * uw) + uw * (uv * vw - vv * uw)
    return bool(np.mean(determinant < FLAT * uu * vv * ww) > SHARE)


def incomplete_cholesky(operator: Operator) -> IncompleteCholesky:
    """Return the factorization that belongs to an operator's free coefficients."""
    spaces = list(zip(operator.space.knots, operator.space.degrees, operator.window, strict=True))
    matrices = [collocation(k, p, greville(k, p)).toarray()[free, free] for k, p, free in spaces]
    u, v, w = (np.linalg.inv(matrix) for matrix in matrices)
    factor = _stencils(operator)
    strides = np.array([factor.shape[1] * factor.shape[2], factor.shape[2], 1])
    factor = factor.reshape(-1, len(OFFSETS))
    sums = OFFSETS[:-1, None] + OFFSETS[:-1]  # from a node over one neighbour to the other's neighbour
    places = np.where(np.abs(sums).max(axis=-1) > 1, -1, (sums + 1) @ (9, 3, 1))
    _factorize(factor, OFFSETS @ strides, places)
    return IncompleteCholesky(factor, OFFSETS @ strides, (u, v, w))


def _stencils(operator: Operator) -> Array:
    """Return the lower half of the elements' stiffness matrix on the free nodes, (n_u, n_v, n_w, 14).

    G of a cell is that of the quadrature point nearest to its middle.
    """
    nodes = [greville(k, p) for k, p in zip(operator.space.knots, operator.space.degrees, strict=True)]
    widths = [np.diff(x) for x in nodes]
    middles = [x[:-1] + 0.5 * h for x, h in zip(nodes, widths, strict=True)]
    rule = zip(operator.rule.points, middles, strict=True)
    picks = u, v, w = [np.abs(points - middle[:, None]).argmin(axis=1) for points, middle in rule]
    cells = operator.factors[np.ix_(u, np.arange(6), w, v)].transpose(1, 0, 3, 2)  # (6, cells of u, of v, of w)
    scales = [h / weights[pick] for h, weights, pick in zip(widths, operator.rule.weights, picks, strict=True)]
    lengths = np.meshgrid(*widths, indexing="ij")
    cells = cells * np.einsum("i,j,k->ijk", *scales) / np.stack([lengths[a] * lengths[b] for a, b in PAIRS])
    corners = np.array(list(product((0, 1), repeat=3)))
    reference = _reference()
    lower = np.zeros((len(OFFSETS), *operator.space.shape))
    for (i, corner), (j, other) in product(enumerate(corners), repeat=2):
        place = int((other - corner + 1) @ (9, 3, 1))
        if place < len(OFFSETS):
            there = tuple(slice(c, c + len(h)) for c, h in zip(corner, widths, strict=True))
            lower[place][there] += np.tensordot(reference[:, i, j], cells, 1)
    lower = lower[:, *operator.window]
    for entries, offset in zip(lower, OFFSETS, strict=True):
        for axis, step in enumerate(offset):
            if step:  # no neighbour beyond the last free node
                np.moveaxis(entries, axis, 0)[0 if step < 0 else -1] = 0.0
    return np.ascontiguousarray(np.moveaxis(lower, 0, -1))


def _reference() -> Array:
    """Return the element matrices (6, 8, 8) on the unit cube that belong to the six entries of G."""
    mass, jump = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0, np.array([[1.0, -1.0], [-1.0, 1.0]])
    mixed = np.array([[-0.5, -0.5], [0.5, 0.5]])  # row: the function that is differentiated
    matrices = []
    for a, b in PAIRS:
        rows = [mass, mass, mass]
        rows[a], rows[b] = (jump, jump) if a == b else (mixed, mixed.T)
        matrix = np.kron(np.kron(rows[0], rows[1]), rows[2])
        matrices.append(matrix if a == b else matrix + matrix.T)
    return np.stack(matrices)


@compiled
def _factorize(lower: Array, steps: IntArray, places: IntArray) -> None:
    """Overwrite a lower half by its incomplete factor; a pivot that almost vanishes stays as it was."""
    for i in range(len(lower)):
        row = lower[i]
        rest = row[13]
        for a in range(13):
            if row[a] != 0.0:
                other, entry = lower[i + steps[a]], row[a]
                for b in range(13):
                    if places[a, b] >= 0:
                        entry -= row[places[a, b]] * other[b]
                row[a] = entry * other[13]
                rest -= row[a] ** 2
        row[13] = 1.0 / np.sqrt(rest if rest > 1e-3 * row[13] else abs(row[13]))


@compiled
def _substitute(lower: Array, steps: IntArray, x: Array) -> None:
    """Overwrite r by x; zeros before and after them stand for the neighbours that nodes at the ends do not have.

    With one free node across, some of OFFSETS lead to a later node, past the last one too.
    """
    reach = -steps[0]
    for i in range(len(lower)):
        total = x[reach + i]
        for a in range(13):
            total -= lower[i, a] * x[reach + i + steps[a]]
        x[reach + i] = total * lower[i, 13]
    for i in range(len(lower) - 1, -1, -1):
        value = x[reach + i] * lower[i, 13]
        x[reach + i] = value
        for a in range(13):
            x[reach + i + steps[a]] -= lower[i, a] * value
