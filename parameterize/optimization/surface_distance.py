"""Measures how close the boundary of F is to the surface: residuals at surface points whose parameters slide.

Each surface point v has a parameter p on the boundary. The energy is a weighted sum of r^T (Q + t I) r, with r =
F(p) - v and Q the mean of n n^T over the triangles around v: on smooth parts this measures the distance along the
normal only, on sharp edges across both sides, and at corners in all directions.
"""

import numpy as np

from ..arrays import Array, Mask
from ..spline.spline_map import ControlNets
from ..surface.geometry import vertex_normals
from .operators import PiecewiseOperator
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
        residual = self.sliding.rows(control) - self.points  # (N, 3)
        pulled = np.einsum("nij,nj->ni", self._metric, residual)
        return float(np.vdot(residual, pulled)), 2.0 * self.sliding.rows.adjoint(pulled, control)

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the second derivative of the energy for fixed parameters, as an operator in single precision."""
        return self.sliding.rows.in_single().squared(2.0 * self._metric.astype(np.float32))

    def residuals(self, control: Array) -> Array:
        """Return the residuals F(p) - v, (N, 3)."""
        return self.sliding.values(control) - self.points

    def mean_square(self, control: Array) -> float:
        """Return the mean of |F(p) - v|^2 at the present parameters."""
        return float(np.square(self.residuals(control)).sum(axis=1).mean())
