"""Measures how close the boundary of F is to the surface: residuals at surface points whose parameters slide.

Each surface point v has a parameter p on the boundary. The energy is a weighted sum of r^T (Q + t I) r, with r =
F(p) - v and Q the mean of n n^T over the triangles around v: on smooth parts this measures the distance along the
normal only, on sharp edges across both sides, and at corners in all directions.
"""

import numba
import numpy as np

from ..arrays import Array, IntArray, Mask
from ..spline.spline_map import ControlNets
from ..surface.geometry import vertex_normals
from ..threads import in_parallel
from .operators import PiecewiseOperator, pieces
from .sliding import SlidingParameters
from .term import RoundWeights

TANGENTIAL = 2e-4  # share of the distance within the tangent plane: holds sliding points, and hardly draws F


class Correspondence:
    """Compute the residuals F(p) - v and their energy.

    sliding: the parameters p. points: (N, 3), the surface points v at volume 1. quadrics: (N, 3, 3). weights: (N,),
    with sum 1. given_corners: (8, 3), the places that the user gives for the corners of the cube; anchors.py holds F
    there.
    """

    def __init__(
        self,
        sliding: SlidingParameters,
        points: Array,
        quadrics: Array,
        weights: Array,
        *,
        given_corners: Array | None = None,
    ) -> None:
        self.sliding, self.given_corners = sliding, given_corners
        self.normals = vertex_normals(points, sliding.triangles)
        self._weights = weights
        self.relaxation = np.ones(len(points))
        self._held = np.zeros(len(points), dtype=bool)
        self.set_goals(points, quadrics)

    def on_nets(self, nets: ControlNets) -> "Correspondence":
        """Return the same data for blocks with other knots, at the present parameters and weights."""
        sliding, given = self.sliding.on_nets(nets), self.given_corners
        other = Correspondence(sliding, self.points, self._quadrics, self._weights, given_corners=given)
        other.relax(self.relaxation)
        return other

    def set_goals(self, points: Array, quadrics: Array) -> None:
        """Set other points (N, 3) and quadrics (N, 3, 3) as goals."""
        self.points, self._quadrics = points, quadrics
        self.relax(self.relaxation)

    def relax(self, relaxation: Array) -> None:
        """Multiply the points' weights by `relaxation` (N,), which replaces the factors of an earlier call."""
        self.relaxation = relaxation
        self.weights = relaxation * self._weights
        quadrics = np.where(self._held[:, None, None], np.eye(3), self._quadrics)
        self._metric = self.weights[:, None, None] * quadrics

    def hold(self, held: Mask) -> None:
        """Measure the distance of held points (N,) in all directions, of the other points as their quadrics demand."""
        self._held = held
        self.relax(self.relaxation)

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the surface's data."""
        return weights.surface

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the sum of r^T Q r at the present parameters and its gradient (3, n)."""
        window, field = self.sliding.window, np.ascontiguousarray(control.reshape(3, -1))

        def part(rows: slice) -> tuple[float, Array]:
            return _pulled(window.some(rows).arrays, field, self.points[rows], self._metric[rows])

        energies, pulled = zip(*in_parallel(part, pieces(len(self.points))), strict=True)
        return sum(energies), sum(pulled[1:], start=pulled[0]).reshape(control.shape)

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the second derivative of the energy for fixed parameters, as an operator in single precision."""
        return self.sliding.window.rows(0, 0, np.float32).squared(2.0 * self._metric.astype(np.float32))

    def residuals(self, control: Array) -> Array:
        """Return the residuals F(p) - v, (N, 3)."""
        return self.sliding.values(control) - self.points

    def mean_square(self, control: Array) -> float:
        """Return the mean of |F(p) - v|^2 at the present parameters."""
        return float(np.square(self.residuals(control)).sum(axis=1).mean())


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _pulled(window: tuple[IntArray, Array, Array], control: Array, points: Array, metric: Array) -> tuple[float, Array]:
    """Return the sum of r^T Q r over the points of a FaceWindow, and its gradient, for control points (3, n).

    points: (N, 3). metric: the matrices Q (N, 3, 3).
    """
    (places, in_a, in_b), gradient, energy = window, np.zeros_like(control), 0.0
    width = in_a.shape[2]
    residual = np.empty(3)
    for n in range(len(points)):
        for c in range(3):
            residual[c] = -points[n, c]
            for i in range(width):
                value, column = 0.0, places[n, 0] + i * places[n, 1]
                for j in range(width):
                    value += in_b[n, 0, j] * control[c, column]
                    column += places[n, 2]
                residual[c] += in_a[n, 0, i] * value
        for c in range(3):
            pull = metric[n, c, 0] * residual[0] + metric[n, c, 1] * residual[1] + metric[n, c, 2] * residual[2]
            energy += residual[c] * pull
            for i in range(width):
                share, column = 2.0 * in_a[n, 0, i] * pull, places[n, 0] + i * places[n, 1]
                for j in range(width):
                    gradient[c, column] += share * in_b[n, 0, j]
                    column += places[n, 2]
    return energy, gradient
