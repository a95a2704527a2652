"""The distance between a surface and the boundary of a spline, both ways, at samples all over both.

The vertices of a mesh alone miss the faces between them: a box has eight vertices. So its triangles are cut until every
span of the spline's boundary has at least two samples a direction, and the spline's spans are sampled, too.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from ..cube.cutting import subdivide_finely
from ..spline.bspline import breakpoints
from ..spline.sampled_boundary import SampledBoundary
from ..spline.volume import BSplineVolume
from ..surface.geometry import area_shares, normals_and_areas
from ..surface.nearest import distance_to_mesh
from .distances import Distances, nearest_on_boundary

_PER_SPAN = 2.0  # samples on the mesh a direction, where spans have the mean area
_LEAST_SAMPLES = 4_000  # about, also for a spline of few spans; halving edges gives two to four times this number
_MOST_SAMPLES = 100_000  # on the mesh, unless it has more vertices itself


@dataclass(frozen=True, eq=False)
class OneWay:
    """The distances (m,) of samples on one surface from the other surface.

    shares (m,): of the area, their sum is 1. parameters (m, 3): on the boundary of the cube, of the spline's points.
    """

    distances: Array
    shares: Array
    parameters: Array

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


def two_sided(volume: BSplineVolume, vertices: Array, faces: IntArray) -> TwoSided:
    """Measure the distances between a closed mesh (vertices (n, 3), faces (m, 3)) and the spline's boundary.

    They have the unit of length of both. The largest one is that at the samples, so it may fall short of the Hausdorff
    distance.
    """
    boundary = SampledBoundary.of(volume)
    points, triangles = subdivide_finely(vertices, faces, _spacing(volume, vertices, faces), _MOST_SAMPLES)
    parameters, distances = nearest_on_boundary(points, volume, boundary)
    return TwoSided(
        OneWay(distances, area_shares(points, triangles), parameters),
        OneWay(
            distance_to_mesh(boundary.points, vertices, faces),
            area_shares(boundary.points, boundary.triangles),
            boundary.parameters,
        ),
    )


def _spacing(volume: BSplineVolume, vertices: Array, faces: IntArray) -> float:
    """Return the length above which edges between samples on the mesh are cut."""
    u, v, w = (len(breakpoints(row)) - 1 for row in volume.knots)
    area = float(normals_and_areas(vertices, faces)[1].sum())
    cells = max(_PER_SPAN**2 * 2 * (u * v + v * w + w * u), _LEAST_SAMPLES)
    return float(np.sqrt(area / cells))
