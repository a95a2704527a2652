"""The boundary of a volume as Bezier patches that can be cut in four again and again."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..cube.cube import VARYING_AXES, axis_and_side
from ..spline.bernstein import elevation, extraction, halving
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of the six faces, all cut equally often: their edges are 2**-depth of a span's edges.

    axes: (n,) the parameter that is constant. low: (n, 3) the lower corner in the cube, counted in edges of pieces.
    nets: (n, q + 1, q + 1, 3) Bezier control points, along the two other parameters in their order.
    """

    depth: int
    axes: IntArray
    low: IntArray
    nets: Array

    @property
    def high(self) -> IntArray:
        """Return the upper corners in the cube (n, 3), one edge of a piece away along the two other parameters."""
        return self.low + (np.arange(3) != self.axes[:, None])


def boundary_pieces(volume: BSplineVolume) -> Pieces:
    """Return all spans of the six faces, raised to the largest degree."""
    degree = max(volume.degrees)
    parts = [_face_pieces(volume, axis, side, degree) for axis, side in map(axis_and_side, range(6))]
    return Pieces(0, *(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _face_pieces(volume: BSplineVolume, axis: int, side: int, degree: int) -> tuple[IntArray, IntArray, Array]:
    """Return constant axes (n,), low corners (n, 3) and nets (n, q + 1, q + 1, 3) of one face's spans."""
    net = volume.face(axis, side)  # (n_a, n_b, 3)
    a, b = VARYING_AXES[axis]
    for direction, position in ((a, 0), (b, 2)):  # (s_a, q + 1, n_b, 3), then (s_a, q + 1, s_b, q + 1, 3)
        own = volume.degrees[direction]
        first, weights = extraction(volume.knots[direction], own)
        local = np.take(net, first[:, None] + np.arange(own + 1), axis=position)
        local = np.moveaxis(local, (position, position + 1), (0, 1))
        local = np.einsum("ij,sjk,sk...->si...", elevation(own, degree), weights, local)
        net = np.moveaxis(local, (0, 1), (position, position + 1))
    place = np.indices(net.shape[0:3:2]).reshape(2, -1).T  # (n, 2)
    low = np.full((len(place), 3), side * (len(breakpoints(volume.knots[axis])) - 1))
    low[:, [a, b]] = place
    nets = net.transpose(0, 2, 1, 3, 4).reshape(-1, degree + 1, degree + 1, 3)
    return np.full(len(place), axis), low, nets


def halved(pieces: Pieces, pairs: IntArray) -> tuple[Pieces, IntArray]:
    """Return the pieces that the pairs (k, 2) name, as four each, and the pairs of those."""
    used, compact = np.unique(pairs, return_inverse=True)
    q = pieces.nets.shape[1] - 1
    halves = halving(q)
    nets = np.einsum("gij,hkl,njlc->nghikc", halves, halves, pieces.nets[used], optimize=True)
    axes = np.repeat(pieces.axes[used], 4)
    low = np.repeat(2 * pieces.low[used], 4, axis=0)
    low[np.arange(len(low))[:, None], VARYING_AXES[axes]] += np.tile(list(np.ndindex(2, 2)), (len(used), 1))
    finer = Pieces(pieces.depth + 1, axes, low, nets.reshape(-1, q + 1, q + 1, 3))
    four = 4 * compact.reshape(-1, 1, 2)
    alone = four[:, 0, 0] == four[:, 0, 1]
    own, others = np.argwhere(np.tri(4, dtype=bool)), np.argwhere(np.ones((4, 4), dtype=bool))
    return finer, np.concatenate([(four[alone] + own).reshape(-1, 2), (four[~alone] + others).reshape(-1, 2)])


def contact(pieces: Pieces, first: IntArray, second: IntArray) -> tuple[Mask, IntArray]:
    """Return whether pieces touch in the cube, and the dimension of what they share."""
    low = np.maximum(pieces.low[first], pieces.low[second])
    high = np.minimum(pieces.high[first], pieces.high[second])
    return np.all(low <= high, axis=1), np.sum(low < high, axis=1)


def as_rows(nets: Array) -> Array:
    """Return nets (n, i, j, 3) as rows of points (n, i * j, 3)."""
    return nets.reshape(len(nets), nets.shape[1] * nets.shape[2], 3)
