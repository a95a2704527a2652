"""det J in rational arithmetic: every float is a rational, so that its sign can be decided exactly."""

from fractions import Fraction
from functools import cache, reduce
from itertools import permutations, product
from math import comb

import numpy as np

from parameterize.spline.bspline import greville
from parameterize.spline.volume import BSplineVolume


def grid_of(knots, degrees):
    """Control points of the identity map."""
    rows = [greville(k, p) for k, p in zip(knots, degrees, strict=True)]
    return np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)


def random_volume(rng, degrees, n_spans, amplitude):
    knots = []
    for p, n in zip(degrees, n_spans, strict=True):
        inner = np.sort(rng.uniform(0.1, 0.9, n - 1))
        knots.append(np.concatenate([np.zeros(p + 1), inner, np.ones(p + 1)]))
    points = grid_of(knots, degrees)
    return BSplineVolume(degrees, tuple(knots), points + amplitude * rng.uniform(-1.0, 1.0, points.shape))


def rational(values):
    return np.vectorize(Fraction, otypes=[object])(np.asarray(values, dtype=np.float64))


def exact_bezier_rows(knots, degree):
    """For each span, the blossom weights as dictionaries {coefficient: Fraction}, one row a Bernstein coefficient."""
    t = [Fraction(float(k)) for k in knots]

    def blossom(i, r, arguments):
        if r == 0:
            return {i: Fraction(1)}
        left, right, x = t[i], t[i + degree + 1 - r], arguments[r - 1]
        share = (x - left) / (right - left)
        row = {}
        for weight, part in ((1 - share, blossom(i - 1, r - 1, arguments)), (share, blossom(i, r - 1, arguments))):
            for key, value in part.items():
                row[key] = row.get(key, Fraction(0)) + weight * value
        return row

    spans = [m for m in range(len(t) - 1) if t[m] < t[m + 1]]
    return [[blossom(m, degree, [t[m]] * (degree - j) + [t[m + 1]] * j) for j in range(degree + 1)] for m in spans]


def exact_coefficients(volume):
    """Bernstein coefficients of det J on every span, (spans..., d_u, d_v, d_w) of Fractions.

    Of a rational volume those of det J W^4.
    """
    points = rational(volume.control_points)
    if volume.weights is not None:
        weights = rational(volume.weights)[..., None]
        points = np.concatenate([points * weights, weights], axis=-1)
    rows = [exact_bezier_rows(k, p) for k, p in zip(volume.knots, volume.degrees, strict=True)]
    result = {}
    for span in product(*(range(len(r)) for r in rows)):
        net = points
        for axis in range(3):
            moved = np.moveaxis(net, axis, 0)
            moved = np.array(
                [sum(w * moved[i] for i, w in row.items()) for row in rows[axis][span[axis]]], dtype=object
            )
            net = np.moveaxis(moved, 0, axis)
        columns = []
        for b in range(3):
            breaks = np.unique(volume.knots[b])
            width = Fraction(float(breaks[span[b] + 1])) - Fraction(float(breaks[span[b]]))
            columns.append(np.diff(net, axis=b) * volume.degrees[b] / width)
        result[span] = exact_determinant(columns if volume.weights is None else [*columns, net])
    return result


def scale(polynomial, inverse=False):
    out = polynomial.copy()
    for axis in range(3):
        q = polynomial.shape[axis] - 1
        factors = np.array([Fraction(comb(q, i)) for i in range(q + 1)], dtype=object)
        shape = [1, 1, 1]
        shape[axis] = -1
        out = out / factors.reshape(shape) if inverse else out * factors.reshape(shape)
    return out


def convolve(a, b):
    shape = tuple(n + m - 1 for n, m in zip(a.shape, b.shape, strict=True))
    out = np.full(shape, Fraction(0), dtype=object)
    for index in np.ndindex(a.shape):
        window = tuple(slice(i, i + m) for i, m in zip(index, b.shape, strict=True))
        out[window] += a[index] * b
    return out


def exact_determinant(columns):
    n = len(columns)
    total = Fraction(0)
    for order in permutations(range(n)):
        sign = round(np.linalg.det(np.eye(n)[list(order)]))
        parts = [scale(columns[b][..., order[b]]) for b in range(n)]
        total = total + sign * reduce(convolve, parts)
    return scale(total, inverse=True)


def exact_verdict(coefficients, depth=5):
    """True: positive on the span; False: not positive somewhere; None: not decided at this depth."""
    corners = [coefficients[tuple(c)] for c in product(*((0, n - 1) for n in coefficients.shape))]
    if min(corners) <= 0:
        return False
    if coefficients.min() > 0:
        return True
    if depth == 0:
        return None
    answers = set()
    for piece in exact_halves(coefficients):
        answers.add(exact_verdict(piece, depth - 1))
        if False in answers:
            return False
    return None if None in answers else True


def exact_halves(coefficients):
    pieces = [coefficients]
    for axis in range(3):
        matrix = exact_halving(coefficients.shape[axis] - 1)
        pieces = [np.moveaxis(np.tensordot(m, p, axes=(1, axis)), 0, axis) for p in pieces for m in matrix]
    return pieces


@cache
def exact_halving(q):
    left = [[Fraction(comb(i, j), 2**i) if j <= i else Fraction(0) for j in range(q + 1)] for i in range(q + 1)]
    left = np.array(left, dtype=object)
    return left, left[::-1, ::-1]
