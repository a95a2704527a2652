"""Collapses the edges of a closed surface until few triangles are left, the least errors first.

The error of a collapse is that of Garland and Heckbert (SIGGRAPH 1997): the squared distances of the new vertex from
the planes of all triangles that it stands for, times their areas. All edges are ranked at once, and of the first ones
those are collapsed that do not touch; then the others are ranked anew. A flat part, where no collapse has an error,
loses its shortest edges first, and no collapse may leave a thin triangle or turn one around.
"""

from collections.abc import Iterator
from functools import partial

import numba
import numpy as np

from ..arrays import Array, IntArray, Mask
from ..threads import in_parallel
from .geometry import directed_edges

_RANKED = 0.25  # share of the edges that may be collapsed before all are ranked anew
_SLOW = 0.02  # share of the triangles: where fewer go at once, thinner triangles are allowed, and then more edges
_ROUND = 0.2  # least shape of a new triangle, 1 of an equilateral one; or as that of the thinnest it stands for
_THINNEST = 0.01  # least shape that is ever asked for
_TURN = 0.5  # least cosine between the normals of a triangle before and after a collapse
_NORMAL = 1e-6  # shape below which a triangle has no normal that counts
_EVEN = 1e-8  # of an edge's length beside the distance from the planes
_HOLD = 1e-6  # of the distance from the edge's middle, which decides where the planes do not
_PIECE = 32_768  # edges that one thread weighs at once
_QUADRIC = 10  # numbers of a quadric: xx, xy, xz, yy, yz, zz, x, y, z, 1


