"""Tells at samples of a body's outer faces which of the conditions' regions holds there."""

from collections.abc import Sequence

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.orientation import hands_of
from parameterize.spline.volume import FACE_NAMES
from solve.forms.conditions import Condition
from solve.forms.region import Region

from .fields import PER_PATCH, on_planes, outer_faces, points_of, remembered, slopes_of


@remembered
def numbers_of(body: BodyLike, conditions: Sequence[Condition]) -> IntArray:
    """Return the number (f, m, m) of the first condition that holds at the samples of the outer faces, -1 for none."""
    points = points_of(body).on(outer_faces(body))
    return numbers_at([condition.region for condition in conditions], as_body(body), points)


def numbers_at(regions: Sequence[Region], body: Body, points: Array) -> IntArray:
    """Return the number (f, m, m) of the first region that holds at points (f, m, m, 3) of the outer faces.

    The points are even samples of the faces. Where no region holds, the number is -1.
    """
    found = np.empty(points.shape[:-1], dtype=np.int64)
    normals = _normals(body, outer_faces(body), points.shape[1])
    names, x, n = body.outer_faces, np.moveaxis(points, -1, 0), np.moveaxis(normals, -1, 0)
    kinds = np.array([face for _, face in names])
    for face in FACE_NAMES:
        own = kinds == face
        found[own] = first_of(regions, x[:, own], n[:, own], face)
    named = {face for region in regions for face in region.patch_faces}
    for number, (patch, face) in enumerate(names):
        if (name := body.face_name(patch, face)) in named:
            found[number] = first_of(regions, x[:, number], n[:, number], name)
    return found


def _normals(body: Body, places: IntArray, samples: int) -> Array:
    """Return the outward unit normals (k, samples, samples, 3) of outer faces (k,)."""
    patches, faces = np.divmod(places, PER_PATCH)
    slopes = on_planes(slopes_of(body), places, samples)
    normals, hands = np.empty(slopes.shape[:-1]), hands_of(body.groups)
    for number in range(len(FACE_NAMES)):
        axis, side = divmod(number, 2)
        b, c = (slopes[faces == number][..., (axis + step) % 3] for step in (1, 2))
        normals[faces == number] = np.cross(b, c) if side else np.cross(c, b)
    return normals * (hands[patches, None, None] / np.linalg.norm(normals, axis=-1))[..., None]


def first_of(regions: Sequence[Region], points: Array, normals: Array, face: str = "") -> IntArray:
    """Return the number of the first region that holds at each of the points (3, ...), -1 where none does."""
    found = np.full(points.shape[1:], -1)
    for number in reversed(range(len(regions))):
        found[regions[number].holds(points, normals, face)] = number
    return found
