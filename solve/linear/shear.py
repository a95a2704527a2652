"""Computes the local part of the preconditioner, for maps whose parameter lines meet at small angles.

Fast diagonalization uses the diagonal of G only. Where the map shears cubes flat, the errors that it leaves oscillate
across the shear, and are many and local. Trilinear elements on the Greville points use the whole of G, and their values
correspond to spline coefficients by collocation, uniformly in the mesh width: an incomplete Cholesky factorization of
their stiffness matrix without fill (Meijerink, van der Vorst, Math. Comp. 31 (1977)) reduces these errors.

Without fill a pivot may vanish, or fall below zero, although the matrix is positive definite. The diagonal then grows
by a share, the least of SHIFTS for which all pivots are positive (Manteuffel, Math. Comp. 34 (1980)).
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import collocation, greville

from ..discretization.kernels import compiled
from ..discretization.operator import Operator
from ..discretization.space import TrialSpace
from ..forms.jets import PAIRS

OFFSETS = np.array(list(product((-1, 0, 1), repeat=3)))[:14]  # to the 13 neighbours that come before a node, to itself
SAMPLES, FLAT, SHARE = 16, 0.1, 0.02
PIVOT = 0.01  # least share of the diagonal that a pivot has
SHIFTS = (0.0, *(0.01 * 2.0**k for k in range(8)))  # shares by which the diagonal grows, tried in turn
HIGHEST = 3  # degree: of degree 4 the iterations saved just pay for the factors, of degree 5 they become more


@dataclass(frozen=True, eq=False)
class IncompleteCholesky:
    """Solve L L^T x = r on the nodes of a grid.

    factor: (nodes, 14), L at the nodes of OFFSETS, and the inverse of its diagonal last. steps: (14,), the differences
    of node numbers for OFFSETS. inverses: per direction (n, n), from values at the free nodes to coefficients. For a
    slab the nodes are those of its own rows; processes work one after another, and pass on a row.
    """

    space: TrialSpace
    factor: Array
    steps: IntArray
    inverses: tuple[Array, Array, Array]

    def __call__(self, values: Array) -> Array:
        """Return x for values r; both are arrays of any shape with one entry a node."""
        reach, row = -self.steps[0], -self.steps[4]
        padded = np.pad(values.ravel(), reach)
        before, last = padded[reach - row : reach], padded[-reach - row : -reach]
        self.space.receive(before)
        _forward(self.factor, self.steps, padded)
        self.space.send(last, after=True)
        before[:] = 0.0
        found = np.empty(row)
        if self.space.receive(found, after=True):
            last += found
        _backward(self.factor, self.steps, padded)
        self.space.send(before)
        return padded[reach:-reach].reshape(values.shape)


def helps(operator: Operator) -> bool:
    """Return whether the degrees are low and the map is flat in enough places.

    At such places G, scaled to ones on its diagonal, has a small determinant.
    """
    if max(operator.space.degrees) > HIGHEST:
        return False
    space, (q_u, *across) = operator.space, operator.rule.shape
    start, count = _place(space, q_u)
    u, v, w = (np.unique(np.linspace(0, q - 1, SAMPLES).astype(int)) for q in (count, *across))
    u = u[(u >= start) & (u < start + q_u)] - start
    uu, uv, uw, vv, vw, ww = np.moveaxis(operator.factors[np.ix_(u, np.arange(6), w, v)], 1, 0)
    determinant = uu * (vv * ww - vw**2) - uv * (uv * ww - vw * uw) + uw * (uv * vw - vv * uw)
    flat = space.total(np.count_nonzero(determinant < FLAT * uu * vv * ww))
    return bool(flat > SHARE * space.total(determinant.size))


def _place(space: TrialSpace, count: int) -> tuple[int, int]:
    """Return the first number of this process where all processes count together, and the total count."""
    counts = space.shared(count)
    return sum(counts[: space.rank]), sum(counts)


def incomplete_cholesky(operator: Operator) -> IncompleteCholesky | None:
    """Return the factorization for an operator's free coefficients; None where it fails for every shift."""
    space = operator.space
    for shift in SHIFTS:
        found = _factor(operator, shift)
        if found is None:
            continue
        spaces = zip(space.whole.knots, space.degrees, space.free, strict=True)
        u, v, w = (np.linalg.inv(collocation(k, p, greville(k, p)).toarray()[free, free]) for k, p, free in spaces)
        return IncompleteCholesky(space, *found, (u, v, w))
    return None


def _factor(operator: Operator, shift: float) -> tuple[Array, IntArray] | None:
    """Return `factor` and `steps` of an IncompleteCholesky; None where a pivot of any process is too small.

    Processes work one after another. Processes after one that has failed work too, and all results are dropped.
    """
    space, factor = operator.space, _stencils(operator)
    strides = np.array([factor.shape[1] * factor.shape[2], factor.shape[2], 1])
    row, factor = strides[0], factor.reshape(-1, len(OFFSETS))
    before = np.empty((row, len(OFFSETS)))
    start = row if space.receive(before) else 0
    factor = np.concatenate([before, factor]) if start else factor
    succeeded = _factorize(factor, start, OFFSETS @ strides, _places(), shift)
    space.send(factor[-row:], after=True)
    return (factor[start:], OFFSETS @ strides) if all(space.shared(succeeded)) else None


