"""Finds the sharp edges of a body among the borders of its outer faces, and the smooth faces between them."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.orientation import hands_of
from parameterize.spline.volume import FACE_NAMES

from .colors import MOST_NAMED, PATCH_COLORS
from .fields import PER_PATCH, outer_faces, points_of, remembered
from .render import Patch

SHARP = 30.0  # degrees between the normals of two faces
SAME = 1e-6  # of the box's diagonal: borders of two faces that are nearer are one


@dataclass(frozen=True, eq=False)
class SharpOutline:
    """Hold the sharp edges of a body and the smooth faces between them.

    edges: (e, 2), the ends of short pieces, as numbers of samples on the outer faces. faces: (f,), the number of the
    smooth face that each outer face belongs to.
    """

    edges: IntArray
    faces: IntArray


@remembered
def outline_of(body: BodyLike) -> SharpOutline:
    """Return the outline of a body by the samples that its figures have on outer faces."""
    return outline(body, points_of(body).on(outer_faces(body)))


def outline(body: BodyLike, points: Array) -> SharpOutline:
    """Return the outline by samples (f, m, m, 3) on the outer faces of a body."""
    count, m, borders = len(points), points.shape[1], _borders(points.shape[1])
    normals = outward(body, points)
    # of each of the four sides of each face: its samples (4 f, m), and the normals of the cells beside (4 f, m - 1, 3)
    samples = (np.arange(count)[:, None, None] * m * m + borders).reshape(-1, m)
    beside = np.stack([normals[:, :, 0], normals[:, :, -1], normals[:, 0], normals[:, -1]], axis=1)
    beside = beside.reshape(-1, m - 1, 3)
    places = points.reshape(-1, 3)
    middles = places[samples[:, m // 2]]
    near = SAME * float(np.linalg.norm(np.ptp(places, axis=0)))
    apart, found = map(np.asarray, cKDTree(middles).query(middles, 2))
    own = np.arange(len(middles))
    other = np.where(found[:, 0] == own, found[:, 1], found[:, 0])
    first = np.flatnonzero((apart.max(axis=1) < near) & (own < other))
    second = other[first]
    ends = places[samples[:, [0, -1]]]
    crossed = np.linalg.norm(ends[first, 0] - ends[second, 0], axis=1) > near
    across = np.where(crossed[:, None, None], beside[second, ::-1], beside[second])
    sharp = (beside[first] * across).sum(axis=-1) < np.cos(np.radians(SHARP))
    pieces = np.stack([samples[first, :-1], samples[first, 1:]], axis=-1)[sharp]
    smooth = sharp.mean(axis=1) < 0.5
    rows, columns = first[smooth] // 4, second[smooth] // 4
    joined = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    return SharpOutline(pieces, connected_components(joined, directed=False)[1].astype(np.int64))


def outward(body: BodyLike, points: Array) -> Array:
    """Return the outward unit normals (f, m - 1, m - 1, 3) of the cells between samples (f, m, m, 3) on outer faces."""
    glued = as_body(body)
    patches, faces = np.divmod(outer_faces(glued), PER_PATCH)
    axes, sides = np.divmod(faces % len(FACE_NAMES), 2)
    signs = np.where((sides == 1) == (axes != 1), 1.0, -1.0) * hands_of(glued.groups)[patches]
    diagonals = points[:, 1:, 1:] - points[:, :-1, :-1], points[:, :-1, 1:] - points[:, 1:, :-1]
    areas = np.cross(*diagonals) * signs[:, None, None, None]
    return np.asarray(areas / np.maximum(np.linalg.norm(areas, axis=-1, keepdims=True), 1e-300))


def _borders(m: int) -> IntArray:
    """Return the numbers (4, m) of the samples along the four sides of m x m samples."""
    numbers = np.arange(m * m).reshape(m, m)
    return np.stack([numbers[:, 0], numbers[:, -1], numbers[0], numbers[-1]])


def edge_patch(places: Array, edges: IntArray) -> Patch:
    """Return edges (e, 2) of places (k, 3) as patches without width, of which the lines alone are seen."""
    ends = places[edges]
    points = np.stack([ends, ends], axis=1)  # (e, 2, 2, 3)
    return Patch(points, np.zeros_like(points), every=1)


def smooth_colors(body: BodyLike) -> list[str]:
    """Return a colour for each outer face: one for all between the same sharp edges."""
    return [PATCH_COLORS[number % len(PATCH_COLORS)] for number in outline_of(body).faces.tolist()]


def is_by_face(body: BodyLike) -> bool:
    """Return whether the colours of a body are those of its smooth faces: it has too many blocks for one each."""
    glued = as_body(body)
    return len(glued) > MOST_NAMED and not glued.solids.are_several
