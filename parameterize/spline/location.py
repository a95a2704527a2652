"""Finds the parameters of points in space: F(u, v, w) = x, or that x lies outside of the body.

Newton's method from the middle of a knot span near the point finds most. The rest is decided by branch and bound: the
Bezier control points of a span, and of each part that halving gives, form a box in which that part lies (Farouki, "The
Bernstein polynomial basis: a centennial retrospective", CAGD 29, 2012). Where no box holds a point, it is outside.
Nets of a rational patch are halved in homogeneous components; with positive weights the box of the control points
holds the part, too. Patches are searched in groups (patch_groups.py).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..array_copies import write
from ..arrays import Array, IntArray, Knots, Mask
from ..threads import in_parallel
from .bernstein import extraction
from .bspline import breakpoints, fill_basis, midpoints, real_array
from .patch_groups import PatchGroup, groups_of
from .rational import projected
from .volume import BSplineVolume

CLOSE = 1e-10  # distance from x, over the diagonal of the box of control points, at which F(u, v, w) counts as x
_BORDER = 1e-4  # of the parameters: a point so near to a face of its patch may belong to another patch, too
_STEPS = 20  # of Newton's method, at most
_HALVINGS = 8  # of a step that does not lead closer, at most
_EXACT = 1e-15  # distance over the diagonal at which nothing is left to gain
_LEVELS = 120  # of branch and bound, at most
_VISITS = 20_000  # parts of a patch looked at for a point, at most: a bound for maps that fold
_PIECE = 4096  # points a task


def locate(patches: Sequence[BSplineVolume], points: ArrayLike) -> tuple[IntArray, Array]:
    """Return the patches (m,) and parameters (m, 3) of points (m, 3) in the patches' units; -1 and NaN outside.

    A point that is not farther than CLOSE of a patch's diagonal from it counts as inside. On an interface the patch
    that comes first is taken. Where a map folds, the answer is one of the point's places.
    Raises ValueError for points of another shape or that are not finite.
    """
    where = np.atleast_2d(real_array(points, "points"))
    if where.ndim != 2 or where.shape[1] != 3:
        raise ValueError(f"points must have shape (m, 3), got {np.shape(points)}")
    if not np.all(np.isfinite(where)):
        raise ValueError("points must be finite")
    return _index(tuple(patches)).places(where)


@lru_cache(maxsize=2)  # volumes are compared by identity, and do not change
def _index(patches: tuple[BSplineVolume, ...]) -> "_Index":
    return _Index(groups_of(patches))


class _Index:
    """The patches of a body prepared for the search; the tree holds the middles of the spans of all groups."""

    def __init__(self, groups: Sequence[PatchGroup]) -> None:
        self.count = sum(map(len, groups))
        self.groups = list(map(_GroupIndex.of, groups))
        middles = [_middles(group) for group in groups]
        self.begins = np.cumsum([0, *map(len, middles)])
        self.tree = cKDTree(np.concatenate(middles))

    def places(self, points: Array) -> tuple[IntArray, Array]:
        """Return the patches (m,) and the parameters (m, 3) of points (m, 3), -1 and NaN outside."""
        owners: IntArray = np.full(len(points), self.count)  # of a point that is not found
        found = np.full((len(points), 3), np.nan)
        rows = np.flatnonzero(np.any([group.may_hold(points) for group in self.groups], axis=0))
        nearest = np.asarray(self.tree.query(points[rows])[1], dtype=np.int64)
        for group, begin, end in zip(self.groups, self.begins, self.begins[1:], strict=False):
            own = (nearest >= begin) & (nearest < end)
            group.improve(points, rows[own], nearest[own] - begin, owners, found)
        rows = rows[~((found[rows] > _BORDER) & (found[rows] < 1.0 - _BORDER)).all(axis=1)]
        for group in self.groups:
            group.search(points, rows[group.may_hold(points[rows])], owners, found)
        return np.where(owners < self.count, owners, -1), found


@dataclass(frozen=True, eq=False)
class _GroupIndex:
    """A group of patches prepared for the search. Spans are counted patch after patch, those of w fastest.

    starts (s, 3): the middles of the spans of a patch. nets: the Bezier control points of all spans, as `bezier_nets`
    returns them, and low and high, (k s, 3), the boxes of these. ends (s, 2, 3): the spans of a patch themselves.
    diagonals (k,): of the patches' boxes. Cells of a grid over the whole box list the spans whose boxes reach them:
    members[first[c] : first[c + 1]] of c.
    """

    group: PatchGroup
    starts: Array
    nets: Array
    low: Array
    high: Array
    ends: Array
    corner: Array
    cell: Array
    counts: IntArray
    first: IntArray
    members: IntArray
    diagonals: Array

    @classmethod
    def of(cls, group: PatchGroup) -> "_GroupIndex":
        starts = np.stack(np.meshgrid(*map(midpoints, group.knots), indexing="ij"), axis=-1).reshape(-1, 3)
        nets = bezier_nets(group)
        points = nets if group.weights is None else projected(nets)[0]
        low, high = points.min(axis=(1, 2, 3)), points.max(axis=(1, 2, 3))
        each_low, each_high = (side.reshape(len(group), -1, 3) for side in (low, high))
        diagonals = np.linalg.norm(each_high.max(axis=1) - each_low.min(axis=1), axis=1)
        margin = CLOSE * diagonals
        low, high = low - np.repeat(margin, len(starts))[:, None], high + np.repeat(margin, len(starts))[:, None]
        corner, size = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
        counts = np.full(3, max(1, round(1.5 * len(nets) ** (1 / 3))), dtype=np.int64)
        cell = size / counts
        first, members = _cells(low, high, corner, cell, counts)
        ends = _ends(group.knots)
        return cls(group, starts, nets, low, high, ends, corner, cell, counts, first, members, diagonals)

    def may_hold(self, points: Array) -> Mask:
        """Return whether points (m, 3) lie in the box of the group."""
        return np.all((points >= self.low.min(axis=0)) & (points <= self.high.max(axis=0)), axis=1)

    def improve(self, points: Array, rows: IntArray, spans: IntArray, owners: IntArray, found: Array) -> None:
        """Write patches (m,) and parameters (m, 3) of those points (m, 3) that Newton's method finds.

        It begins for the points of some rows (k,) in the middle of one of the spans each, (k,).
        """
        places, begin = np.divmod(spans, len(self.starts))

        def task(part: slice) -> Array:
            nearest = self.starts[begin[part]]
            return _improved(points[rows[part]], places[part], nearest, *self._spline, *self._grid)

        found[rows] = _in_pieces(task, len(rows), 3)
        reached = np.isfinite(found[rows, 0])
        owners[rows[reached]] = self.group.numbers[places[reached]]

    def search(self, points: Array, rows: IntArray, owners: IntArray, found: Array) -> None:
        """Write patches (m,) and parameters (m, 3) of points of some rows (k,) that lie in a patch before their own."""
        spans = self.nets, self.low, self.high, self.ends

        def task(part: slice) -> Array:
            own = rows[part]
            return _searched(points[own], owners[own], self.group.numbers, *self._spline, *self._grid, *spans)

        answers = _in_pieces(task, len(rows), 4)
        better = np.isfinite(answers[:, 0])
        owners[rows[better]] = answers[better, 3].astype(np.int64)
        found[rows[better]] = answers[better, :3]

    @property
    def _spline(self) -> tuple[Array, IntArray, Array, Array]:
        group = self.group
        return _padded(group.knots), np.array(group.degrees), np.ascontiguousarray(group.coefficients), self.diagonals

    @property
    def _grid(self) -> tuple[Array, Array, IntArray, IntArray, IntArray]:
        return self.corner, self.cell, self.counts, self.first, self.members


def _in_pieces(task: Callable[[slice], Array], count: int, columns: int) -> Array:
    """Return the rows (count, columns) that a task returns for each piece of them."""
    parts = [slice(i, i + _PIECE) for i in range(0, count, _PIECE)]
    return np.concatenate([np.empty((0, columns)), *in_parallel(task, parts)])


def _middles(group: PatchGroup) -> Array:
    """Return the middles (s, 3) of all spans in space, in the order of `bezier_nets`."""
    u, v, w = map(midpoints, group.knots)
    return group.grid(u, v, w).reshape(-1, 3)


def bezier_nets(group: PatchGroup) -> Array:
    """Return the Bezier control points (s, p_u + 1, p_v + 1, p_w + 1, 3) of all spans, those of w fastest.

    They come patch after patch. Of rational patches they are homogeneous, (.., 4).
    """
    net = group.coefficients
    for axis, (knots, degree) in enumerate(zip(group.knots, group.degrees, strict=True)):
        first, weights = extraction(knots, degree)
        place = 2 * axis + 1
        windows = np.moveaxis(net, place, 0)[first[:, None] + np.arange(degree + 1)]
        net = np.moveaxis(np.einsum("sjk,sk...->sj...", weights, windows), (0, 1), (place, place + 1))
    net = np.ascontiguousarray(net.transpose(0, 1, 3, 5, 2, 4, 6, 7))
    return net.reshape(-1, *net.shape[4:])


def _padded(knots: Knots) -> Array:
    """Return the knot vectors as rows of one array, their ends filled with infinity."""
    rows = np.full((3, max(map(len, knots))), np.inf)
    for row, values in zip(rows, knots, strict=True):
        row[: len(values)] = values
    return rows


def _ends(knots: Knots) -> Array:
    """Return the lower and upper parameters (s, 2, 3) of all spans, in the order of `bezier_nets`."""
    breaks = [breakpoints(row) for row in knots]
    low, high = (np.meshgrid(*(row[side] for row in breaks), indexing="ij") for side in (slice(-1), slice(1, None)))
    return np.stack([np.stack(low, axis=-1).reshape(-1, 3), np.stack(high, axis=-1).reshape(-1, 3)], axis=1)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _cells(low: Array, high: Array, corner: Array, cell: Array, counts: IntArray) -> tuple[IntArray, IntArray]:
    """Return which boxes (s, 3) reach each cell of a grid: first (cells + 1,), members."""
    first = np.zeros(counts[0] * counts[1] * counts[2] + 1, dtype=np.int64)
    members = np.zeros(0, dtype=np.int64)
    for filling in range(2):
        place = first.copy()
        for s in range(len(low)):
            a, b = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
            for d in range(3):
                a[d] = min(max(int((low[s, d] - corner[d]) / cell[d]), 0), counts[d] - 1)
                b[d] = min(max(int((high[s, d] - corner[d]) / cell[d]), 0), counts[d] - 1)
            for i in range(a[0], b[0] + 1):
                for j in range(a[1], b[1] + 1):
                    for k in range(a[2], b[2] + 1):
                        c = (i * counts[1] + j) * counts[2] + k
                        if filling:
                            members[place[c]] = s
                            place[c] += 1
                        else:
                            first[c + 1] += 1
        if not filling:
            first = np.cumsum(first)
            members = np.zeros(first[-1], dtype=np.int64)
    return first, members


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _improved(
    points: Array,
    places: IntArray,
    begin: Array,
    knots: Array,
    degrees: IntArray,
    control: Array,
    diagonals: Array,
    corner: Array,
    cell: Array,
    counts: IntArray,
    first: IntArray,
    members: IntArray,
) -> Array:
    """Return the parameters (m, 3) of points (m, 3) in patches at places (m,), NaN where Newton's method fails.

    It begins at parameters (m, 3).
    """
    found = np.full((len(points), 3), np.nan)
    basis = np.empty((3, 2, 1, degrees.max() + 1))
    for m in range(len(points)):
        if len(_near(points[m], corner, cell, counts, first, members)):
            k = places[m]
            _newton(points[m], begin[m], knots, degrees, control[k], basis, diagonals[k], found[m])
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _near(point: Array, corner: Array, cell: Array, counts: IntArray, first: IntArray, members: IntArray) -> IntArray:
    """Return the spans whose boxes reach the cell of a point, ascending; none outside of all cells."""
    c = 0
    for d in range(3):
        place = int(np.floor((point[d] - corner[d]) / cell[d]))
        if not 0 <= place < counts[d]:
            return members[:0]
        c = c * counts[d] + place
    return members[first[c] : first[c + 1]]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _searched(
    points: Array,
    limits: IntArray,
    numbers: IntArray,
    knots: Array,
    degrees: IntArray,
    control: Array,
    diagonals: Array,
    corner: Array,
    cell: Array,
    counts: IntArray,
    first: IntArray,
    members: IntArray,
    nets: Array,
    low: Array,
    high: Array,
    ends: Array,
) -> Array:
    """Return parameters and patch (m, 4) of points (m, 3) in a patch with a number below limits (m,), NaN elsewhere.

    numbers: (k,) of the group's patches, ascending. The first patch that holds a point is taken.
    """
    found = np.full((len(points), 4), np.nan)
    basis = np.empty((3, 2, 1, degrees.max() + 1))
    stack = np.empty((_LEVELS + 2, *nets.shape[1:]))
    boxes = np.empty((_LEVELS + 2, 2, 3))
    levels = np.empty(_LEVELS + 2, dtype=np.int64)
    for m in range(len(points)):
        patch, visits = -1, 0
        for s in _near(points[m], corner, cell, counts, first, members):
            if s // len(ends) != patch:
                patch, visits = s // len(ends), 0
            if numbers[patch] >= limits[m]:
                break
            if not _holds(low[s], high[s], points[m]):
                continue
            write(nets[s], stack[0])
            write(ends[s % len(ends)], boxes[0])
            levels[0] = 0
            size, margin = 1, CLOSE * diagonals[patch]
            while size and visits < _VISITS:
                size -= 1
                visits += 1
                if levels[size] % 3 == 0:
                    middle = 0.5 * (boxes[size, 0] + boxes[size, 1])
                    net, answer = control[patch], found[m, :3]
                    if _newton(points[m], middle, knots, degrees, net, basis, diagonals[patch], answer):
                        found[m, 3] = numbers[patch]
                        break
                if levels[size] < _LEVELS:
                    size = _halve(points[m], stack, boxes, levels, size, margin)
            if not np.isnan(found[m, 3]):
                break
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _holds(low: Array, high: Array, point: Array) -> bool:
    """Return whether a point (3,) lies in the box from low to high (3,)."""
    inside = True
    for d in range(3):
        inside = inside and low[d] <= point[d] <= high[d]
    return inside


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _halve(point: Array, stack: Array, boxes: Array, levels: IntArray, top: int, margin: float) -> int:
    """Put those halves of the part at `top` in its place whose boxes hold the point; return the number of parts then.

    The part is halved in the direction in which its control points lie farthest apart (de Casteljau).
    """
    axis, widest = 0, -1.0
    for d in range(3):
        width = _width(stack[top], d)
        if width > widest:
            axis, widest = d, width
    right = stack[top].copy()
    left = right.copy()
    _cut(right, left, axis)
    box, level, size = boxes[top].copy(), levels[top] + 1, top
    middle = 0.5 * (box[0, axis] + box[1, axis])
    low, high = np.empty(3), np.empty(3)
    for side in range(2):
        net = right if side else left
        _enclose(net, margin, low, high)
        if _holds(low, high, point):
            write(net, stack[size])
            write(box, boxes[size])
            levels[size] = level
            boxes[size, 1 - side, axis] = middle
            size += 1
    return size


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _place(net: Array, i: int, j: int, k: int, d: int) -> float:
    """Return a coordinate of a control point of a net (n, m, l, 3), or homogeneous (n, m, l, 4)."""
    return float(net[i, j, k, d] if net.shape[3] == 3 else net[i, j, k, d] / net[i, j, k, 3])


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _width(net: Array, axis: int) -> float:
    """Return the largest difference of a coordinate of the first and the last layer of control points along an axis."""
    n, m, o = net.shape[0], net.shape[1], net.shape[2]
    widest = 0.0
    for i in range(1 if axis == 0 else n):
        for j in range(1 if axis == 1 else m):
            for k in range(1 if axis == 2 else o):
                last = n - 1 if axis == 0 else i, m - 1 if axis == 1 else j, o - 1 if axis == 2 else k
                for d in range(3):
                    apart = abs(_place(net, last[0], last[1], last[2], d) - _place(net, i, j, k, d))
                    widest = max(widest, apart)
    return widest


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _cut(right: Array, left: Array, axis: int) -> None:
    """Turn two copies of a net of control points into those of its halves along an axis, by de Casteljau."""
    n, m, o, c = right.shape
    degree = right.shape[axis] - 1
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for r in range(1, degree + 1):
        for i in range(n - r * di):
            for j in range(m - r * dj):
                for k in range(o - r * dk):
                    for d in range(c):
                        right[i, j, k, d] = 0.5 * (right[i, j, k, d] + right[i + di, j + dj, k + dk, d])
        for i in range(1 if di else n):
            for j in range(1 if dj else m):
                for k in range(1 if dk else o):
                    for d in range(c):
                        left[i + r * di, j + r * dj, k + r * dk, d] = right[i, j, k, d]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _enclose(net: Array, margin: float, low: Array, high: Array) -> None:
    """Write the box of control points, wider by a margin, into low and high (3,)."""
    low[:], high[:] = np.inf, -np.inf
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            for k in range(net.shape[2]):
                for d in range(3):
                    place = _place(net, i, j, k, d)
                    low[d], high[d] = min(low[d], place - margin), max(high[d], place + margin)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _newton(
    point: Array,
    begin: Array,
    knots: Array,
    degrees: IntArray,
    control: Array,
    basis: Array,
    diagonal: float,
    found: Array,
) -> bool:
    """Solve F(u, v, w) = x from `begin` in the cube; write the parameters into `found` where that succeeds."""
    where, trial, rest, step = begin.copy(), begin.copy(), np.empty(3), np.empty(3)
    value, jacobian = np.empty(3), np.empty((3, 3))
    _evaluate(where, knots, degrees, control, basis, value, jacobian)
    off = _distance(point, value)
    for _ in range(_STEPS):
        if off <= _EXACT * diagonal:
            break
        for d in range(3):
            rest[d] = point[d] - value[d]
        _solve(jacobian, rest, step)
        share, closer, now = 1.0, False, off
        for _ in range(_HALVINGS):
            for d in range(3):
                trial[d] = min(max(where[d] + share * step[d], 0.0), 1.0)
            _evaluate(trial, knots, degrees, control, basis, value, jacobian)
            now = _distance(point, value)
            closer = now < off
            if closer:
                break
            share *= 0.5
        if not closer:
            break
        off = now
        for d in range(3):
            where[d] = trial[d]
    if off > CLOSE * diagonal:
        return False
    for d in range(3):
        found[d] = where[d]
    return True


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _distance(one: Array, other: Array) -> float:
    """Return the distance of two points (3,)."""
    return float(np.sqrt((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 + (one[2] - other[2]) ** 2))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _solve(matrix: Array, right: Array, solution: Array) -> None:
    """Write the solution (3,) of a system (3, 3) by Cramer's rule; zero for a singular matrix."""
    solution[:] = 0.0
    det = 0.0
    for d in range(3):
        i, j = (d + 1) % 3, (d + 2) % 3
        minor = matrix[1, i] * matrix[2, j] - matrix[2, i] * matrix[1, j]
        det += matrix[0, d] * minor
    if det == 0.0:
        return
    for d in range(3):
        i, j = (d + 1) % 3, (d + 2) % 3
        first = matrix[1, i] * matrix[2, j] - matrix[2, i] * matrix[1, j]
        second = matrix[2, i] * matrix[0, j] - matrix[0, i] * matrix[2, j]
        third = matrix[0, i] * matrix[1, j] - matrix[1, i] * matrix[0, j]
        solution[d] = (right[0] * first + right[1] * second + right[2] * third) / det


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _evaluate(
    where: Array,
    knots: Array,
    degrees: IntArray,
    control: Array,
    basis: Array,
    value: Array,
    jacobian: Array,
) -> None:
    """Write F (3,) and its Jacobian (3, 3), columns the directions, at parameters (3,).

    control: (n_u, n_v, n_w, 3), or homogeneous, (.., 4), with the weight in the last place.
    """
    first = np.empty(3, dtype=np.int64)
    for d in range(3):
        n = control.shape[d]
        span = np.searchsorted(knots[d], where[d], side="right") - 1
        span = min(max(span, degrees[d]), n - 1)
        fill_basis(knots[d], degrees[d], where[d : d + 1], np.array([span]), basis[d, :, :, : degrees[d] + 1])
        first[d] = span - degrees[d]
    value[:], jacobian[:] = 0.0, 0.0
    is_rational, weight, along_u, along_v, along_w = control.shape[3] == 4, 0.0, 0.0, 0.0, 0.0  # W and its gradient
    u, v, w = basis[0, :, 0], basis[1, :, 0], basis[2, :, 0]
    for i in range(degrees[0] + 1):
        for j in range(degrees[1] + 1):
            for k in range(degrees[2] + 1):
                p = control[first[0] + i, first[1] + j, first[2] + k]
                for d in range(3):
                    value[d] += u[0, i] * v[0, j] * w[0, k] * p[d]
                    jacobian[d, 0] += u[1, i] * v[0, j] * w[0, k] * p[d]
                    jacobian[d, 1] += u[0, i] * v[1, j] * w[0, k] * p[d]
                    jacobian[d, 2] += u[0, i] * v[0, j] * w[1, k] * p[d]
                if is_rational:
                    weight += u[0, i] * v[0, j] * w[0, k] * p[3]
                    along_u += u[1, i] * v[0, j] * w[0, k] * p[3]
                    along_v += u[0, i] * v[1, j] * w[0, k] * p[3]
                    along_w += u[0, i] * v[0, j] * w[1, k] * p[3]
    if is_rational:
        for d in range(3):
            value[d] /= weight
            jacobian[d, 0] = (jacobian[d, 0] - value[d] * along_u) / weight
            jacobian[d, 1] = (jacobian[d, 1] - value[d] * along_v) / weight
            jacobian[d, 2] = (jacobian[d, 2] - value[d] * along_w) / weight
