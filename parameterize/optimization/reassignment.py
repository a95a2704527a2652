"""Assigns to each point of the surface the nearest place on the boundary of a body whose normal is the surface's there.

A start of several blocks is a thin skeleton of the solid, and no layout tells where a point of the surface belongs.
Between rounds the places that slides do not reach are found in this way.

Before the surface's points draw F, all faces on the boundary of a thin start are drawn towards the surface. Where two
limbs of it lie far apart, many points of the surface have the same nearest place on F, and would draw out a spike
there. The other way round F comes closer evenly: each sample of its boundary is drawn to the nearest point of the
surface that faces the same way.
"""

from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Array, IntArray
from ..spline.bspline import divided_spans
from ..spline.orientation import FACES, face_vectors
from ..spline.patch_groups import PatchGroup, groups_of
from ..spline.spline_map import SplineMap
from .sliding import SlidingParameters
from .surface_distance import TANGENTIAL, Correspondence

_A_SPAN = 4  # samples a direction and span
_NORMALS = 0.5  # length, at volume 1, by which normals are multiplied: perpendicular ones count as 0.7 apart
_CLOSER = 0.7  # of the present distance: a place that is not closer than this stays, as slides bring it closer


def reassign(surface: Correspondence, control: Array, *, first: bool = False) -> None:
    """Move places of the surface's points to the nearest sample of the boundary that faces the same way.

    Places that are hardly farther away than that sample stay; with `first`, none does.
    """
    sliding = surface.sliding
    samples = boundary_samples(SplineMap(sliding.nets, control), _A_SPAN)
    chosen = nearest_aligned(samples.points, samples.normals, surface.points, surface.normals)
    present = np.linalg.norm(surface.residuals(control), axis=1)
    closer = np.linalg.norm(samples.points[chosen] - surface.points, axis=1) < _CLOSER * present
    moved = np.ones_like(closer) if first else closer
    sliding.place(
        np.where(moved[:, None], samples.parameters[chosen], sliding.parameters),
        np.where(moved, samples.faces[chosen], sliding.cube_faces),
    )


def nearest_aligned(points: Array, normals: Array, others: Array, other_normals: Array) -> IntArray:
    """Return for each of `others` (n, 3) the number of the nearest of `points` (m, 3) that faces the same way, (n,).

    The distance of two points with unit normals has three more coordinates, the normals times a length.
    """
    tree = cKDTree(np.hstack([points, _NORMALS * normals]))
    return np.asarray(tree.query(np.hstack([others, _NORMALS * other_normals]))[1])


@dataclass(frozen=True, eq=False)
class BoundarySamples:
    """Hold samples inside the spans of a body's boundary.

    parameters, points, normals: (m, 3), the normals of length 1. faces: (m,). areas: (m,), of the parts of the boundary
    that the samples stand for.
    """

    parameters: Array
    faces: IntArray
    points: Array
    normals: Array
    areas: Array


def boundary_samples(spline: SplineMap, a_span: int) -> BoundarySamples:
    """Sample all faces of the boundary, `a_span` times a direction in each span."""
    exposed = spline.nets.exposed.reshape(-1, len(FACES))
    found = [
        _face_samples(group.rows(exposed[group.numbers, face]), face, a_span)
        for group in groups_of([spline.patch(block) for block in range(len(exposed))])
        for face in range(len(FACES))
        if exposed[group.numbers, face].any()
    ]
    faces = np.concatenate([samples.faces for samples in found])
    order = np.argsort(faces, kind="stable")
    names = [one.name for one in fields(BoundarySamples)]
    return BoundarySamples(*(np.concatenate([getattr(one, name) for one in found])[order] for name in names))


def _face_samples(group: PatchGroup, face: int, a_span: int) -> BoundarySamples:
    """Sample one face of all patches of a group."""
    axis, side = FACES[face]
    ends = [divided_spans(row, a_span) for row in group.knots]
    rows = [(row[1:] + row[:-1]) / 2.0 for row in ends]
    points, normals = (np.moveaxis(vectors, 0, -1).reshape(-1, 3) for vectors in face_vectors(group, rows, axis, side))
    rows[axis] = np.array([float(side)])
    parameters = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3)
    lengths = np.linalg.norm(normals, axis=1)
    return BoundarySamples(
        np.tile(parameters, (len(group), 1)),
        np.repeat(len(FACES) * group.numbers + face, len(parameters)),
        points,
        normals / np.maximum(lengths, 1e-300)[:, None],
        lengths / len(parameters),
    )


_DRAWN_A_SPAN = 2  # samples a direction and span
_FAR = 0.7  # times the width of a block: goals farther away than this hardly draw
_AGREES = 0.5  # cosine of the angle between two normals that agree


def faces_towards(surface: Correspondence, control: Array) -> Correspondence:
    """Return samples of the boundary of F, with fixed parameters, whose goals are points of the surface.

    A sample whose goal does not face the same way has no weight.
    """
    nets = surface.sliding.nets
    samples = boundary_samples(SplineMap(nets, control), _DRAWN_A_SPAN)
    chosen = nearest_aligned(surface.points, surface.normals, samples.points, samples.normals)
    normals = surface.normals[chosen]
    agrees = (normals * samples.normals).sum(axis=1) > _AGREES
    quadrics = normals[:, :, None] * normals[:, None, :] + TANGENTIAL * np.eye(3)
    widths = surface.sliding.boxes.min(axis=1)[samples.faces // 6]
    distances = np.linalg.norm(surface.points[chosen] - samples.points, axis=1)
    weights = samples.areas * agrees / (1.0 + (distances / (_FAR * widths)) ** 4)
    sliding = SlidingParameters(nets, samples.parameters, samples.faces)
    return Correspondence(sliding, surface.points[chosen], quadrics, weights / weights.sum())
