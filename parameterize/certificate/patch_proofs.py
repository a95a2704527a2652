"""The outer boundary of a body as Bezier pieces, and three proofs that two of them meet only where they are joined.

- Pieces without a common point: a plane keeps their control points apart.
- Pieces with a common corner: a plane through the corner, with all other control points strictly beside it.
- Pieces with a common edge, unfolded into a rectangle, and a piece by itself: projected to a plane the derivative has
  a positive definite symmetric part, so that <x - y, F(x) - F(y)> > 0 on a convex domain.

A control net bounds its piece, and its differences bound the derivatives, so each proof looks at finitely many numbers,
with room for their rounding errors. With positive weights a control net bounds its piece, too; what bounds the
derivatives of a rational piece is in `_rational_differences`. Pieces may also be joined through interfaces of patches
(gluing.py).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numba
import numpy as np

from ..arrays import Array, IntArray, Mask
from ..cube.cube import VARYING_AXES
from ..spline.bernstein import elevation, extraction, halving
from ..spline.body import Body
from ..spline.bspline import breakpoints
from ..spline.interface import face_layer
from ..spline.patch_groups import PatchGroup
from ..spline.rational import projected
from ..spline.volume import FACE_NAMES
from .gluing import SharedPoints

_CHUNK = 4096  # pairs at a time
_NEWTON_STEPS = 40  # towards a separating plane
_REACH = 2.0  # largest change of a product in a step
_MARGIN = 0.5  # least product at which the search ends
_LIFT = 1e-14  # of the shares' sum, onto a Hessian's diagonal: the vectors may all lie in one plane

# A piece has two directions, those of its face that vary. Its places in them, counted in halves of its edges:
_CORNERS = [(0, 0), (0, 2), (2, 0), (2, 2)]
_MIDDLES = [(0, 1), (2, 1), (1, 0), (1, 2)]  # of its edges: two along the second direction, two along the first
_ENDS = np.array([[0, 1], [2, 3], [0, 2], [1, 3]])  # the corners at which these edges begin and end
_STEPS = np.zeros((3, 8, 3), dtype=np.int64)  # the eight places, for each constant parameter
for _axis, _varying in enumerate(VARYING_AXES):
    _STEPS[_axis][:, _varying] = _CORNERS + _MIDDLES


class PointNames(Protocol):
    """Gives points on the faces that pieces are parts of names, see `SharedPoints`."""

    def names(self, patches: IntArray, axes: IntArray, positions: IntArray, steps: int) -> IntArray:
        """Return the names (n, m, 3) of points of faces; different points have different ones."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of the outer faces of patches, all cut equally often: their edges are 2**-depth of a span's edges.

    patches: (n,) the number of the patch. axes: (n,) the parameter that is constant. low: (n, 3) the lower corner in
    the cube, counted in edges of pieces. nets: (n, q + 1, q + 1, 3) Bezier control points, along the two other
    parameters in their order; homogeneous, (.., 4), where a patch of the body is rational.
    """

    depth: int
    shared: PointNames
    patches: IntArray
    axes: IntArray
    low: IntArray
    nets: Array

    @property
    def high(self) -> IntArray:
        """Return the upper corners in the cube (n, 3), one edge of a piece away along the two other parameters."""
        return self.low + (np.arange(3) != self.axes[:, None])

    @cached_property
    def names(self) -> IntArray:
        """Return the names (n, 8, 3) of the four corners and of the middles of the four edges."""
        positions = 2 * self.low[:, None] + _STEPS[self.axes]
        return self.shared.names(self.patches, self.axes, positions, 2 ** (self.depth + 1))


def boundary_pieces(body: Body) -> Pieces:
    """Return all spans of the faces that are not glued, raised to the largest degree."""
    degree = max(max(group.degrees) for group in body.groups)
    components = 4 if any(group.weights is not None for group in body.groups) else 3
    parts = [
        _face_pieces(group, np.flatnonzero(~body.glued[group.numbers, face]), face, degree, components)
        for group in body.groups
        for face in range(len(FACE_NAMES))
    ]
    faces, low, nets = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    order = np.argsort(faces, kind="stable")
    patches, face = np.divmod(faces[order], len(FACE_NAMES))
    return Pieces(0, SharedPoints(body), patches, face // 2, low[order], nets[order])


def _face_pieces(
    group: PatchGroup, members: IntArray, face: int, degree: int, components: int
) -> tuple[IntArray, IntArray, Array]:
    """Return numbers 6 * patch + face (n,), low corners (n, 3) and nets (n, q + 1, q + 1, c) of the spans of faces.

    members: (m,) the patches of the group whose face it is. components: 4 for homogeneous control points.
    """
    axis, side = divmod(face, 2)
    control = group.coefficients if components == 3 else group.homogeneous
    net = face_layer(np.moveaxis(control, 0, 3), FACE_NAMES[face])[:, :, members]  # (n_a, n_b, m, c)
    a, b = VARYING_AXES[axis]
    for direction, position in ((a, 0), (b, 2)):  # (s_a, q + 1, n_b, m, c), then (s_a, q + 1, s_b, q + 1, m, c)
        own = group.degrees[direction]
        first, weights = extraction(group.knots[direction], own)
        local = np.take(net, first[:, None] + np.arange(own + 1), axis=position)
        local = np.moveaxis(local, (position, position + 1), (0, 1))
        local = np.einsum("ij,sjk,sk...->si...", elevation(own, degree), weights, local)
        net = np.moveaxis(local, (0, 1), (position, position + 1))
    place = np.indices(net.shape[0:3:2]).reshape(2, -1).T  # (spans, 2)
    low = np.full((len(place), 3), side * (len(breakpoints(group.knots[axis])) - 1))
    low[:, [a, b]] = place
    nets = net.transpose(4, 0, 2, 1, 3, 5).reshape(-1, degree + 1, degree + 1, components)
    faces = np.repeat(len(FACE_NAMES) * group.numbers[members] + face, len(place))
    return faces, np.tile(low, (len(members), 1)), nets


def halved(pieces: Pieces, pairs: IntArray) -> tuple[Pieces, IntArray]:
    """Return the pieces of the pairs (k, 2), each cut in four, and all pairs of the parts."""
    used, compact = np.unique(pairs, return_inverse=True)
    q = pieces.nets.shape[1] - 1
    halves = halving(q)
    nets = np.einsum("gij,hkl,njlc->nghikc", halves, halves, pieces.nets[used], optimize=True)
    patches, axes = np.repeat(pieces.patches[used], 4), np.repeat(pieces.axes[used], 4)
    low = np.repeat(2 * pieces.low[used], 4, axis=0)
    low[np.arange(len(low))[:, None], VARYING_AXES[axes]] += np.tile(list(np.ndindex(2, 2)), (len(used), 1))
    finer = Pieces(pieces.depth + 1, pieces.shared, patches, axes, low, nets.reshape(-1, *pieces.nets.shape[1:]))
    four = 4 * compact.reshape(-1, 1, 2)
    alone = four[:, 0, 0] == four[:, 0, 1]
    own, others = np.argwhere(np.tri(4, dtype=bool)), np.argwhere(np.ones((4, 4), dtype=bool))
    return finer, np.concatenate([(four[alone] + own).reshape(-1, 2), (four[~alone] + others).reshape(-1, 2)])


def contact(pieces: Pieces, first: IntArray, second: IntArray) -> IntArray:
    """Return what pairs have in common (k,): nothing (-1), a corner (0), an edge (1) or all (2).

    Pieces around a short hole may have several edges in common: a proof for one of them fails, and succeeds on parts.
    """
    (corners, _), (edges, _) = _joints(pieces.names, first, second)
    return np.where(first == second, 2, np.where(edges > 0, 1, np.where(corners > 0, 0, -1)))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _joints(names: IntArray, first: IntArray, second: IntArray) -> IntArray:
    """Return how many corners of pairs are one, and a place 4 i + j of such: corner i and corner j; the same of edges.

    names: (n, 8, 3) of all pieces. The result is (2, 2, k): corners and edges, number and place.
    """
    found = np.zeros((2, 2, len(first)), dtype=np.int64)
    for k in range(len(first)):
        a, b = names[first[k]], names[second[k]]
        for kind in range(2):
            for i in range(4):
                for j in range(4):
                    p, q = a[4 * kind + i], b[4 * kind + j]
                    if p[0] == q[0] and p[1] == q[1] and p[2] == q[2]:
                        found[kind, 0, k] += 1
                        found[kind, 1, k] = 4 * i + j
    return found


def as_rows(nets: Array) -> Array:
    """Return nets (n, i, j, 3), or homogeneous ones (n, i, j, 4), as rows of points (n, i * j, 3)."""
    points = projected(nets)[0] if nets.shape[3] == 4 else nets
    return points.reshape(len(nets), nets.shape[1] * nets.shape[2], 3)


def is_proved(pieces: Pieces, pairs: IntArray, error: float) -> Mask:
    """Return the mask (k,) of the pairs (k, 2) that are proved to meet only where they are joined."""
    done = np.zeros(len(pairs), dtype=bool)
    for start in range(0, len(pairs), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        first, second = pairs[chunk].T
        common = contact(pieces, first, second)
        for kind, proof in enumerate((_corner_proof, _edge_proof, _own_proof)):
            rows = np.flatnonzero(common == kind)
            done[start + rows] = proof(pieces, first[rows], second[rows], error)
        rows = np.flatnonzero(common < 0)
        a, b = (as_rows(pieces.nets[part[rows]]) for part in (first, second))
        done[start + rows] = _apart(a, b, error)
    return done


def _own_proof(pieces: Pieces, piece: IntArray, _: IntArray, error: float) -> Mask:
    nets = pieces.nets[piece]
    return _monotone(_differences(nets, 1), _differences(nets, 2), error, error)


def _edge_proof(pieces: Pieces, first: IntArray, second: IntArray, error: float) -> Mask:
    """Return the mask of pairs with a common edge that are monotone together, unfolded into a rectangle."""
    nets = _unfolded(pieces, first, second)
    by_edge = np.concatenate([_differences(net, 2) for net in nets], axis=1)
    # Each side may have a parameter of its own, the unfolded pair stays a rectangle: with equal widths the mean over
    # both sides points out of the solid where the edge is as sharp as a knife's.
    sides = [_differences(net, 1) for net in nets]
    widths = np.stack([_width(side.mean(axis=1), by_edge.mean(axis=1)) for side in sides], axis=1)  # (n, 2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = np.concatenate([side / widths[:, i, None, None] for i, side in enumerate(sides)], axis=1)
        return _monotone(across, by_edge, error / widths.min(axis=1), error)


def _width(vectors: Array, directions: Array) -> Array:
    """Return the lengths (n,) of the components of vectors (n, 3) across directions (n, 3)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(np.cross(vectors, directions), axis=1) / np.linalg.norm(directions, axis=1))


