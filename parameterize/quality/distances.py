"""Distances of points to the boundary of a body of trivariate splines, and their rms, mean and maximum."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from ..cube.cube import axis_and_side, damped_fit, tangent_axes
from ..spline.body import BodyLike, as_body
from ..spline.sampled_boundary import SampledBoundary
from ..spline.volume import BSplineVolume
from ..surface.nearest import closest_triangles

_NEWTON_STEPS = 5
_DAMPING = 1e-12  # tangents may be parallel at an edge of the cube
_CONVERGED = 1e-3  # a step that gains less than this share of the distance is the last


@dataclass(frozen=True)
class Distances:
    """Root mean square, mean and maximum of distances, in one unit."""

    rms: float
    mean: float
    max: float

    @classmethod
    def of(cls, values: Array, shares: Array | None = None) -> "Distances":
        """Summarise distances (m,) with shares (m,) that sum to 1, by default all the same.

        Raises ValueError when there are none.
        """
        if values.size == 0:
            raise ValueError("there are no distances to summarise: the list of points is empty")
        mean_square, mean = np.average(values**2, weights=shares), np.average(values, weights=shares)
        return cls(float(np.sqrt(mean_square)), float(mean), float(np.max(values)))

    def scaled(self, scale: float) -> "Distances":
        """Return the same distances in another unit of length."""
        return Distances(scale * self.rms, scale * self.mean, scale * self.max)


def nearest_on_boundary(points: Array, body: BodyLike, boundary: SampledBoundary) -> tuple[IntArray, Array, Array]:
    """Return the points of a body's outer boundary that are nearest to points (m, 3): patches, parameters, distances.

    patches (m,), all 0 for a volume; parameters (m, 3), on an outer face of that patch; distances (m,).

    The nearest point of the sampled triangles gives a face and parameters on it; Gauss-Newton steps in that face
    then lower the distance to the spline itself. It is the distance of a point on the spline's boundary, so never less
    than the true one.
    """
    _, triangle, weights = closest_triangles(points, boundary.points, boundary.triangles)
    corners = boundary.triangles[triangle]  # (m, 3)
    where = np.clip(
        np.einsum("mk,mka->ma", weights, boundary.parameters[corners]), 0.0, 1.0
    )  # weights sum to 1 roughly
    axis, _ = axis_and_side(boundary.cube_faces[triangle])
    every = np.arange(len(points))
    where[every, axis] = boundary.parameters[corners[:, 0], axis]
    patches, distances = boundary.patches[corners[:, 0]], np.empty(len(points))
    for number, patch in enumerate(as_body(body)):
        own = np.flatnonzero(patches == number)
        if not own.size:
            continue
        where[own], distances[own] = closest_in_faces(points[own], patch, where[own], axis[own])
    return patches, where, distances


def closest_in_faces(points: Array, volume: BSplineVolume, start: Array, axis: IntArray) -> tuple[Array, Array]:
    """Return parameters (m, 3) near `start` whose values are closer to points (m, 3), and the distances (m,).

    axis: (m,), the direction that is constant on the cube face of each start. Parameters stay on that face.
    """
    where, active = start.copy(), np.arange(len(points))
    best: Array = np.linalg.norm(volume(where) - points, axis=1)
    for _ in range(_NEWTON_STEPS):
        trial, (a, b), rows = where[active], tangent_axes(axis[active]), np.arange(len(active))
        jacobian = volume.jacobian(trial)  # (k, 3, 3)
        right = points[active] - volume(trial)
        step_a, step_b = damped_fit(jacobian[rows, :, a], jacobian[rows, :, b], right, _DAMPING)
        trial[rows, a] += step_a
        trial[rows, b] += step_b
        np.clip(trial, 0.0, 1.0, out=trial)
        distance = np.linalg.norm(volume(trial) - points[active], axis=1)
        gain = best[active] - distance
        closer = gain > 0.0
        where[active[closer]], best[active[closer]] = trial[closer], distance[closer]
        active = active[gain > _CONVERGED * best[active]]
        if not active.size:
            break
    return where, best
