"""Distances between a mesh and the boundary of a trivariate spline."""

from dataclasses import dataclass

import igl
import numpy as np

from ..arrays import Array, IntArray
from ..cube.cube import axis_and_side, damped_fit, tangent_axes
from ..spline.bspline import breakpoints, divided_spans
from ..spline.volume import BSplineVolume
from ..surface.geometry import doubled_areas

SAMPLES = 160  # a direction and cube face, at least
PER_SPAN = 3  # likewise

_NEWTON_STEPS = 5
_DAMPING = 1e-12  # tangents may be parallel at an edge of the cube
_CONVERGED = 1e-3  # a step that gains less than this share of the distance is the last


@dataclass(frozen=True)
class Distances:
    """Root mean square, mean and largest of some distances, one unit."""

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


@dataclass(frozen=True, eq=False)
class SampledBoundary:
    """The spline's boundary sampled on a grid a cube face, and the triangles between the samples."""

    parameters: Array  # (n, 3), face after face in the order of FACE_NAMES
    points: Array  # (n, 3)
    triangles: IntArray  # (m, 3), wound outwards where F keeps orientation
    cube_faces: IntArray  # (m,) of the triangles

    @classmethod
    def of(cls, volume: BSplineVolume, samples: int = SAMPLES) -> "SampledBoundary":
        """Sample all six faces, edges included: each span alike, `samples` a direction at least."""
        if samples < 2:
            raise ValueError(f"samples must be at least 2, got {samples}")
        spans = [len(breakpoints(row)) - 1 for row in volume.knots]
        u, v, w = (
            divided_spans(row, max(PER_SPAN, -(-(samples - 1) // count)))
            for row, count in zip(volume.knots, spans, strict=True)
        )
        return cls.on(volume, u, v, w)

    @classmethod
    def on(cls, volume: BSplineVolume, *rows: Array) -> "SampledBoundary":
        """Sample all six faces at three rows of parameters, each from 0 to 1."""
        parameters, points, triangles, cube_faces, count = [], [], [], [], 0
        for k in range(6):
            axis, side = axis_and_side(k)
            u, v, w = (np.array([float(side)]) if d == axis else row for d, row in enumerate(rows))
            parameters.append(np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3))
            points.append(volume.grid(u, v, w).reshape(-1, 3))
            face = _halved_cells(*(len(row) for d, row in enumerate(rows) if d != axis))
            inwards = (side == 1) == (axis == 1)  # (u, w) is left-handed seen along v
            triangles.append(count + (face[:, ::-1] if inwards else face))
            cube_faces.append(np.full(len(face), k))
            count += len(parameters[-1])
        return cls(*(np.concatenate(parts) for parts in (parameters, points, triangles, cube_faces)))


def _halved_cells(n_a: int, n_b: int) -> IntArray:
    """Return two triangles for each cell of a grid of n_a x n_b points, numbered row by row."""
    number = np.arange(n_a * n_b, dtype=np.int64).reshape(n_a, n_b)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def to_mesh(points: Array, vertices: Array, faces: IntArray) -> Array:
    """Return the distance of each point (m, 3) to the nearest point of a triangle mesh: (m,)."""
    return _closest(points, vertices, faces)[0]


def nearest_on_mesh(points: Array, vertices: Array, faces: IntArray) -> tuple[Array, Array]:
    """Return the nearest point of a triangle mesh to each point (m, 3), and the unit normal of its triangle."""
    _, triangle, weights = _closest(points, vertices, faces)
    corners = vertices[faces[triangle]]  # (m, 3, 3)
    cross = doubled_areas(vertices, faces[triangle])
    normals = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    return np.einsum("mk,mka->ma", weights, corners), normals


def nearest_on_boundary(points: Array, volume: BSplineVolume, boundary: SampledBoundary) -> tuple[Array, Array]:
    """Return for points (m, 3) the parameters (m, 3) of the spline's nearest boundary points, and the distances (m,).

    The nearest point of the sampled triangles gives a cube face and parameters on it; Gauss-Newton steps in that face
    then lower the distance to the spline itself. The distances are to points of the spline's boundary, so never less
    than the true ones.
    """
    _, triangle, weights = _closest(points, boundary.points, boundary.triangles)
    corners = boundary.triangles[triangle]  # (m, 3)
    where = np.einsum("mk,mka->ma", weights, boundary.parameters[corners])
    axis, _ = axis_and_side(boundary.cube_faces[triangle])
    active = np.arange(len(points))
    where[active, axis] = boundary.parameters[corners[:, 0], axis]
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


def _closest(points: Array, vertices: Array, faces: IntArray) -> tuple[Array, IntArray, Array]:
    """Return for points (m, 3) the distance (m,) to the mesh, the nearest triangle (m,), barycentric weights (m, 3)."""
    target = np.ascontiguousarray(vertices, dtype=np.float64)
    triangles = np.ascontiguousarray(faces, dtype=np.int64)
    squared, index, foot = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points, dtype=np.float64), target, triangles
    )
    nearest = np.asarray(index, dtype=np.int64).ravel()
    a, b, c = np.moveaxis(target[triangles[nearest]], 1, 0)  # (m, 3) each
    edges = np.stack([b - a, c - a], axis=-1)  # (m, 3, 2)
    shares = np.einsum("mkx,mx->mk", np.linalg.pinv(edges), foot - a)  # least squares: a sliver does no harm
    weights = np.clip(np.column_stack([1.0 - shares.sum(axis=1), shares]), 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.sqrt(np.asarray(squared).ravel()), nearest, weights