def collapsed(vertices: Array, faces: IntArray, most: int) -> tuple[Array, IntArray]:
    """Return the vertices (n, 3) and triangles of a closed surface after collapses, `most` or a few more if they end.

    They end where every collapse would change how the surface hangs together, or turn a triangle around.
    """
    points, faces = vertices.copy(), faces.copy()
    quadrics, shape, ranked = _quadrics(points, faces), _ROUND, _RANKED
    while len(faces) > most:
        sides = directed_edges(faces)
        edges = sides[sides[:, 0] < sides[:, 1]]  # each once: a closed surface has both directions
        pieces = np.array_split(edges, range(_PIECE, len(edges), _PIECE))
        found = in_parallel(partial(_errors, points, quadrics), pieces)
        errors, places = (np.concatenate(rows) for rows in zip(*found, strict=True))
        first = np.argsort(errors, kind="stable")[: int(np.ceil(ranked * len(edges)))]
        kept = _collapse(points, faces, quadrics, edges[first], places[first], most, shape)
        before, faces = len(faces), faces[kept]
        if before - len(faces) > _SLOW * before:
            continue
        if shape > _THINNEST:
            shape /= 2.0
        elif ranked < 1.0:
            ranked = min(2.0 * ranked, 1.0)
        elif before == len(faces):
            break
    used, numbers = np.unique(faces, return_inverse=True)
    return points[used], numbers.reshape(-1, 3)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _quadrics(points: Array, faces: IntArray) -> Array:
    """Return the quadrics (n, 10) of vertices: of the planes of the triangles there, each with a third of its area."""
    quadrics, normal = np.zeros((len(points), _QUADRIC)), np.empty(3)
    for face in faces:
        a, b, c = points[face[0]], points[face[1]], points[face[2]]
        size = _normal(a, b, c, normal)
        x, y, z = normal
        offset = -(x * a[0] + y * a[1] + z * a[2])
        for corner in face:
            for k, product in enumerate(
                (x * x, x * y, x * z, y * y, y * z, z * z, x * offset, y * offset, z * offset, offset * offset)
            ):
                quadrics[corner, k] += size / 6.0 * product
    return quadrics


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _errors(points: Array, quadrics: Array, edges: IntArray) -> tuple[Array, Array]:
    """Return the errors (e,) of collapses of edges (e, 2), and the places (e, 3) where they are least."""
    errors, places = np.empty(len(edges)), np.empty((len(edges), 3))
    for e in range(len(edges)):
        start, end = points[edges[e, 0]], points[edges[e, 1]]
        xx, xy, xz, yy, yz, zz, x, y, z, one = quadrics[edges[e, 0]] + quadrics[edges[e, 1]]
        total = xx + yy + zz
        hold = _HOLD * total + 1e-300
        a, b, c = xx + hold, yy + hold, zz + hold
        middle = 0.5 * (start + end)
        right = hold * middle[0] - x, hold * middle[1] - y, hold * middle[2] - z
        ab, ac, bc = xz * yz - xy * c, xy * yz - xz * b, xy * xz - yz * a  # of the adjugate
        aa, bb, cc = b * c - yz * yz, a * c - xz * xz, a * b - xy * xy
        size = a * aa + xy * ab + xz * ac
        u = (aa * right[0] + ab * right[1] + ac * right[2]) / size
        v = (ab * right[0] + bb * right[1] + bc * right[2]) / size
        w = (ac * right[0] + bc * right[1] + cc * right[2]) / size
        places[e, 0], places[e, 1], places[e, 2] = u, v, w
        error = u * (xx * u + 2.0 * (xy * v + xz * w + x)) + v * (yy * v + 2.0 * (yz * w + y))
        error += w * (zz * w + 2.0 * z) + one
        length = (start[0] - end[0]) ** 2 + (start[1] - end[1]) ** 2 + (start[2] - end[2]) ** 2
        errors[e] = max(error, 0.0) + _EVEN * total * length
    return errors, places


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _collapse(
    points: Array, faces: IntArray, quadrics: Array, edges: IntArray, places: Array, most: int, least_shape: float
) -> Mask:
    """Collapse edges (e, 2), in their order, that do not touch one collapsed before; return which faces (m,) are left.

    points, faces and quadrics are changed: the first vertex of an edge moves to its place and takes all triangles.
    """
    rings = _rings(faces, len(points))
    left, is_left = len(faces), np.ones(len(faces), dtype=np.bool_)
    is_moved, seen = np.zeros(len(points), dtype=np.bool_), np.full(len(points), -1, dtype=np.int64)
    for e in range(len(edges)):
        u, v = edges[e]
        if left <= most:
            break
        if is_moved[u] or is_moved[v] or not _is_simple(faces, rings, is_left, u, v, seen, e):
            continue
        if not _stays_fine(points, faces, rings, is_left, u, v, places[e], least_shape):
            continue
        left -= _join(faces, rings, is_left, u, v)
        points[u], quadrics[u] = places[e], quadrics[u] + quadrics[v]
        is_moved[u] = is_moved[v] = True
    return is_left


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _rings(faces: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Return a corner 3 i + k of each vertex (n,), and the next corner (3 m,) of the same vertex, round and round."""
    first, following = np.full(count, -1, dtype=np.int64), np.empty(3 * len(faces), dtype=np.int64)
    for corner in range(3 * len(faces)):
        vertex = faces[corner // 3, corner % 3]
        if first[vertex] < 0:
            first[vertex] = following[corner] = corner
        else:
            following[corner] = following[first[vertex]]
            following[first[vertex]] = corner
    return first, following


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _corners(rings: tuple[IntArray, IntArray], is_left: Mask, vertex: int) -> Iterator[int]:
    """Yield the corners 3 i + k at a vertex, of the faces that are left."""
    first, following = rings
    corner = first[vertex]
    while True:
        if is_left[corner // 3]:
            yield corner
        corner = following[corner]
        if corner == first[vertex]:
            break


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _is_simple(
    faces: IntArray, rings: tuple[IntArray, IntArray], is_left: Mask, u: int, v: int, seen: IntArray, mark: int
) -> bool:
    """Return whether the surface hangs together as before once v is at u: they have two neighbours in common.

    Each of the two keeps three triangles at least. seen: (n,), where neighbours get a mark that no other edge has.
    """
    for corner in _corners(rings, is_left, u):
        for vertex in faces[corner // 3]:
            seen[vertex] = mark
    common = 0
    for corner in _corners(rings, is_left, v):
        other = faces[corner // 3, (corner + 1) % 3]  # so each neighbour comes once
        if other == u or seen[other] != mark:
            continue
        common, around = common + 1, 0
        for _ in _corners(rings, is_left, other):
            around += 1
        if common > 2 or around < 4:
            return False
    return common == 2


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _stays_fine(
    points: Array,
    faces: IntArray,
    rings: tuple[IntArray, IntArray],
    is_left: Mask,
    u: int,
    v: int,
    place: Array,
    least_shape: float,
) -> bool:
    """Return whether no triangle around an edge turns around where u and v go to a place, and none becomes thin."""
    before, after = np.empty(3), np.empty(3)
    thinnest, thinnest_after = 1.0, 1.0
    for moved, other in ((u, v), (v, u)):
        for corner in _corners(rings, is_left, moved):
            b, c = faces[corner // 3, (corner + 1) % 3], faces[corner // 3, (corner + 2) % 3]
            shape = _shape(points[moved], points[b], points[c], before)
            thinnest = min(thinnest, shape)
            if b == other or c == other:
                continue
            thinnest_after = min(thinnest_after, _shape(place, points[b], points[c], after))
            cosine = before[0] * after[0] + before[1] * after[1] + before[2] * after[2]
            if shape > _NORMAL and cosine < _TURN:
                return False
    return thinnest_after >= min(least_shape, thinnest)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _join(faces: IntArray, rings: tuple[IntArray, IntArray], is_left: Mask, u: int, v: int) -> int:
    """Give all triangles of v to u, but those of both, which go; return the number of these."""
    gone = 0
    for corner in _corners(rings, is_left, v):
        face = corner // 3
        if faces[face, 0] == u or faces[face, 1] == u or faces[face, 2] == u:
            is_left[face], gone = False, gone + 1
        else:
            faces[face, corner % 3] = u
    first, following = rings
    following[first[u]], following[first[v]] = following[first[v]], following[first[u]]
    return gone


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _shape(a: Array, b: Array, c: Array, normal: Array) -> float:
    """Return the shape of a triangle, 1 where it is equilateral and 0 where flat; `normal` becomes its unit normal."""
    size, squares = _normal(a, b, c, normal), 0.0
    for d in range(3):
        squares += (b[d] - a[d]) ** 2 + (c[d] - b[d]) ** 2 + (a[d] - c[d]) ** 2
    return 2.0 * np.sqrt(3.0) * size / max(squares, 1e-300)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _normal(a: Array, b: Array, c: Array, normal: Array) -> float:
    """Return twice the area of a triangle; `normal` becomes its unit normal, of length 0 where it has no area."""
    normal[0] = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    normal[1] = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    normal[2] = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for d in range(3):
        normal[d] /= max(size, 1e-300)
    return float(size)
