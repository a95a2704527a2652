"""Bounds det J on spans by the ranges of its columns: cheaper than its Bernstein coefficients, and less close.

On a span, and in every triple product of which a Bernstein coefficient of det J is a weighted mean, each column of J is
a weighted mean of its own Bezier points. With any matrix M, here the inverse of J near the middle of the span, det J is
det(M J) / det M. The ranges of the entries of M J, which is near the identity, bound its determinant: a diagonal that
is far from zero, and products of at least two entries beside it, which are small.
"""

import numba
import numpy as np

from ..arrays import Array, IntArray
from ..spline.bernstein import extraction
from ..spline.patch_groups import PatchGroup
from ..threads import in_parallel

_CHUNK = 512  # spans at a time
_UNIT_ROUNDOFF = 2.0**-53
_SAFETY = 1.1  # for the roundings of the bounds of roundings
_LEAST_DET = 1e-200  # in the middle of a span: far above all that underflow can lose


def bounds_by_ranges(group: PatchGroup, nets: list[Array]) -> Array:
    """Return bounds of det J on all spans of polynomial patches: (patches, spans).

    A positive number is a lower bound of det J on the span, a negative one an upper bound. Both also bound the
    Bernstein coefficients there. 0: this way gives no bound. nets: the control points (patches, 3, ...) of the three
    derivatives, at most 1 and exact but for four roundings; det J is theirs.
    """
    first, weights = _extractions(group)
    spans = [int((np.diff(knots) > 0.0).sum()) for knots in group.knots]
    roundings = 4 + sum(6 * degree + 2 for degree in group.degrees)  # as determinant.py counts them
    error = _SAFETY * (roundings + 4) * _UNIT_ROUNDOFF  # of a component of a Bezier point, and 4 for its product with M
    sizes = np.array([[p + (b != a) for a, p in enumerate(group.degrees)] for b in range(3)])  # of derivative b, axis a

    def part(numbers: IntArray) -> Array:
        places = np.stack(np.unravel_index(numbers, (len(group), *spans)), axis=-1)
        return np.asarray(_bounds(tuple(nets), places, first, weights, sizes, error))

    count = len(group) * int(np.prod(spans))
    chunks = [np.arange(begin, min(begin + _CHUNK, count)) for begin in range(0, count, _CHUNK)]
    return np.concatenate(in_parallel(part, chunks)).reshape(len(group), -1)


