"""The boundary of a volume as Bezier patches that can be cut in four again and again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, IntArray
from ..cube.cube import VARYING_AXES, axis_and_side
from ..spline.bernstein import elevation, extraction, halving
from ..spline.bspline import breakpoints
from ..spline.volume import BSplineVolume

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of the six faces, all cut equally often: their edges are 2**-depth of a span's edges.

    axes: (n,) the parameter that is constant. low, high: (n, 3) corners in the cube, counted in edges of pieces.
    nets: (n, q + 1, q + 1, 3) Bezier control points, along the two other parameters in their order.
    """

    depth: int
    axes: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    nets: Array


def boundary_pieces(volume: BSplineVolume) -> Pieces:
    """All spans of the six faces, raised to the largest degree."""
    degree = max(volume.degrees)
    parts = [_face_pieces(volume, axis, side, degree) for axis, side in map(axis_and_side, range(6))]
    axes, low, nets = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    high = low.copy()
    np.put_along_axis(high, VARYING_AXES[axes], np.take_along_axis(low, VARYING_AXES[axes], axis=1) + 1, axis=1)
    return Pieces(0, axes, low, high, nets)


def _face_pieces(
    volume: BSplineVolume, axis: int, side: int, degree: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Constant axes (n,), low corners (n, 3) and nets (n, q + 1, q + 1, 3) of one face's spans."""
    net = volume.face(axis, side)  # (n_a, n_b, 3)
    a, b = VARYING_AXES[axis]
    for direction, position in ((a, 0), (b, 2)):  # (s_a, q + 1, n_b, 3), then (s_a, q + 1, s_b, q + 1, 3)
        own = volume.degrees[direction]
        first, weights = extraction(volume.knots[direction], own)
        local = np.take(net, first[:, None] + np.arange(own + 1), axis=position)
        local = np.moveaxis(local, (position, position + 1), (0, 1))
        local = np.einsum("ij,sjk,sk...->si...", elevation(own, degree), weights, local)
        net = np.moveaxis(local, (0, 1), (position, position + 1))
    counts = net.shape[0], net.shape[2]
    place = np.indices(counts).reshape(2, -1).T  # (n, 2)
    low = np.zeros((len(place), 3), dtype=np.int64)
    low[:, [a, b]] = place
    low[:, axis] = side * (len(breakpoints(volume.knots[axis])) - 1)
    nets = net.transpose(0, 2, 1, 3, 4).reshape(-1, degree + 1, degree + 1, 3)
    return np.full(len(place), axis, dtype=np.int64), low, nets


def halved(pieces: Pieces, pairs: IntArray) -> tuple[Pieces, IntArray]:
    """The pieces that are left as four each, and the pairs of those."""
    used, compact = np.unique(pairs, return_inverse=True)
    q = pieces.nets.shape[1] - 1
    halves = halving(q)
    nets = np.einsum("gij,hkl,njlc->nghikc", halves, halves, pieces.nets[used], optimize=True)
    axes = np.repeat(pieces.axes[used], 4)
    low = np.repeat(2 * pieces.low[used], 4, axis=0)
    tangents = VARYING_AXES[axes]
    corner = np.tile([[0, 0], [0, 1], [1, 0], [1, 1]], (len(used), 1))
    np.put_along_axis(low, tangents, np.take_along_axis(low, tangents, axis=1) + corner, axis=1)
    high = low.copy()
    np.put_along_axis(high, tangents, np.take_along_axis(low, tangents, axis=1) + 1, axis=1)
    finer = Pieces(pieces.depth + 1, axes, low, high, nets.reshape(-1, q + 1, q + 1, 3))
    compact = compact.reshape(-1, 2)
    alone = compact[:, 0] == compact[:, 1]
    return finer, np.concatenate(
        [
            _children(compact[alone], np.argwhere(np.tri(4, dtype=bool))),
            _children(compact[~alone], np.argwhere(np.ones((4, 4), dtype=bool))),
        ]
    )


def _children(pairs: IntArray, places: NDArray[np.int64]) -> IntArray:
    """Pairs (k, 2) of pieces, and which of the four of each: (k * len(places), 2)."""
    return (4 * pairs[:, None] + places).reshape(-1, 2)


def contact(pieces: Pieces, first: NDArray[np.int64], second: NDArray[np.int64]) -> tuple[Mask, NDArray[np.int64]]:
    """Whether pieces touch in the cube, and the dimension of what they share."""
    low = np.maximum(pieces.low[first], pieces.low[second])
    high = np.minimum(pieces.high[first], pieces.high[second])
    return np.all(low <= high, axis=1), np.sum(low < high, axis=1)


def as_rows(nets: Array) -> Array:
    """(n, i, j, 3) -> (n, i * j, 3)."""
    return nets.reshape(len(nets), nets.shape[1] * nets.shape[2], 3)
