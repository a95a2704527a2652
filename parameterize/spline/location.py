"""Finds the parameters of points in space: F(u, v, w) = x, or that x lies outside of the volume.

Newton's method from the middle of a knot span near the point finds most. The rest is decided by branch and bound: the
Bezier control points of a span, and of each part that halving gives, form a box in which that part lies (Farouki, "The
Bernstein polynomial basis: a centennial retrospective", CAGD 29, 2012). Where no box holds a point, it is outside.
Nets of a rational volume are halved in homogeneous components; with positive weights the box of the control points
holds the part, too.
"""

from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arrays import Array, IntArray, Knots
from ..threads import in_parallel
from .bernstein import extraction
from .bspline import breakpoints, fill_basis, midpoints, real_array
from .rational import projected
from .volume import BSplineVolume

CLOSE = 1e-10  # distance from x, over the diagonal of the box of control points, at which F(u, v, w) counts as x
_STEPS = 20  # of Newton's method, at most
_HALVINGS = 8  # of a step that does not lead closer, at most
_EXACT = 1e-15  # distance over the diagonal at which nothing is left to gain
_LEVELS = 120  # of branch and bound, at most
_VISITS = 20_000  # parts looked at for a point, at most: a bound for maps that fold
_PIECE = 4096  # points a task


def locate(volume: BSplineVolume, points: ArrayLike) -> Array:
    """Return the parameters (m, 3) of points (m, 3) in the volume's units; NaN for points outside.

    A point that is not farther than CLOSE of the diagonal from the volume counts as inside. Of a map that folds, the
    answer is one of the point's parameters.
    Raises ValueError for points of another shape or that are not finite.
    """
    where = np.atleast_2d(real_array(points, "points"))
    if where.ndim != 2 or where.shape[1] != 3:
        raise ValueError(f"points must have shape (m, 3), got {np.shape(points)}")
    if not np.all(np.isfinite(where)):
        raise ValueError("points must be finite")
    return _index(volume).parameters(where)


@lru_cache(maxsize=2)  # a volume is compared by identity, and does not change
def _index(volume: BSplineVolume) -> "_Index":
    return _Index.of(volume)


@dataclass(frozen=True, eq=False)
class _Index:
    """A volume prepared for the search.

    starts (s, 3): the middles of the spans, with their images in the tree. nets: their Bezier control points, as
    `bezier_nets` returns them, and low and high (s, 3), the boxes of these. ends (s, 2, 3): the spans themselves.
    Cells of a grid over the whole box list the spans whose boxes reach them: members[first[c] : first[c + 1]] of c.
    """

    volume: BSplineVolume
    starts: Array
    tree: cKDTree
    nets: Array
    low: Array
    high: Array
    ends: Array
    corner: Array
    cell: Array
    counts: IntArray
    first: IntArray
    members: IntArray
    diagonal: float

    @classmethod
    def of(cls, volume: BSplineVolume) -> "_Index":
        u, v, w = (midpoints(row) for row in volume.knots)
        starts = np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3)
        nets = bezier_nets(volume)
        points = nets if volume.weights is None else projected(nets)[0]
        low, high = points.min(axis=(1, 2, 3)), points.max(axis=(1, 2, 3))
        corner, size = low.min(axis=0), np.ptp(np.concatenate([low, high]), axis=0)
        diagonal = float(np.linalg.norm(size))
        margin = CLOSE * diagonal
        low, high = low - margin, high + margin
        counts = np.full(3, max(1, round(1.5 * len(nets) ** (1 / 3))), dtype=np.int64)
        cell = (size + 2.0 * margin) / counts
        corner = corner - margin
        first, members = _cells(low, high, corner, cell, counts)
        ends = _ends(volume.knots)
        tree = cKDTree(volume.grid(u, v, w).reshape(-1, 3))
        return cls(volume, starts, tree, nets, low, high, ends, corner, cell, counts, first, members, diagonal)

    def parameters(self, points: Array) -> Array:
        """Return the parameters (m, 3) of points (m, 3), NaN outside."""
        within = np.all((points >= self.low.min(axis=0)) & (points <= self.high.max(axis=0)), axis=1)
        found = np.full((len(points), 3), np.nan)  # points outside of the box are outside of the volume
        found[within] = self._parameters(points[within])
        return found

    def _parameters(self, points: Array) -> Array:
        spline = (_padded(self.volume.knots), np.array(self.volume.degrees), _coefficients(self.volume))
        search = (self.nets, self.low, self.high, self.ends, self.corner, self.cell, self.counts)

        def task(part: slice) -> Array:
            begin = self.starts[self.tree.query(points[part])[1]]
            return _located(points[part], begin, *spline, *search, self.first, self.members, self.diagonal)

        parts = [slice(i, i + _PIECE) for i in range(0, len(points), _PIECE)]
        return np.concatenate(in_parallel(task, parts)) if parts else np.empty((0, 3))


