"""Draws all faces on the boundary of a thin start towards the surface, before the surface's points draw F.

A start of several blocks fills a part of the solid. Where two limbs of it lie far apart, many points of the surface
have the same nearest place on F, and would draw out a spike there. The other way round F comes closer evenly: each
sample of its boundary is drawn to the nearest point of the surface that faces the same way.
"""

import numpy as np

from ..arrays import Array
from ..spline.spline_map import SplineMap
from .reassignment import boundary_samples, nearest_aligned
from .sliding import SlidingParameters
from .surface_distance import TANGENTIAL, Correspondence

_A_SPAN = 2  # samples a direction and span
_FAR = 0.7  # times the width of a block: goals farther away than this hardly draw
_AGREES = 0.5  # cosine of the angle between two normals that agree


def faces_towards(surface: Correspondence, control: Array) -> Correspondence:
    """Return samples of the boundary of F, with fixed parameters, whose goals are points of the surface.

    A sample whose goal does not face the same way has no weight.
    """
    nets = surface.places.nets
    samples = boundary_samples(SplineMap(nets, control), _A_SPAN)
    chosen = nearest_aligned(surface.points, surface.normals, samples.points, samples.normals)
    normals = surface.normals[chosen]
    agrees = (normals * samples.normals).sum(axis=1) > _AGREES
    quadrics = normals[:, :, None] * normals[:, None, :] + TANGENTIAL * np.eye(3)
    widths = surface.places.boxes.min(axis=1)[samples.faces // 6]
    distances = np.linalg.norm(surface.points[chosen] - samples.points, axis=1)
    weights = samples.areas * agrees / (1.0 + (distances / (_FAR * widths)) ** 4)
    places = SlidingParameters(nets, samples.parameters, samples.faces)
    return Correspondence(places, surface.points[chosen], quadrics, weights / weights.sum())
