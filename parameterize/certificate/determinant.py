"""det J of trivariate splines in Bernstein form on any of their spans, with a bound of the rounding errors.

The control points of the three derivatives are brought to Bernstein form, and their triple product is formed with the
product rule for Bernstein polynomials: of degree 3 p - 1 a direction. No interpolation, so that errors stay small.
"""

import numpy as np

from ..arrays import Array, IntArray
from ..spline.bernstein import along_second_axis, binomials, cross_products, dot_products, extraction, windows
from ..spline.bspline import breakpoints
from ..spline.patch_groups import PatchGroup
from ..threads import in_parallel

CHUNK = 64  # spans at a time: their data fit into the cache

_UNIT_ROUNDOFF = 2.0**-53
_UNDERFLOW = 1e-280  # more than a coefficient can lose to underflow (_roundings)
_NO_EXPONENT = -10_000  # stands for an entry of J that is zero everywhere: below all other exponents


class DeterminantForm:
    """det J of the patches of a group, ready to be written in Bernstein form on any of their spans.

    The rows and the columns of J are scaled by powers of two to magnitude 1: true det J = 2**exponent * computed, with
    an exponent for each patch.
    """

    def __init__(self, group: PatchGroup) -> None:
        self.degrees = group.degrees
        self.breaks = [breakpoints(k) for k in group.knots]
        self.n_spans: tuple[int, ...] = tuple(len(b) - 1 for b in self.breaks)
        self.span_count = int(np.prod(self.n_spans))
        self.patch_count = len(group)
        self.roundings = _roundings(group.degrees)
        points = np.moveaxis(group.control_points, -1, 1)
        derivatives = [_differences(points, group.knots[b], group.degrees[b], b) for b in range(3)]
        self.nets, self.exponents = _to_unit_magnitude(derivatives)  # for each derivative: (patches, 3, N_0, N_1, N_2)
        self.bases = [  # for each derivative and direction: first, weights
            [scaled_extraction(group.knots[a], group.degrees[a], a == b) for a in range(3)] for b in range(3)
        ]
        self.counts: tuple[int, ...] = tuple(3 * p for p in self.degrees)
        self.unscale = unscaling(self.counts)

    def numbers(self, flat: IntArray) -> IntArray:
        """Return flat numbers (k,) of the spans of all patches, patch after patch, as rows (patch, i, j, l): (k, 4)."""
        return np.stack(np.unravel_index(flat, (self.patch_count, *self.n_spans)), axis=-1).astype(np.int64)

    def span_sizes(self) -> Array:
        """Return the parametric volume of every span of a patch, (spans,)."""
        return np.asarray(np.einsum("i,j,k->ijk", *(np.diff(b) for b in self.breaks)).ravel())

    def survey(self) -> tuple[Array, Array, Array]:
        """Return what `survey_of` does for all spans of all patches.

        The shapes are (2, patches, spans), (2, patches, spans) and (patches, spans).
        """
        found = self.survey_of(np.arange(self.patch_count * self.span_count))
        bounds, corners, means = (row.reshape(*row.shape[:-1], self.patch_count, self.span_count) for row in found)
        return bounds, corners, means

    def survey_of(self, spans: IntArray) -> tuple[Array, Array, Array]:
        """Return lower bounds of det J and of -det J, the least values of both at the 8 corners, and means of det J.

        spans: flat numbers (k,), see `numbers`. The shapes are (2, k), (2, k) and (k,).
        """

        def part(chunk: IntArray) -> tuple[Array, Array, Array]:
            values, permanents = self.coefficients(self.numbers(chunk))
            return (
                _least_of_both(values) - self.errors(permanents),
                _least_of_both(corners_of(values)),
                values.mean(axis=(0, 1, 2)),
            )

        chunks = [spans[i : i + CHUNK] for i in range(0, max(len(spans), 1), CHUNK)]
        bounds, corners, means = (
            np.concatenate(parts, axis=-1) for parts in zip(*in_parallel(part, chunks), strict=True)
        )
        return bounds, corners, means

    def coefficients(self, spans: IntArray) -> tuple[Array, Array]:
        """Return Bernstein coefficients on spans (k, 4), (d_u, d_v, d_w, k), and permanents (k,) that bound them."""
        local, sizes = zip(*(self._derivative(b, spans) for b in range(3)), strict=True)
        f_u, f_v, f_w = local  # (3, n_0, n_1, n_2, k) each, scaled Bernstein form
        determinant = dot_products(f_u, cross_products(f_v, f_w)) * self.unscale
        (a, b, c), (d, e, f), (g, h, i) = np.stack(sizes, axis=1)
        return determinant, a * (e * i + f * h) + b * (d * i + f * g) + c * (d * h + e * g)

    def errors(self, permanents: Array, depth: int = 0) -> Array:
        """Return a bound of the rounding error in the coefficients, `depth` halvings included: (k,).

        A halving is one product with weights that sum to 1 a direction: as many roundings as it has terms.
        """
        relative = (self.roundings + depth * sum(self.counts)) * _UNIT_ROUNDOFF
        return 1.01 * relative / (1.0 - relative) * permanents + _UNDERFLOW  # one percent: the bound itself is rounded

    def _derivative(self, b: int, spans: IntArray) -> tuple[Array, Array]:
        """Return the b-th derivative on spans (k, 4): scaled Bernstein form (3, n_0, n_1, n_2, k), sizes (3, k)."""
        net = self._near(self.nets[b], b, spans)
        magnitudes, shape = np.abs(net).max(axis=(1, 2, 3)), net.shape
        for axis, ((_, weights), number) in enumerate(zip(self.bases[b], spans.T[1:], strict=True)):
            matrices = np.ascontiguousarray(np.moveaxis(weights[number], 0, -1))
            net = along_second_axis(
                matrices, net.reshape(int(np.prod(shape[: 1 + axis])), len(matrices), -1, len(spans))
            )
        return net.reshape(shape), magnitudes

    def _near(self, net: Array, b: int, spans: IntArray) -> Array:
        """Return those of the b-th derivative's control points (patches, c, ..) that spans (k, 4) need: (c, .., k)."""
        first = np.stack([start[number] for (start, _), number in zip(self.bases[b], spans.T[1:], strict=True)])
        return windows(net, spans[:, 0], first, tuple(weights.shape[1] for _, weights in self.bases[b]))