def _unfolded(pieces: Pieces, first: IntArray, second: IntArray) -> tuple[Array, Array]:
    """Return nets whose axis 1 leads from the first over the common edge into the second, and axis 2 along the edge."""
    edge, other = divmod(_joints(pieces.names, first, second)[1, 1], 4)
    before = _turned(pieces.nets[first], edge, edge_last=True)
    behind = _turned(pieces.nets[second], other, edge_last=False)
    alike = np.all(pieces.names[first, _ENDS[edge, 0]] == pieces.names[second, _ENDS[other, 0]], axis=1)
    return before, np.where(alike[:, None, None, None], behind, behind[:, :, ::-1])


def _turned(nets: Array, edges: IntArray, edge_last: bool) -> Array:
    """Return nets whose axis 2 runs along the shared edge, and which have it last, or first, on axis 1."""
    nets = np.where((edges > 1)[:, None, None, None], nets.swapaxes(1, 2), nets)
    return np.where((edges % 2 == edge_last)[:, None, None, None], nets, nets[:, ::-1])


def _corner_proof(pieces: Pieces, first: IntArray, second: IntArray, error: float) -> Mask:
    """Return where all vectors to the corner, and from it into the second piece, have a common direction."""
    corner, other = divmod(_joints(pieces.names, first, second)[0, 1], 4)
    before, behind = _corner_last(pieces.nets[first], corner), _corner_last(pieces.nets[second], other)
    vectors = np.concatenate([before[:, -1:] - before[:, :-1], behind[:, :-1] - behind[:, -1:]], axis=1)
    normal = _half_space(vectors)
    proved: Mask = _along(vectors, normal).min(axis=1) > 4.0 * error * np.abs(normal).sum(axis=1)
    return proved