def _extractions(group: PatchGroup) -> tuple[IntArray, Array]:
    """Return first control points (3, 3, s) and weights (3, 3, s, n, n) to Bezier points: derivative, axis, span."""
    found = [
        [extraction(knots[b == a : len(knots) - (b == a)], p - (b == a)) for a, (knots, p) in enumerate(rows)]
        for b in range(3)
        for rows in [list(zip(group.knots, group.degrees, strict=True))]
    ]
    most, width = max(len(first) for row in found for first, _ in row), max(group.degrees) + 1
    firsts, weights = np.zeros((3, 3, most), dtype=np.int64), np.zeros((3, 3, most, width, width))
    for b, row in enumerate(found):
        for a, (first, own) in enumerate(row):
            firsts[b, a, : len(first)] = first
            weights[b, a, : len(own), : own.shape[1], : own.shape[2]] = own
    return firsts, weights


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bounds(
    nets: tuple[Array, Array, Array], places: IntArray, first: IntArray, weights: Array, sizes: IntArray, error: float
) -> Array:
    """Return `bounds_by_ranges` for spans (k, 4), as (patch, i, j, l)."""
    n = weights.shape[3]
    found, points, row = np.zeros(len(places)), np.empty((3, 3, n, n, n)), np.empty(n)
    for s in range(len(places)):
        patch, place = places[s, 0], places[s, 1:]
        for b in range(3):
            _bezier_points(nets[b][patch], place, first[b], weights[b], sizes[b], points[b], row)
        found[s] = _bound(points, sizes, error)
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bezier_points(
    net: Array, place: IntArray, first: IntArray, weights: Array, sizes: IntArray, out: Array, row: Array
) -> None:
    """Write the Bezier points of a span to out (3, n, n, n); row: (n,), for intermediate results."""
    n_u, n_v, n_w = sizes
    u, v, w = first[0, place[0]], first[1, place[1]], first[2, place[2]]
    in_u, in_v, in_w = weights[0, place[0]], weights[1, place[1]], weights[2, place[2]]
    for c in range(3):
        field = out[c]
        for i in range(n_u):
            for j in range(n_v):
                for k in range(n_w):
                    total = 0.0
                    for x in range(n_w):
                        total += in_w[k, x] * net[c, u + i, v + j, w + x]
                    field[i, j, k] = total
            for k in range(n_w):
                for j in range(n_v):
                    row[j] = field[i, j, k]
                for j in range(n_v):
                    total = 0.0
                    for x in range(n_v):
                        total += in_v[j, x] * row[x]
                    field[i, j, k] = total
        for j in range(n_v):
            for k in range(n_w):
                for i in range(n_u):
                    row[i] = field[i, j, k]
                for i in range(n_u):
                    total = 0.0
                    for x in range(n_u):
                        total += in_u[i, x] * row[x]
                    field[i, j, k] = total


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bound(points: Array, sizes: IntArray, error: float) -> float:
    """Return the bound of the determinant with columns among the Bezier points (3, 3, n, n, n); 0 where there is none.

    The first index is the column, the second one the component. Every rounding makes the bound smaller.
    """
    middle, inverse = np.zeros((3, 3)), np.empty((3, 3))
    for b in range(3):
        n_u, n_v, n_w = sizes[b]
        for c in range(3):
            for i in (0, n_u - 1):
                for j in (0, n_v - 1):
                    for k in (0, n_w - 1):
                        middle[c, b] += 0.125 * points[b, c, i, j, k]
    det = _determinant(middle)
    if not abs(det) > _LEAST_DET:
        return 0.0
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = (middle[a, c] * middle[b, d] - middle[a, d] * middle[b, c]) / det
    least, most, product = np.empty((3, 3)), np.empty((3, 3)), 1.0  # of the entries (component, column) of M J
    for c in range(3):
        x, y, z = inverse[c]
        size = abs(x) + abs(y) + abs(z)
        product *= size
        for b in range(3):
            n_u, n_v, n_w = sizes[b]
            low, high = np.inf, -np.inf
            for i in range(n_u):
                for j in range(n_v):
                    for k in range(n_w):
                        value = x * points[b, 0, i, j, k] + y * points[b, 1, i, j, k] + z * points[b, 2, i, j, k]
                        low, high = min(low, value), max(high, value)
            least[c, b], most[c, b] = low - size * error, high + size * error
    if not min(least[0, 0], least[1, 1], least[2, 2]) > 0.0:
        return 0.0
    largest = np.maximum(-least, most)
    xy, yx, xz, zx, yz, zy = largest[0, 1], largest[1, 0], largest[0, 2], largest[2, 0], largest[1, 2], largest[2, 1]
    diagonal = least[0, 0] * least[1, 1] * least[2, 2]
    beside = most[2, 2] * xy * yx + most[1, 1] * xz * zx + most[0, 0] * yz * zy + xy * yz * zx + xz * yx * zy
    bound = diagonal - beside - 16.0 * _UNIT_ROUNDOFF * (diagonal + beside)
    of_inverse, error_there = _determinant(inverse), 16.0 * _UNIT_ROUNDOFF * product
    if not (bound > 0.0 and abs(of_inverse) > error_there):
        return 0.0
    bound *= (1.0 - 8.0 * _UNIT_ROUNDOFF) / (abs(of_inverse) + error_there)
    return bound if of_inverse > 0.0 else -bound


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _determinant(m: Array) -> float:
    """Return the determinant of a matrix (3, 3)."""
    first = m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
    second = m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
    return first - second + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