def _least_of_both(values: Array) -> Array:
    """Return the least of values (.., .., .., k) and of their negatives: (2, k)."""
    return np.stack([values.min(axis=(0, 1, 2)), -values.max(axis=(0, 1, 2))])


def corners_of(values: Array, first: int = 0) -> Array:
    """Return the coefficients at the eight corners of the three axes from `first` on: (..., 2, 2, 2, ...)."""
    steps = (slice(None, None, n - 1) for n in values.shape[first : first + 3])
    return np.asarray(values[(slice(None),) * first + tuple(steps)])


def _differences(points: Array, knots: Array, degree: int, axis: int) -> tuple[Array, IntArray]:
    """Return control points (patches, 3, ..) of the derivative along an axis as m and e of m * 2**e.

    They follow from The NURBS Book, eq. 3.7. Every m is 0 or in [1/4, 1), so that no product underflows.
    """
    n = points.shape[axis + 2]
    width = knots[degree + 1 : degree + n] - knots[1:n]
    with np.errstate(over="ignore"):
        factor = degree / width
    if not np.all(np.isfinite(factor)):
        raise ValueError("the derivatives of the volume overflow; widen its knot spans")
    shape = [1, 1, 1, 1, 1]
    shape[axis + 2] = n - 1
    mantissas, exponents = np.frexp(np.diff(points, axis=axis + 2))
    factor_mantissas, factor_exponents = np.frexp(factor.reshape(shape))
    return mantissas * factor_mantissas, exponents.astype(np.int64) + factor_exponents


