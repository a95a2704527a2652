"""Penalises places of F's boundary whose normal does not agree with the normal of the mesh.

A boundary that runs back over itself may have det J > 0 everywhere: its middle part faces inwards, and the closest
points of the mesh cannot be one-to-one on it. The penalty demands (t_a x t_b) . n >= floor at the surface points, with
t_a and t_b the tangents of F along a block's face, measured in the lengths of the block's sides, and n the mesh's
normal (one-sided, unlike L_norm, section 4.4.1). Without it a conch ends 2.3 times as far from its surface, and a flat
hard surface 7 times.
"""

from dataclasses import dataclass

import numba
import numpy as np

from ..arrays import Array, Floats, IntArray
from ..cube.cube import axis_and_side, tangent_axes
from ..quality.rotations import dots
from ..threads import in_parallel
from .face_window import agreement, fill_tangents
from .operators import ControlRows, PiecewiseOperator, no_blocks, pieces
from .surface_distance import Correspondence
from .term import RoundWeights

_FLOOR = 0.1  # (t_a x t_b) . n below this is penalised; its mean over the boundary is near 1
_MARGIN = 3.0  # times that: points below may fall under it in the next step and are watched


@dataclass(frozen=True, eq=False)
class AlignmentPenalty:
    """Compute the sum of weight * (floor - (t_a x t_b) . n)_+^2 over k points.

    tangents: the rows that yield t_a and t_b at the points. normals: (3, k); a normal points out of the block where
    (a, b, outwards) is right-handed, and into it elsewhere. weights: (k,).
    """

    tangents: tuple[ControlRows, ControlRows]
    normals: Floats
    weights: Floats
    floor: float

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the penalties on folds in a round."""
        return weights.penalty

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the penalty at control points (3, n), and its gradient of the same shape."""
        by_a, by_b, size = self._slopes(control)
        shortfall = np.maximum(self.floor - size, 0.0)
        gradient = self._pull(-2.0 * self.weights * shortfall, by_a, by_b, control)
        return float(self.weights @ shortfall**2), gradient

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the Gauss-Newton part of the second derivative at `control`, as an operator in single precision."""
        along_a, along_b = (rows.in_single() for rows in self.tangents)
        normals, weights = self.normals.astype(np.float32), self.weights.astype(np.float32)
        single = AlignmentPenalty((along_a, along_b), normals, weights, self.floor)
        by_a, by_b, size = single._slopes(control.astype(np.float32))
        scale = 2.0 * single.weights * (size < self.floor)

        def product(x: Floats) -> Floats:
            a, b = (rows(x).T for rows in single.tangents)
            return single._pull(scale * (dots(by_a, a) + dots(by_b, b)), by_a, by_b, x)

        def diagonal(like: Floats) -> Floats:
            total = no_blocks(like)
            slopes = ((along_a, by_a), (along_b, by_b))
            for rows, slope in slopes:
                for others, other in slopes:
                    metric = scale[:, None, None] * slope.T[:, :, None] * other.T[:, None, :]
                    total += rows.diagonal(metric, like, others)
            return total

        return PiecewiseOperator([product], lambda parts, _: parts[0], diagonal)

    def _slopes(self, control: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the derivatives of (t_a x t_b) . n in t_a and in t_b, (3, k) each, and then its values, (k,)."""
        a, b = (rows(control).T for rows in self.tangents)
        by_a, by_b = np.cross(b, self.normals, axis=0), np.cross(self.normals, a, axis=0)
        return by_a, by_b, dots(a, by_a)

    def _pull(self, factor: Floats, by_a: Floats, by_b: Floats, like: Floats) -> Floats:
        along_a, along_b = self.tangents
        return along_a.adjoint((factor * by_a).T, like) + along_b.adjoint((factor * by_b).T, like)


def alignment_penalty(fit: Correspondence, control: Array, floor: float = _FLOOR) -> AlignmentPenalty:
    """Return the penalty at the points of the surface where (t_a x t_b) . n is near the floor at these control points.

    The penalty includes points that could fall below the floor in the next step.
    """
    sliding = fit.sliding
    window, field, sizes = sliding.window, np.ascontiguousarray(control.reshape(3, -1)), np.empty(len(fit.points))

    def part(rows: slice) -> None:
        here = sliding.cube_faces[rows], sliding.boxes
        _write_agreements(window.some(rows).arrays, field, fit.normals[rows], *here, sizes[rows])

    in_parallel(part, pieces(len(sizes)))
    low = np.flatnonzero(sizes < _MARGIN * floor)
    near, faces = window.some(low), sliding.cube_faces[low]
    axis, side = axis_and_side(faces)
    a, b = tangent_axes(axis)
    areas = sliding.boxes[faces // 6, a] * sliding.boxes[faces // 6, b]
    normals = np.where(side == 1, 1.0, -1.0)[:, None] * fit.normals[low] / areas[:, None]
    return AlignmentPenalty(
        (near.rows(1, 0), near.rows(0, 1)), np.ascontiguousarray(normals.T), fit.weights[low], floor
    )


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _write_agreements(
    window: tuple[IntArray, Array, Array],
    control: Array,
    normals: Array,
    cube_faces: IntArray,
    boxes: Array,
    sizes: Array,
) -> None:
    """Write (t_a x t_b) . n (N,) at the points of a FaceWindow, over the area of the point's face; boxes: sides."""
    places, in_a, in_b = window
    found = np.empty((1, 3, 3))
    for n in range(len(sizes)):
        block, axis = cube_faces[n] // 6, cube_faces[n] % 6 // 2
        area = boxes[block, (axis + 1) % 3] * boxes[block, (axis + 2) % 3]
        fill_tangents(places, in_a, in_b, control, n, found, 0)
        sizes[n] = agreement(found, 0, normals, n, cube_faces[n]) / area
