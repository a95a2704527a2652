"""The distance between a surface and the outer boundary of a body, both ways, at samples all over both.

The vertices of a mesh alone miss the faces between them: a box has eight vertices. So its triangles are cut until every
span of the spline's boundary has at least two samples a direction, and the spline's spans are sampled, too.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from ..cube.cutting import subdivide_finely
from ..spline.body import BodyLike, as_body
from ..spline.bspline import breakpoints
from ..spline.interface import varying
from ..spline.sampled_boundary import SampledBoundary
from ..surface.geometry import area_shares, normals_and_areas
from ..surface.nearest import distance_to_mesh
from .distances import Distances, nearest_on_boundary

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
    for patch, names in zip(several.patches, several.outer, strict=True):
        spans = [len(breakpoints(row)) - 1 for row in patch.knots]
        total += sum(spans[a] * spans[b] for a, b in map(varying, names))
    return total
