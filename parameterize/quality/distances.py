"""Distances of points to the boundary of a body of splines, and between this and a surface, both ways, all over both.

The vertices of a mesh alone miss the faces between them: a box has eight vertices. So its triangles are cut until every
span of the spline's boundary has at least two samples a direction, and the spline's spans are sampled, too.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from ..cube.cube import axis_and_side, damped_fit, tangent_axes
from ..cube.cutting import subdivide_finely
from ..spline.body import Body, BodyLike, as_body
from ..spline.bspline import breakpoints
from ..spline.interface import varying
from ..spline.sampled_boundary import SampledBoundary
from ..spline.volume import FACE_NAMES
from ..surface.geometry import area_shares, normals_and_areas
from ..surface.nearest import closest_triangles, distance_to_mesh
from ..threads import in_parallel

_NEWTON_STEPS = 5
_DAMPING = 1e-12  # tangents may be parallel at an edge of the cube
_ROUNDING = 1e-15  # of the largest coordinate: points that are so close come no closer
_PIECE = 16_384  # points that one thread moves at once
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
    triangle, where, axis = places_near(
        points, boundary.points, boundary.triangles, boundary.parameters, boundary.cube_faces
    )
    patches = boundary.patches[boundary.triangles[triangle, 0]]
    return patches, *closest_in_faces(points, as_body(body), patches, where, axis)


def places_near(
    points: Array, vertices: Array, triangles: IntArray, parameters: Array, cube_faces: IntArray
) -> tuple[IntArray, Array, IntArray]:
    """Return the triangles (m,) of a mesh on faces of a cube that are nearest to points (m, 3), and the places there.

    vertices (n, 3) with parameters (n, 3); triangles (k, 3) on cube_faces (k,). The places are parameters (m, 3), with
    the directions (m,) that are constant on their faces.
    """
    _, triangle, weights = closest_triangles(points, vertices, triangles)
    # the weights sum to 1 roughly
    places = np.clip(np.einsum("mk,mka->ma", weights, parameters[triangles[triangle]]), 0.0, 1.0)
    axis, side = axis_and_side(cube_faces[triangle])
    places[np.arange(len(points)), axis] = side
    return triangle, places, axis


def closest_in_faces(points: Array, body: Body, patches: IntArray, start: Array, axis: IntArray) -> tuple[Array, Array]:
    """Return parameters (m, 3) near `start` whose values are closer to points (m, 3), and the distances (m,).

    patches: (m,), of each point. axis: (m,), the direction that is constant on the cube face of each start. Parameters
    stay on that face.
    """
    exact = _ROUNDING * np.abs(points).max(initial=0.0)

    def piece(first: int) -> tuple[Array, Array]:
        rows = slice(first, first + _PIECE)
        return _closest(points[rows], body, patches[rows], start[rows], axis[rows], exact)

    found = in_parallel(piece, range(0, max(len(points), 1), _PIECE))
    where, best = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return where, best


def _closest(
    points: Array, body: Body, patches: IntArray, start: Array, axis: IntArray, exact: float
) -> tuple[Array, Array]:
    """Return what `closest_in_faces` returns. exact: the distance from which on no step is made."""
    where, offsets = start.copy(), points - body.points(patches, start)
    best: Array = np.linalg.norm(offsets, axis=1)
    active = np.flatnonzero(best > exact)
    for _ in range(_NEWTON_STEPS):
        if not active.size:
            break
        trial, (a, b), rows = where[active], tangent_axes(axis[active]), np.arange(len(active))
        jacobian = body.jacobian(patches[active], trial)  # (k, 3, 3)
        step_a, step_b = damped_fit(jacobian[rows, :, a], jacobian[rows, :, b], offsets[active], _DAMPING)
        trial[rows, a] += step_a
        trial[rows, b] += step_b
        np.clip(trial, 0.0, 1.0, out=trial)
        left = points[active] - body.points(patches[active], trial)
        distance = np.linalg.norm(left, axis=1)
        gain = best[active] - distance
        closer, own = gain > 0.0, active[gain > 0.0]
        where[own], offsets[own], best[own] = trial[closer], left[closer], distance[closer]
        active = active[gain > _CONVERGED * best[active]]
    return where, best


_PER_SPAN = 2.0  # samples on the mesh a direction, where spans have the mean area
_LEAST_SAMPLES = 4_000  # about, also for a spline of few spans; halving edges gives two to four times this number
_MOST_SAMPLES = 100_000  # on the mesh, unless it has more vertices itself


@dataclass(frozen=True, eq=False)
class OneWay:
    """The distances (m,) of samples on one surface from the other surface.

    shares (m,): of the area, their sum is 1. parameters (m, 3): on the boundary of the cube, of the spline's points;
    patches (m,): of the body, all 0 for a volume.
    """

    distances: Array
    shares: Array
    parameters: Array
    patches: IntArray

    def summary(self) -> Distances:
        """Return the root mean square and the mean over the area, and the largest."""
        return Distances.of(self.distances, self.shares)


@dataclass(frozen=True, eq=False)
class TwoSided:
    """The distances from a mesh to the spline's boundary, and from this to the mesh."""

    mesh_to_spline: OneWay
    spline_to_mesh: OneWay

    def summary(self) -> Distances:
        """Return the root mean square and the mean of both ways, each counting half, and the largest of all."""
        one, other = self.mesh_to_spline.summary(), self.spline_to_mesh.summary()
        rms = np.sqrt((one.rms**2 + other.rms**2) / 2.0)
        return Distances(float(rms), (one.mean + other.mean) / 2.0, max(one.max, other.max))


def two_sided(body: BodyLike, vertices: Array, faces: IntArray) -> TwoSided:
    """Measure the distances between a closed mesh (vertices (n, 3), faces (m, 3)) and the outer boundary of a body.

    They have the unit of length of both. The largest one is that at the samples, so it may fall short of the Hausdorff
    distance.
    """
    boundary = SampledBoundary.of(body)
    points, triangles = subdivide_finely(vertices, faces, _spacing(body, vertices, faces), _MOST_SAMPLES)
    patches, parameters, distances = nearest_on_boundary(points, body, boundary)
    return TwoSided(
        OneWay(distances, area_shares(points, triangles), parameters, patches),
        OneWay(
            distance_to_mesh(boundary.points, vertices, faces),
            area_shares(boundary.points, boundary.triangles),
            boundary.parameters,
            boundary.patches,
        ),
    )


def _spacing(body: BodyLike, vertices: Array, faces: IntArray) -> float:
    """Return the length above which edges between samples on the mesh are cut."""
    area = float(normals_and_areas(vertices, faces)[1].sum())
    cells = max(_PER_SPAN**2 * _outer_spans(body), _LEAST_SAMPLES)
    return float(np.sqrt(area / cells))


def _outer_spans(body: BodyLike) -> int:
    """Return the number of knot spans, which are rectangles, on all faces that are not glued."""
    several, total = as_body(body), 0
    for group in several.groups:
        spans = [len(breakpoints(row)) - 1 for row in group.knots]
        of_faces = np.array([spans[a] * spans[b] for a, b in map(varying, FACE_NAMES)])
        total += int((~several.glued[group.numbers] * of_faces).sum())
    return total