def bezier_nets(volume: BSplineVolume) -> Array:
    """Return the Bezier control points (s, p_u + 1, p_v + 1, p_w + 1, 3) of all spans, those of w fastest.

    Of a rational volume they are homogeneous, (.., 4).
    """
    net = _coefficients(volume)
    for axis, (knots, degree) in enumerate(zip(volume.knots, volume.degrees, strict=True)):
        first, weights = extraction(knots, degree)
        windows = np.moveaxis(net, 2 * axis, 0)[first[:, None] + np.arange(degree + 1)]
        net = np.moveaxis(np.einsum("sjk,sk...->sj...", weights, windows), (0, 1), (2 * axis, 2 * axis + 1))
    s_u, n_u, s_v, n_v, s_w, n_w, c = net.shape
    return np.ascontiguousarray(net.transpose(0, 2, 4, 1, 3, 5, 6)).reshape(s_u * s_v * s_w, n_u, n_v, n_w, c)


def _coefficients(volume: BSplineVolume) -> Array:
    """Return the control points (n_u, n_v, n_w, 3), of a rational volume homogeneous, (.., 4)."""
    return np.ascontiguousarray(volume.control_points if volume.weights is None else volume.homogeneous)


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
def _located(
    points: Array,
    begin: Array,
    knots: Array,
    degrees: IntArray,
    control: Array,
    nets: Array,
    low: Array,
    high: Array,
    ends: Array,
    corner: Array,
    cell: Array,
    counts: IntArray,
    first: IntArray,
    members: IntArray,
    diagonal: float,
) -> Array:
    """Return the parameters (m, 3) of points (m, 3), NaN outside; `begin` (m, 3) are where Newton's method starts."""
    found = np.full((len(points), 3), np.nan)
    basis = np.empty((3, 2, 1, degrees.max() + 1))
    stack = np.empty((_LEVELS + 2, *nets.shape[1:]))
    boxes = np.empty((_LEVELS + 2, 2, 3))
    levels = np.empty(_LEVELS + 2, dtype=np.int64)
    for m in range(len(points)):
        place = np.empty(3, dtype=np.int64)
        inside = True
        for d in range(3):
            place[d] = int(np.floor((points[m, d] - corner[d]) / cell[d]))
            inside = inside and 0 <= place[d] < counts[d]
        if not inside:
            continue
        c = (place[0] * counts[1] + place[1]) * counts[2] + place[2]
        if first[c] == first[c + 1]:
            continue
        if _newton(points[m], begin[m], knots, degrees, control, basis, diagonal, found[m]):
            continue
        visits = 0
        for s in members[first[c] : first[c + 1]]:
            if not _holds(low[s], high[s], points[m]):
                continue
            stack[0], boxes[0], levels[0] = nets[s], ends[s], 0
            size = 1
            while size and visits < _VISITS:
                size -= 1
                visits += 1
                if levels[size] % 3 == 0:
                    middle = 0.5 * (boxes[size, 0] + boxes[size, 1])
                    if _newton(points[m], middle, knots, degrees, control, basis, diagonal, found[m]):
                        visits = _VISITS
                        break
                if levels[size] < _LEVELS:
                    size = _halve(points[m], stack, boxes, levels, size, CLOSE * diagonal)
            if visits >= _VISITS:
                break
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _holds(low: Array, high: Array, point: Array) -> bool:
    return bool(np.all((low <= point) & (point <= high)))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _halve(point: Array, stack: Array, boxes: Array, levels: IntArray, top: int, margin: float) -> int:
    """Put those halves of the part at `top` in its place whose boxes hold the point; return the number of parts then.

    The part is halved in the direction in which its control points lie farthest apart (de Casteljau).
    """
    axis, widest = 0, -1.0
    for d in range(3):
        ahead, behind = _layer(stack[top], d, stack.shape[1 + d] - 1), _layer(stack[top], d, 0)
        width = _farthest(ahead, behind)
        if width > widest:
            axis, widest = d, width
    right = stack[top].copy()
    left = right.copy()
    n = right.shape[axis]
    for r in range(1, n):
        for j in range(n - r):
            _layer(right, axis, j)[:] = 0.5 * (_layer(right, axis, j) + _layer(right, axis, j + 1))
        _layer(left, axis, r)[:] = _layer(right, axis, 0)
    box, level, size = boxes[top].copy(), levels[top] + 1, top
    middle = 0.5 * (box[0, axis] + box[1, axis])
    for side in range(2):
        net = right if side else left
        low, high = np.empty(3), np.empty(3)
        for d in range(3):
            along = net[..., d] if net.shape[3] == 3 else net[..., d] / net[..., 3]
            low[d], high[d] = along.min() - margin, along.max() + margin
        if _holds(low, high, point):
            stack[size], boxes[size], levels[size] = net, box, level
            boxes[size, 1 - side, axis] = middle
            size += 1
    return size


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _farthest(one: Array, other: Array) -> float:
    """Return the largest difference of a coordinate of two layers (n, m, 3) of control points, or (n, m, 4)."""
    if one.shape[2] == 3:
        return float(np.abs(one - other).max())
    farthest = 0.0
    for d in range(3):
        farthest = max(farthest, np.abs(one[..., d] / one[..., 3] - other[..., d] / other[..., 3]).max())
    return farthest


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _layer(net: Array, axis: int, j: int) -> Array:
    """Return the control points of layer j along an axis, as a view."""
    if axis == 0:
        return net[j, :, :]
    if axis == 1:
        return net[:, j, :]
    return net[:, :, j]


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
    where, trial = begin.copy(), begin.copy()
    value, jacobian = np.empty(3), np.empty((3, 3))
    _evaluate(where, knots, degrees, control, basis, value, jacobian)
    rest = point - value
    off = np.sqrt((rest**2).sum())
    for _ in range(_STEPS):
        if off <= _EXACT * diagonal:
            break
        step = _solved(jacobian, rest)
        share, closer = 1.0, False
        for _ in range(_HALVINGS):
            for d in range(3):
                trial[d] = min(max(where[d] + share * step[d], 0.0), 1.0)
            _evaluate(trial, knots, degrees, control, basis, value, jacobian)
            now = np.sqrt(((point - value) ** 2).sum())
            closer = now < off
            if closer:
                break
            share *= 0.5
        if not closer:
            break
        where[:], off = trial, now
        rest = point - value
    if off > CLOSE * diagonal:
        return False
    found[:] = where
    return True


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _solved(matrix: Array, right: Array) -> Array:
    """Return the solution (3,) by Cramer's rule; zero for a singular matrix."""
    a, b, c = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    det = (a * bc).sum()
    solution = np.zeros(3)
    if det != 0.0:
        solution[0], solution[1], solution[2] = (right * bc).sum(), (right * ca).sum(), (right * ab).sum()
        solution /= det
    return solution


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