def _to_unit_magnitude(derivatives: list[tuple[Array, IntArray]]) -> tuple[list[Array], IntArray]:
    """Return the three derivatives' control points m * 2**e / 2**(r_a + c_b), and each patch's sum of all r_a and c_b.

    r_a belongs to a component and c_b to a derivative. All magnitudes are below 1, and in each row and each column of J
    some reach 1/4. This is the only rounding: a number below 2**-1022 is then off by at most 2**-1075.
    """
    largest = np.stack([np.where(m != 0.0, e, _NO_EXPONENT).max(axis=(2, 3, 4)) for m, e in derivatives], axis=2)
    rows = largest.max(axis=2)  # (patches, 3)
    columns = (largest - rows[:, :, None]).max(axis=1)
    shifts = rows[:, :, None] + columns[:, None]  # (patches, component, derivative)
    nets = [np.ldexp(m, e - shifts[:, :, b, None, None, None]) for b, (m, e) in enumerate(derivatives)]
    return nets, rows.sum(axis=1) + columns.sum(axis=1)


def unscaling(counts: tuple[int, ...]) -> Array:
    """Return the factors (d_u, d_v, d_w, 1) that take polynomials of d coefficients from scaled Bernstein form."""
    return np.asarray(np.einsum("i,j,k->ijk", *(1.0 / binomials(d - 1) for d in counts)))[..., None]


def scaled_extraction(knots: Array, degree: int, derivative: bool) -> tuple[IntArray, Array]:
    """Return the extraction to scaled Bernstein form for the basis, or for the basis of its derivative."""
    lowered = int(derivative)
    first, weights = extraction(knots[lowered : len(knots) - lowered], degree - lowered)
    return first, weights * binomials(degree - lowered)[:, None]


def _roundings(degrees: tuple[int, int, int]) -> int:
    """Return how many rounding errors a Bernstein coefficient of det J passes through, at most.

    Write u for the unit roundoff and gamma_n = n u / (1 - n u); a chain of n roundings changes a number by a factor
    within 1 +- gamma_n (Higham, "Accuracy and Stability of Numerical Algorithms", lemma 3.1). Control points and
    knots are taken as exact. Then
    - a control point of a derivative, p (P_1 - P_0) / (t_1 - t_0): 4 roundings;
    - extraction to Bernstein form in a direction of degree q <= p: weights 5 q, binomial 1, product and sum q + 1;
    - a component of F_v x F_w: a sum of at most 2 (p_u + 1) p_v p_w products;
    - its dot product with F_u: a sum of at most 3 p_u (p_v + 1) (p_w + 1) products;
    - division by the three binomials: 6.
    Each coefficient is a sum of products of three derivative control points, with weights that are not negative and,
    over each of the six permutations in the determinant, sum to 1. So the sum of the absolute values of its terms is
    at most perm(A), A[a, b] the largest |component a| among the control points of the b-th derivative near the span,
    and the error is at most gamma_n perm(A).

    Underflow is gradual: sums and differences lose nothing; a product, a quotient or a scaling loses at most 2**-1075,
    call it h. All numbers are at most 1, or with their binomials at most these, and C(q, i) C(r, j) is at most
    C(q + r, i + j), by which the result is divided: the other factors do not enlarge the loss in one of them. Lost are
    - by a control point of a derivative h, in its scaling alone;
    - by a weight of the extraction 4 p h, by the sums with p + 1 of them (p + 1) h a direction;
    - by a coefficient of det J h for each product that it passes through: at most 2 (p_u + 1) p_v p_w products for each
      of 3 p_u (p_v + 1) (p_w + 1), these themselves, 3 for the binomials, and 3 p a direction in a halving.
    For degrees up to 100 that is less than 1e14 h, far below _UNDERFLOW.
    """
    u, v, w = degrees
    net = 4 + sum(6 * p + 2 for p in degrees)
    return 3 * net + (2 * (u + 1) * v * w + 1) + (3 * u * (v + 1) * (w + 1) + 1) + 6
