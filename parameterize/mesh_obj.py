"""Wavefront OBJ: vertices and polygons in the file's own numbering.

A general loader splits vertices at texture seams and renumbers them; corners given by vertex number need the file's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .mesh_error import MeshError
from .mesh_headers import check_face_count

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
MAX_CORNERS = 256


def parse_obj(data: bytes, max_faces: int) -> tuple[Array, list[list[int]], list[str]]:
    """Vertices (n, 3), polygons as lists of vertex numbers from 0, and notices.

    Texture and normal references are dropped, negative indices count back from the last vertex so far.
    Raises MeshError, without the file's name, naming the line.
    """
    if b"\0" in data:
        raise MeshError("not an OBJ: it holds binary data; export as OBJ text")
    notices = ["byte order mark skipped"] if data.startswith(b"\xef\xbb\xbf") else []
    text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ")
    vertices: list[tuple[float, float, float]] = []
    polygons: list[list[int]] = []
    relative = False
    for number, line in enumerate(text.split("\n"), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if words[0] == "v":
            vertices.append(_vertex(words, number))
        elif words[0] in ("f", "fo"):
            polygon = _polygon(words, number)
            relative |= min(polygon) < 0
            polygons.append([index - 1 if index > 0 else index + len(vertices) for index in polygon])
    if not vertices or not polygons:
        raise MeshError(
            f"{len(vertices)} vertices and {len(polygons)} faces are no surface: not an OBJ, or an empty one"
        )
    check_face_count(len(polygons), max_faces)
    if relative:
        notices.append("negative (relative) vertex numbers resolved")
    return np.array(vertices), polygons, notices


def _vertex(words: list[str], number: int) -> tuple[float, float, float]:
    try:
        return float(words[1]), float(words[2]), float(words[3])
    except (IndexError, ValueError):
        raise MeshError(f"line {number}: a vertex needs three numbers, got {' '.join(words[1:5])[:40]!r}") from None


def _polygon(words: list[str], number: int) -> list[int]:
    try:
        indices = [int(word.split("/", 1)[0]) for word in words[1:]]
    except ValueError:
        raise MeshError(f"line {number}: a face needs vertex numbers, got {' '.join(words[1:5])[:40]!r}") from None
    if not 3 <= len(indices) <= MAX_CORNERS:
        raise MeshError(
            f"line {number}: a face has {len(indices)} corners, expected 3 to {MAX_CORNERS}: triangulate it"
        )
    if 0 in indices:
        raise MeshError(f"line {number}: vertex number 0, OBJ counts from 1; export the file again")
    return indices


def triangulate(vertices: Array, polygons: list[list[int]]) -> IntArray:
    """Triangles (m, 3) in the polygons' order: each polygon is cut as the fan whose worst triangle is best.

    The fan is judged by its triangles' areas along the polygon's mean normal, so a concave quadrilateral is cut along
    the diagonal inside it. Vertex numbers must be in range.
    """
    sizes = np.array([len(polygon) for polygon in polygons])
    triangles, owners = [], []
    for size in np.unique(sizes):
        which = np.flatnonzero(sizes == size)
        corners = np.array([polygons[i] for i in which], dtype=np.int64)  # (k, size)
        triangles.append(_best_fans(vertices, corners).reshape(-1, 3))
        owners.append(np.repeat(which, size - 2))
    order = np.argsort(np.concatenate(owners), kind="stable")
    return np.concatenate(triangles)[order]


def _best_fans(vertices: Array, corners: IntArray) -> IntArray:
    size = corners.shape[1]
    best = _fan(corners)  # (k, size - 2, 3)
    if size == 3:
        return best
    normal = _normals(vertices, best).sum(axis=1, keepdims=True)  # (k, 1, 3)
    quality = np.sum(_normals(vertices, best) * normal, axis=-1).min(axis=1)  # (k,)
    for shift in range(1, size):
        fan = _fan(np.roll(corners, -shift, axis=1))
        score = np.sum(_normals(vertices, fan) * normal, axis=-1).min(axis=1)
        better = score > quality
        best[better], quality[better] = fan[better], score[better]
    return best


def _fan(corners: IntArray) -> IntArray:
    first = np.broadcast_to(corners[:, :1], corners[:, 2:].shape)
    return np.stack([first, corners[:, 1:-1], corners[:, 2:]], axis=-1)


def _normals(vertices: Array, triangles: IntArray) -> Array:
    a, b, c = (vertices[triangles[..., i]] for i in range(3))
    return np.cross(b - a, c - a)
