"""Assigns to each point of the surface the nearest place on the boundary of a body whose normal is the surface's there.

A start of several blocks is a thin skeleton of the solid, and no layout tells where a point of the surface belongs.
Between rounds the places that slides do not reach are found in this way.
"""

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Array, IntArray
from ..spline.bspline import divided_spans
from ..spline.orientation import face_vectors
from ..spline.spline_map import SplineMap
from .surface_distance import SurfaceFit

_A_SPAN = 4  # samples a direction and span
_CANDIDATES = 24  # nearest samples among which one with the surface's normal is looked for
_AGREES = 0.3  # cosine of the angle between two normals that agree
_CLOSER = 0.7  # of the present distance: a place that is not closer than this stays, as slides bring it closer


def reassign(surface: SurfaceFit, control: Array, *, first: bool = False) -> None:
    """Move places of the surface's points to the nearest sample of the boundary that faces the same way.

    Places that are hardly farther away than that sample stay; with `first`, none does.
    """
    places = surface.places
    parameters, faces, points, normals = _samples(SplineMap(places.nets, control))
    distances, near = map(np.asarray, cKDTree(points).query(surface.points, k=_CANDIDATES))
    agrees = np.einsum("nkc,nc->nk", normals[near], surface.normals) > _AGREES
    distances = np.where(agrees, distances, np.inf)
    rows, best = np.arange(len(near)), distances.argmin(axis=1)
    present = np.linalg.norm(surface.residuals(control), axis=1)
    moved = np.ones(len(near), dtype=bool) if first else distances[rows, best] < _CLOSER * present
    chosen = near[rows, best]  # the nearest one where no normal agrees
    places.place(
        np.where(moved[:, None], parameters[chosen], places.parameters),
        np.where(moved, faces[chosen], places.cube_faces),
    )


def _samples(spline: SplineMap) -> tuple[Array, IntArray, Array, Array]:
    """Return samples inside the boundary's spans: parameters (m, 3), faces (m,), points and unit normals (m, 3)."""
    found = []
    for face in np.flatnonzero(spline.nets.exposed):
        block, inside = divmod(int(face), 6)
        axis, side = divmod(inside, 2)
        patch = spline.patch(block)
        ends = [divided_spans(row, _A_SPAN) for row in patch.knots]
        rows = [(row[1:] + row[:-1]) / 2.0 for row in ends]
        points, normals = (vectors.reshape(3, -1).T for vectors in face_vectors(patch, rows, axis, side))
        rows[axis] = np.array([float(side)])
        parameters = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        found.append((parameters, np.full(len(points), face), points, normals / np.maximum(lengths, 1e-300)))
    parameters, faces, points, normals = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return parameters, faces, points, normals
