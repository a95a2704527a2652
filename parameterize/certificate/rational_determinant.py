"""det J of rational patches F = A / W times W^4, in Bernstein form, with a bound of the rounding errors.

With the homogeneous components H = (A, W), W^4 det J is the determinant with the columns H_u, H_v, H_w and H, up to its
sign: subtracting F_W columns leaves W F_u, W F_v and W F_w in the first three rows, and W alone in the last. It is a
polynomial of degree 4 p - 1 a direction on a span, and has the sign of det J. Weights are scaled so that the largest is
1. Then W is at most 1, and a positive lower bound of the polynomial is one of det J, too.
"""

from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from ..arrays import Array, IntArray
from ..spline.bernstein import add_products
from ..spline.bspline import breakpoints
from ..spline.orientation import enclosed_volumes
from ..spline.patch_groups import PatchGroup
from .determinant import DeterminantForm, scaled_extraction, unscaling

_PAIRS = tuple(combinations(range(4), 2))


class RationalDeterminantForm(DeterminantForm):
    """W^4 det J of the patches of a rational group, in place of det J; 2**exponent is the factor of both.

    nets, bases: of H_u, H_v, H_w and H. largest: sums of the magnitudes whose differences the control points are.
    """

    def __init__(self, group: PatchGroup) -> None:
        self.degrees = group.degrees
        self.breaks = [breakpoints(k) for k in group.knots]
        self.n_spans = tuple(len(b) - 1 for b in self.breaks)
        self.span_count = int(np.prod(self.n_spans))
        self.patch_count = len(group)
        self.counts = tuple(4 * p for p in self.degrees)
        self.unscale = unscaling(self.counts)
        self.roundings = _roundings(group.degrees)
        local, powers = _at_unit_scale(group)
        net = np.moveaxis(local.coefficients, -1, 1)
        columns = [_differences(net, group, b) for b in range(3)]
        of_columns = [np.frexp(largest.max(axis=(1, 2, 3, 4)))[1].astype(np.int64) for _, largest in columns]
        shifts = [-exponents[:, None, None, None, None] for exponents in of_columns]
        self.nets = [*(np.ldexp(part, e) for (part, _), e in zip(columns, shifts, strict=True)), net]
        self.largest = [*(np.ldexp(part, e) for (_, part), e in zip(columns, shifts, strict=True)), np.abs(net)]
        self.exponents = 3 * powers + sum(of_columns)
        self.bases = [[scaled_extraction(group.knots[a], group.degrees[a], a == b) for a in range(3)] for b in range(4)]
        self.means = np.ldexp(enclosed_volumes(local, np.zeros(3)), -sum(of_columns))

    def survey(self) -> tuple[Array, Array, Array]:
        """Return as for polynomial patches, of W^4 det J; the mean of det J over the cube stands for that of spans."""
        bounds, corners, means = super().survey()
        return bounds, corners, np.broadcast_to(self.means[:, None], means.shape)

    def coefficients(self, spans: IntArray) -> tuple[Array, Array]:
        """Return Bernstein coefficients on spans (k, 4), (d_u, d_v, d_w, k), and permanents (k,) that bound them."""
        f_u, f_v, f_w, h = (self._derivative(b, spans)[0] for b in range(4))
        sizes = np.stack([self._near(self.largest[b], b, spans).max(axis=(1, 2, 3)) for b in range(4)])  # (4, 4, k)
        determinant = np.zeros((*self.counts, len(spans)))
        for pair, rest in zip(_PAIRS, reversed(_PAIRS), strict=True):
            sign = 1.0 if sum(pair) % 2 == 0 else -1.0  # of Laplace's expansion, with the sign of W^4 det J
            add_products(_minor(h, f_u, *pair), _minor(f_v, f_w, *rest), sign, determinant)
        terms = [np.prod([sizes[b, row] for b, row in enumerate(rows)], axis=0) for rows in permutations(range(4))]
        return determinant * self.unscale, np.sum(terms, axis=0)


def _at_unit_scale(group: PatchGroup) -> tuple[PatchGroup, IntArray]:
    """Return patches about the origin, their coordinates below 1, their largest weight 1, and the exponents (k,) of 2.

    The given patches are 2**exponent as large.
    """
    points, weights = group.control_points, np.asarray(group.weights)
    middles = (points.min(axis=(1, 2, 3)) + points.max(axis=(1, 2, 3))) / 2.0
    moved = points - middles[:, None, None, None]
    powers = np.frexp(np.abs(moved).max(axis=(1, 2, 3, 4)))[1].astype(np.int64)
    near = np.ldexp(moved, -powers[:, None, None, None, None])
    return replace(group, control_points=near, weights=weights / weights.max(axis=(1, 2, 3), keepdims=True)), powers


def _differences(net: Array, group: PatchGroup, axis: int) -> tuple[Array, Array]:
    """Return control points (k, 4, ...) of the derivative of H (k, 4, ...) along an axis, and bounds of their terms."""
    knots, degree, n = group.knots[axis], group.degrees[axis], net.shape[axis + 2]
    with np.errstate(over="ignore"):
        factor = degree / (knots[degree + 1 : degree + n] - knots[1:n])
    if not np.all(np.isfinite(factor)):
        raise ValueError("the derivatives of the volume overflow; widen its knot spans")
    factor = factor.reshape([-1 if a == axis + 2 else 1 for a in range(5)])
    ahead, behind = (np.take(net, range(first, first + n - 1), axis=axis + 2) for first in (1, 0))
    return factor * (ahead - behind), factor * (np.abs(ahead) + np.abs(behind))


def _minor(one: Array, other: Array, i: int, j: int) -> Array:
    """Return one_i other_j - one_j other_i of two columns (4, ..., k) in scaled Bernstein form."""
    shape = [a + b - 1 for a, b in zip(one.shape[1:4], other.shape[1:4], strict=True)]
    found = np.zeros((*shape, one.shape[4]))
    add_products(one[i], other[j], 1.0, found)
    add_products(one[j], other[i], -1.0, found)
    return found


def _roundings(degrees: tuple[int, int, int]) -> int:
    """Return how many rounding errors a Bernstein coefficient of W^4 det J passes through, at most.

    As in `determinant.py`, with these differences:
    - a coefficient of H: 3 roundings, of the weight, of the move to the origin, and of their product;
    - one of a derivative: 4 more. As differences of rounded numbers they are bounded by the sums of the magnitudes;
    - a minor of H and H_u: a sum of at most 2 p_u (p_v + 1) (p_w + 1) products; of H_v and H_w, 2 (p_u + 1) p_v p_w;
    - the six products of two minors: sums of at most 8 p_u p_v p_w products each.
    No number exceeds 1 but by its binomials. For degrees up to 100 underflow loses less than 1e20 h, far below 1e-280.
    """
    u, v, w = degrees
    net = 7 + sum(6 * p + 2 for p in degrees)
    minors = (2 * u * (v + 1) * (w + 1) + 1) + (2 * (u + 1) * v * w + 1)
    return 4 * net + minors + (48 * u * v * w + 1) + 6
