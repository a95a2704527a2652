"""The map of a decimated copy, transferred over to the large surface it was made of.

A vertex of the large surface takes the place on the cube of the nearest point of the copy, and then that of the nearest
point of the volume's boundary around it.
"""

import numpy as np

from .arrays import Array
from .cube.boundary_map import BoundaryMap
from .cube.cube import axis_and_side
from .quality.distances import closest_in_faces, nearest_on_boundary
from .spline.body import Body
from .spline.sampled_boundary import SampledBoundary
from .spline.volume import BSplineVolume
from .surface.nearest import closest_triangles
from .surface.surface import Surface


def transferred(boundary: BoundaryMap, body: Body, surface: Surface) -> BoundaryMap:
    """Return the boundary map of the large surface (in the user's units) from that of its copy.

    Its vertices come first, with its own triangles and groups as the part. Those of the copy, cut along the cube's
    edges, follow: its triangles remain the ones that are laid on the cube one-to-one. On several blocks nothing is laid
    out, and the large surface alone is the map's.
    """
    n, faces, groups = len(surface.vertices), surface.faces, surface.groups
    if not body.is_single:
        patches, places, _ = nearest_on_boundary(surface.vertices, body, SampledBoundary.of(body))
        return BoundaryMap(surface.vertices, places, faces, part_faces=faces, groups=groups, patches=patches)
    parameters = _places(boundary, body.only, surface.vertices)
    return BoundaryMap(
        np.concatenate([surface.vertices, boundary.vertices]),
        np.concatenate([parameters, boundary.parameters]),
        boundary.faces + n,
        faces,
        groups,
    )


def _places(boundary: BoundaryMap, volume: BSplineVolume, points: Array) -> Array:
    """Return the places (n, 3) on the cube of points (n, 3) near the mesh of a boundary map."""
    _, triangle, weights = closest_triangles(points, boundary.vertices, boundary.faces)
    corners = boundary.faces[triangle]  # (n, 3)
    places = np.einsum("nk,nka->na", weights, boundary.parameters[corners]).clip(0.0, 1.0)
    axis, side = axis_and_side(boundary.cube_faces[triangle])
    places[np.arange(len(points)), axis] = side
    return closest_in_faces(points, volume, places, axis)[0]
