"""How well the edges of blocks follow the sharp edges of a surface, and how much normals differ.

A sharp edge is kept where an edge of F lies on it: elsewhere F is smooth. Normals differ at rounded edges and at horns
that hardly count as distances.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import igl
import numpy as np

from ..arrays import Array, IntArray, Mask
from ..spline.body import BodyLike, as_body
from ..spline.bspline import divided_spans
from ..spline.patch_groups import PatchGroup
from ..spline.sampled_boundary import SampledBoundary
from ..surface.features import SHARP, Features, features_of
from ..surface.geometry import normals_and_areas
from ..surface.nearest import closest_triangles
from .distances import Distances

_SAMPLES = 2000  # on all sharp edges together, about
_PER_SPAN = 4  # samples on the edges of blocks, which are curves
_NORMALS = 40  # samples a direction on the faces of a cube, at which normals are compared


@dataclass(frozen=True)
class Sharpness:
    """Describe how sharp edges are kept.

    Attributes
    ----------
    edges, corners : int
        The number of sharp edges of the surface, from corner to corner, and of corners.
    length : float
        Of all sharp edges, in the user's units.
    distance : Distances or None
        From samples on these to the nearest edge of an outer face of F, over the diagonal of the surface's bounding
        box; rms and mean over their length. None where there are none.
    normals : Distances
        Angles in degrees between the normals of F's boundary and of the nearest triangle of the surface; rms and mean
        over the area.
    """

    edges: int
    corners: int
    length: float
    distance: Distances | None
    normals: Distances

    def as_dict(self) -> dict[str, Any]:
        """Return the values in plain Python types."""
        return asdict(self)


def sharpness_of(body: BodyLike, vertices: Array, faces: IntArray, angle: float = SHARP) -> Sharpness:
    """Measure a body against a closed surface, vertices (n, 3) and faces (m, 3), in one unit of length.

    angle: in degrees, above which an edge of the surface is sharp.
    """
    found = features_of(vertices, faces, angle)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    distance = None
    if len(found):
        points, shares = _samples(found, vertices)
        distance = Distances.of(distance_to_edges(points, body), shares).scaled(1.0 / diagonal)
    angles = Distances.of(*_angles(body, vertices, faces))
    return Sharpness(len(found), len(found.corners), float(found.lengths.sum()), distance, angles)


def _samples(found: Features, vertices: Array) -> tuple[Array, Array]:
    """Return points (k, 3) on sharp edges, their ends among them, and the share (k,) of the length that each has."""
    first, last = vertices[found.edges[:, 0]], vertices[found.edges[:, 1]]
    lengths = np.linalg.norm(last - first, axis=1)
    pieces = np.maximum(1, np.ceil(_SAMPLES * lengths / lengths.sum())).astype(np.int64)
    edge = np.repeat(np.arange(len(pieces)), pieces + 1)
    place = np.arange(len(edge)) - np.repeat(np.cumsum(pieces + 1) - pieces - 1, pieces + 1)
    share = place / pieces[edge]
    at_end = (place == 0) | (place == pieces[edge])
    weights = np.where(at_end, 0.5, 1.0) * (lengths / pieces)[edge]
    return first[edge] + share[:, None] * (last - first)[edge], weights / weights.sum()


def distance_to_edges(points: Array, body: BodyLike) -> Array:
    """Return the distances (k,) of points (k, 3) from the nearest edge of an outer face of a body."""
    several = as_body(body)
    pieces = np.concatenate(
        [curve for group in several.groups for curve in _edges(group, ~several.glued[group.numbers])]
    )
    ends = np.ascontiguousarray(pieces.reshape(-1, 3))
    squared = igl.point_mesh_squared_distance(points, ends, np.arange(len(ends)).reshape(-1, 2))[0]
    return np.sqrt(np.asarray(squared).ravel())


def _edges(group: PatchGroup, faces: Mask) -> Iterator[Array]:
    """Yield the straight pieces (k, 2, 3) of the edges of faces of the patches of a group, given by a mask (.., 6)."""
    for axis in range(3):
        others = [other for other in range(3) if other != axis]
        for sides in product((0, 1), repeat=2):
            beside = [2 * other + side for other, side in zip(others, sides, strict=True)]
            rows = [np.array([0.0])] * 3
            rows[axis] = divided_spans(group.knots[axis], _PER_SPAN)
            for other, side in zip(others, sides, strict=True):
                rows[other] = np.array([float(side)])
            u, v, w = rows
            own = group.rows(faces[:, beside[0]] | faces[:, beside[1]])
            lines = own.grid(u, v, w).reshape(len(own), len(rows[axis]), 3)
            yield np.stack([lines[:, :-1], lines[:, 1:]], axis=2).reshape(-1, 2, 3)


def _angles(body: BodyLike, vertices: Array, faces: IntArray) -> tuple[Array, Array]:
    """Return angles (k,) in degrees between normals of a body's boundary and those of a surface, and shares of area."""
    boundary = SampledBoundary.of(body, _NORMALS)
    normals, areas = normals_and_areas(boundary.points, boundary.triangles)
    _, nearest, _ = closest_triangles(boundary.points[boundary.triangles].mean(axis=1), vertices, faces)
    cosines = np.abs(np.sum(normals * normals_and_areas(vertices, faces[nearest])[0], axis=1))
    return np.degrees(np.arccos(np.minimum(cosines, 1.0))), areas / areas.sum()