def _corner_last(nets: Array, corners: IntArray) -> Array:
    """Return control points (n, (q + 1)^2, 3), the one at the shared corner last."""
    nets = np.where((corners > 1)[:, None, None, None], nets, nets[:, ::-1])
    nets = np.where((corners % 2 == 1)[:, None, None, None], nets, nets[:, :, ::-1])
    return as_rows(nets)


def _differences(nets: Array, axis: int) -> Array:
    """Return control vectors (n, k, 3) of the derivative, up to the degree as a factor."""
    if nets.shape[3] == 4:
        return _rational_differences(np.moveaxis(nets, axis, 1))
    return as_rows(np.diff(nets, axis=axis))


def _rational_differences(nets: Array) -> Array:
    """Return vectors (n, k, 3) whose convex hull holds the derivative of F times a positive number at each point.

    nets: homogeneous, (n, i, j, 4); the derivative is that along i. Of F = A / W, W^2 F_s = A_s W - A W_s is, up to the
    degree as a factor, the sum over all i, j, k, l of B_ij C_kl, positive polynomials that sum to 1, times
    w_(i+1)j w_kl (P_(i+1)j - P_kl) - w_ij w_kl (P_ij - P_kl). The number is the same for both derivatives, so that a
    positive definite symmetric part stays one. Weights are scaled: the largest of each net is 1.
    """
    points, weights = projected(nets)
    weights = weights / weights.max(axis=(1, 2), keepdims=True)
    ahead, behind = (
        (weights[:, part, :, None, None] * weights[:, None, None])[..., None]
        * (points[:, part, :, None, None] - points[:, None, None])
        for part in (slice(1, None), slice(None, -1))
    )  # (n, q, q + 1, q + 1, q + 1, 3)
    return np.asarray(ahead - behind).reshape(len(nets), int(np.prod(ahead.shape[1:5])), 3)


