"""Points on the 12 edges of the cube that draw F towards the surface.

No vertex of the mesh need have its parameter there, and F, which keeps a small crease along those edges, could stick
out unseen, most of all at the eight corners, and blow up the elements there. They are for a map that is nearly there:
on a rough one the nearest points are those of another part of the surface, and it would be held there. Corners that the
user gives are held until the map is certified; in the last rounds they may move a little: held to the end, the boundary
crosses itself beside them.
"""

import numpy as np

from ..arrays import Array, Knots
from ..cube.cube import CORNERS, EDGES
from ..spline.bspline import divided_spans
from ..surface.nearest import nearest_on_mesh
from .operators import PiecewiseOperator
from .sliding import SlidingParameters
from .surface_distance import TANGENTIAL, SurfaceFit
from .term import RoundWeights

_A_SPAN = 2
_WEIGHT = 0.03  # share of the surface's weight: the data of the surface decide, the anchors hold what these leave open
_NEAR = 0.5  # share of a span's length: anchors closer to the surface than this count as near
_NEAR_SHARE = 0.99  # of the anchors: with fewer of them near, they would hold F at another part of the surface
_GIVEN_CORNER = 0.5  # weight, in all directions, of a corner that the user gives


def edge_points(knots: Knots) -> Array:
    """Return the corners of the cube, and the ends and middles of the spans along its edges: (k, 3)."""
    points = []
    for i, j in EDGES:
        direction = CORNERS[j] - CORNERS[i]
        along = divided_spans(knots[int(direction.argmax())], _A_SPAN)
        points.append(CORNERS[i] + along[:, None] * direction)
    return np.unique(np.concatenate(points), axis=0)


class EdgeAnchors:
    """The anchors as a SurfaceFit whose parameters stay; they pull on nothing until they are aimed."""

    def __init__(self, surface: SurfaceFit) -> None:
        self._surface = surface
        knots, degree = surface.places.knots, surface.places.degree
        points = edge_points(knots)
        places = SlidingParameters(knots, degree, points)
        self.fit = SurfaceFit(places, points, np.zeros((len(points), 3, 3)), np.full(len(points), 1.0 / len(points)))

    def weight(self, weights: RoundWeights) -> float:
        """Return a share of the weight of the surface's data."""
        return _WEIGHT * weights.surface

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the mean squared distance at control points (3, n_u, n_v, n_w), and its gradient."""
        return self.fit.energy_and_gradient(control)

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the second derivative as an operator in single precision."""
        return self.fit.curvature(control)

    def near(self, control: Array) -> bool:
        """Return whether F is so close to the surface along all edges that the nearest points are the right ones."""
        here, points, _ = self._nearest(control)
        longest = _NEAR / (min(control.shape[1:]) - self.fit.places.degree)
        return float((np.linalg.norm(points - here, axis=1) < longest).mean()) >= _NEAR_SHARE

    def aim(self, control: Array, *, hold: bool) -> None:
        """Take the points of the surface nearest to F as it is, each with the normal of its triangle.

        hold: leave given corners at their places.
        """
        _, points, normals = self._nearest(control)
        quadrics = normals[:, :, None] * normals[:, None, :] + TANGENTIAL * np.eye(3)
        if hold:
            self._hold(points, quadrics)
        self.fit.aim(points, quadrics)

    def release(self) -> None:
        """Pull on nothing but given corners until they are aimed again."""
        points, quadrics = self.fit.points.copy(), np.zeros((len(self.fit.points), 3, 3))
        self._hold(points, quadrics)
        self.fit.aim(points, quadrics)

    def _hold(self, points: Array, quadrics: Array) -> None:
        """Put given corners in place of those."""
        if (given := self._surface.given_corners) is not None:
            corner = np.isin(self.fit.places.parameters, (0.0, 1.0)).all(axis=1)  # in the order of the given ones
            points[corner], quadrics[corner] = given, _GIVEN_CORNER * np.eye(3)

    def restore(self, points: Array, yielding: Array) -> None:
        """Take the state of a checkpoint: the next distances then round as they would have without the interruption."""
        self.fit.aim(points, np.zeros((len(points), 3, 3)))
        self.fit.give_way(yielding)

    def _nearest(self, control: Array) -> tuple[Array, Array, Array]:
        """Return F at the anchors, the points of the surface nearest to it and the normals there: (k, 3) each."""
        here = self.fit.residuals(control) + self.fit.points
        return here, *nearest_on_mesh(here, self._surface.points, self._surface.places.triangles)
