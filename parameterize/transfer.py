"""The map of a decimated copy, transferred over to the large surface it was made of.

A vertex of the large surface takes the place on the cube of the nearest point of the copy, and then that of the nearest
point of the volume's boundary around it.
"""

import numpy as np

from .cube.boundary_map import BoundaryMap
from .quality.distances import closest_in_faces, nearest_on_boundary, places_near
from .spline.body import Body
from .spline.sampled_boundary import SampledBoundary
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
    mesh = boundary.vertices, boundary.faces, boundary.parameters, boundary.cube_faces
    _, places, axis = places_near(surface.vertices, *mesh)
    parameters, _ = closest_in_faces(surface.vertices, body, np.zeros(len(places), dtype=np.int64), places, axis)
    return BoundaryMap(
        np.concatenate([surface.vertices, boundary.vertices]),
        np.concatenate([parameters, boundary.parameters]),
        boundary.faces + n,
        faces,
        groups,
    )