def _monotone(across: Array, along: Array, across_error: Array | float, along_error: float) -> Mask:
    """Return whether a plane with coordinates is found in which [F_s F_t] has a positive definite symmetric part: (n,).

    across, along (n, k, 3): vectors whose convex hulls hold F_s and F_t. The coordinates are those in which their means
    are the unit vectors. The entries then lie in [[>= a, <= d], [<= c, >= b]] in magnitude, and with a, b > 0 and
    a b > c d, one coordinate, in the domain and in the plane, can be scaled so that the symmetric part is definite.
    The errors are those of the control points that the vectors are differences of.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        dual_s, dual_t = _dual_basis(across.mean(axis=1), along.mean(axis=1))
        a, c = _entry_bounds(across, dual_s, dual_t, across_error)
        b, d = _entry_bounds(along, dual_t, dual_s, along_error)
    proved: Mask = (a > 0.0) & (b > 0.0) & (a * b > 1.0001 * c * d)
    return proved


def _dual_basis(s: Array, t: Array) -> tuple[Array, Array]:
    """Return the vectors (n, 3) in the plane of s and t whose products with s and t are 1, 0 and 0, 1."""
    ss, st, tt = (np.sum(a * b, axis=1, keepdims=True) for a, b in ((s, s), (s, t), (t, t)))
    return (tt * s - st * t) / (ss * tt - st**2), (ss * t - st * s) / (ss * tt - st**2)


def _entry_bounds(vectors: Array, own: Array, other: Array, error: Array | float) -> tuple[Array, Array]:
    """Return the least product of vectors (n, k, 3) with `own`, and the largest with `other` in magnitude: (n,)."""
    slack_own, slack_other = (8.0 * np.abs(dual).sum(axis=1) for dual in (own, other))
    least = _along(vectors, own).min(axis=1) - error * slack_own
    return least, np.abs(_along(vectors, other)).max(axis=1) + error * slack_other


def _along(vectors: Array, direction: Array) -> Array:
    """Return the products (n, k) of vectors (n, k, 3) with a direction (n, 3) each."""
    return np.asarray(np.einsum("nkc,nc->nk", vectors, direction))


def _apart(a: Array, b: Array, error: float) -> Mask:
    """Return whether a plane is found with the points a (n, k, 3) on one side and b (n, l, 3) on the other: (n,).

    With a fourth coordinate, and all of a negated, that is a half-space through the origin.
    """
    middle = a.mean(axis=1, keepdims=True)
    places = np.concatenate([middle - a, b - middle], axis=1)
    size = np.abs(b - middle).max(axis=(1, 2))[:, None]
    last = np.where(np.arange(places.shape[1]) < a.shape[1], size, -size)
    normal = _half_space(np.concatenate([places, last[..., None]], axis=2))[:, :3]
    gap = _along(b, normal).min(axis=1) - _along(a, normal).max(axis=1)
    proved: Mask = gap > 4.0 * error * np.abs(normal).sum(axis=1)
    return proved


def _half_space(vectors: Array) -> Array:
    """Return x (n, d) with positive products x . v with all vectors v (n, k, d), where such x is found.

    Newton's method minimises the sum of exp(-x . v / |v|), however thin the cone of such x is.
    """
    lengths = np.linalg.norm(vectors, axis=2, keepdims=True)
    units = vectors / np.maximum(lengths, np.finfo(np.float64).tiny)
    x = np.zeros((len(vectors), vectors.shape[2]))
    active = np.arange(len(vectors))
    for _ in range(_NEWTON_STEPS):
        v = units[active]
        share = np.exp(-_along(v, x[active]))
        curvature = np.einsum("nk,nkc,nkd->ncd", share, v, v, optimize=True)
        lift = _LIFT * np.maximum(share.sum(axis=1), 1.0)
        curvature += lift[:, None, None] * np.eye(v.shape[2])
        step = np.linalg.solve(curvature, np.einsum("nk,nkc->nc", share, v)[..., None])[..., 0]
        x[active] += step / np.maximum(1.0, np.abs(_along(v, step)).max(axis=1) / _REACH)[:, None]
        active = active[_along(v, x[active]).min(axis=1) < _MARGIN]
        if not active.size:
            break
    return x