def _places() -> IntArray:
    """Return the numbers (13, 13) of the OFFSETS that lead to the neighbour of a neighbour; -1 where no offset does."""
    sums = OFFSETS[:-1, None] + OFFSETS[:-1]
    return np.where(np.abs(sums).max(axis=-1) > 1, -1, (sums + 1) @ (9, 3, 1))


def _stencils(operator: Operator) -> Array:
    """Return the lower half of the elements' stiffness matrix on the free nodes, (n_u, n_v, n_w, 14).

    G of a cell is that of the quadrature point nearest to its midpoint. Terms on faces are lumped.
    """
    space, widths, picks = operator.space, *_nearest_points(operator)
    start, _ = _place(space, operator.rule.shape[0])
    here = np.flatnonzero((picks[0] >= start) & (picks[0] < start + operator.rule.shape[0]))
    widths[0], picks[0] = widths[0][here], picks[0][here] - start
    origin = (here[0] - space.rows.start if here.size else 0), 0, 0
    u, v, w = picks
    cells = operator.factors[np.ix_(u, np.arange(6), w, v)].transpose(1, 0, 3, 2)  # (6, cells of u, of v, of w)
    scales = [h / weights[pick] for h, weights, pick in zip(widths, operator.rule.weights, picks, strict=True)]
    lengths = np.meshgrid(*widths, indexing="ij")
    cells = cells * np.einsum("i,j,k->ijk", *scales) / np.stack([lengths[a] * lengths[b] for a, b in PAIRS])
    corners = np.array(list(product((0, 1), repeat=3)))
    reference = _reference()
    lower = np.zeros((len(OFFSETS), *space.shape))
    for (i, corner), (j, other) in product(enumerate(corners), repeat=2):
        place = int((other - corner + 1) @ (9, 3, 1))
        if place < len(OFFSETS):
            there = tuple(slice(c, c + len(h)) for c, h in zip(corner + origin, widths, strict=True))
            lower[place][there] += np.tensordot(reference[:, i, j], cells, 1)
    for face in operator.faces.values():
        face.add_lumped(operator.component, lower[-1:])
    space.add(lower)
    lower = lower[:, *space.window]
    for entries, offset in zip(lower, OFFSETS, strict=True):
        for axis, step in enumerate(offset):
            if step and (axis > 0 or space.place.start == 0):  # no neighbour beyond the last free node
                np.moveaxis(entries, axis, 0)[slice(1) if step < 0 else slice(-1, None)] = 0.0
    return np.ascontiguousarray(np.moveaxis(lower, 0, -1))


def _nearest_points(operator: Operator) -> tuple[list[Array], list[IntArray]]:
    """Return the widths of the cells of each direction, and the quadrature points nearest to their midpoints.

    Only points where the functions of both ends are not zero are used; in u, points are numbered over all processes.
    """
    space, widths, picks = operator.space, [], []
    for axis, (knots, degree) in enumerate(zip(space.whole.knots, space.degrees, strict=True)):
        points, first = operator.rule.points[axis], operator.tables[axis][0]
        if axis == 0:
            points, first = (np.concatenate(space.shared(part)) for part in (points, first + space.rows.start))
        nodes = greville(knots, degree)
        width, cell = np.diff(nodes), np.arange(len(nodes) - 1)[:, None]
        distance = np.abs(points - nodes[:-1, None] - 0.5 * width[:, None])
        picks.append(np.where((first <= cell) & (cell < first + degree), distance, np.inf).argmin(axis=1))
        widths.append(width)
    return widths, picks


def _reference() -> Array:
    """Return the element matrices (6, 8, 8) on the unit cube for the six entries of G."""
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
def _factorize(lower: Array, start: int, steps: IntArray, places: IntArray, shift: float) -> bool:
    """Overwrite a lower half, with its diagonal increased by a share, by its incomplete factor, from node `start` on.

    Returns False at the first pivot that is less than PIVOT of its diagonal entry, and leaves the rest unchanged.
    """
    for i in range(start, len(lower)):
        row = lower[i]
        rest = (1.0 + shift) * row[13]
        for a in range(13):
            if row[a] != 0.0:
                other, entry = lower[i + steps[a]], row[a]
                for b in range(13):
                    if places[a, b] >= 0:
                        entry -= row[places[a, b]] * other[b]
                row[a] = entry * other[13]
                rest -= row[a] ** 2
        if not rest > PIVOT * row[13]:  # NaN included
            return False
        row[13] = 1.0 / np.sqrt(rest)
    return True


@compiled
def _forward(lower: Array, steps: IntArray, x: Array) -> None:
    """Overwrite r by y, L y = r; zeros before and after r replace the neighbours that nodes at the ends do not have.

    With one free node across, some of OFFSETS lead to a later node, or past the last node.
    """
    reach = -steps[0]
    for i in range(len(lower)):
        total = x[reach + i]
        for a in range(13):
            total -= lower[i, a] * x[reach + i + steps[a]]
        x[reach + i] = total * lower[i, 13]


@compiled
def _backward(lower: Array, steps: IntArray, x: Array) -> None:
    """Overwrite y by x, L^T x = y; entries before the first node receive the parts of neighbours that do not exist."""
    reach = -steps[0]
    for i in range(len(lower) - 1, -1, -1):
        value = x[reach + i] * lower[i, 13]
        x[reach + i] = value
        for a in range(13):
            x[reach + i + steps[a]] -= lower[i, a] * value
