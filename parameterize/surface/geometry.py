"""Edges, components, volume, normals, quadrics and weights of a triangle mesh."""

import igl
import numpy as np
from scipy.sparse import csc_matrix

from ..arrays import Array, IntArray


def edge_table(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the undirected edges (e, 2), sorted, and the number of faces at each (e,)."""
    pairs = np.sort(directed_edges(faces), axis=1)
    base = int(faces.max()) + 1 if len(faces) else 1
    keys, counts = np.unique(pairs[:, 0] * base + pairs[:, 1], return_counts=True)
    return np.stack([keys // base, keys % base], axis=1), counts


def used_vertices(faces: IntArray) -> IntArray:
    """Return the numbers of the vertices that faces use, ascending; negative ones are refused."""
    return np.flatnonzero(np.bincount(faces.ravel()))


def directed_edges(faces: IntArray) -> IntArray:
    """Return the edges (3 m, 2) in the direction of each face; edge k of face i is row 3 i + k."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def edge_triangles(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the edges (e, 2) of a closed surface, each pair ascending, and the two triangles at each (e, 2)."""
    sides = np.sort(directed_edges(faces), axis=1)
    order = np.argsort(sides[:, 1] * (int(faces.max(initial=0)) + 1) + sides[:, 0], kind="stable")
    return sides[order][::2], order.reshape(-1, 2) // 3


def connected(links: IntArray, count: int) -> IntArray:
    """Return the number of the component that each of `count` things belongs to (count,), joined by links (k, 2)."""
    rows, columns = np.concatenate([links, links[:, ::-1]]).T
    graph = csc_matrix((np.ones(len(rows), dtype=np.int64), (rows, columns)), shape=(count, count))
    return np.asarray(igl.connected_components(graph)[1])


def signed_volume(vertices: Array, faces: IntArray) -> float:
    """Return the volume enclosed by faces wound outward; it is negative when they are wound inward."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.sum(np.cross(a, b) * c) / 6.0)


def doubled_areas(vertices: Array, faces: IntArray) -> Array:
    """Return the normals of the triangles, as long as twice their areas (m, 3)."""
    rows = np.ascontiguousarray(vertices.T)
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = (row[faces.T] for row in rows)  # in rows, three times as fast
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    return np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)


def normals_and_areas(vertices: Array, faces: IntArray) -> tuple[Array, Array]:
    """Return the unit normals (m, 3) of triangles, zero where a triangle has no area, and their areas (m,)."""
    cross = doubled_areas(vertices, faces)
    lengths = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(lengths, 1e-300)[:, None], 0.5 * lengths


def _summed(values: Array, faces: IntArray, count: int) -> Array:
    """Return the sums (count, ...) at the vertices of the values (m, ...) of the triangles around each."""
    sums = np.zeros((count, *values.shape[1:]))
    for k in range(3):
        np.add.at(sums, faces[:, k], values)
    return sums


def vertex_normals(vertices: Array, faces: IntArray) -> Array:
    """Return the unit normals at the vertices (n, 3), from the area-weighted mean over the triangles there."""
    cross = doubled_areas(vertices, faces)
    sums = _summed(cross, faces, len(vertices))
    return sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-300)[:, None]


def vertex_quadrics(vertices: Array, faces: IntArray, tangential: float) -> Array:
    """Return the area-weighted mean of n n^T over the triangles at each vertex, plus `tangential` times I (n, 3, 3)."""
    normal, area = normals_and_areas(vertices, faces)
    share = area[:, None, None] * normal[:, :, None] * normal[:, None, :]
    sums, total = (_summed(values, faces, len(vertices)) for values in (share, area))
    return np.asarray(sums / np.maximum(total, 1e-300)[:, None, None] + tangential * np.eye(3))


def vertex_weights(vertices: Array, faces: IntArray, n_own: int) -> Array:
    """Return weights (n,) of the vertices whose sum is 1: half of each by count, as in the report, and half by area.

    n_own: the number of the mesh's own vertices, which come first; vertices of cut edges do not count.
    """
    counted = np.arange(len(vertices)) < n_own
    return np.asarray(0.5 * counted / n_own + 0.5 * area_shares(vertices, faces))


def area_shares(vertices: Array, faces: IntArray) -> Array:
    """Return the share (n,) of the surface's area that is nearest to each vertex: a third of each triangle there."""
    _, area = normals_and_areas(vertices, faces)
    share = np.bincount(faces.ravel(), np.repeat(area / 3.0, 3), minlength=len(vertices))
    return np.asarray(share / share.sum())


def corner_angles(vertices: Array, faces: IntArray) -> Array:
    """Return the angles (m, 3) of triangles at their corners, in radians."""
    corners = vertices[faces]
    after, before = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(after, before), axis=2), np.sum(after * before, axis=2)))
