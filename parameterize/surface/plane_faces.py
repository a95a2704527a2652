"""Groups the triangles of a surface that lie in common planes."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from .geometry import edge_triangles, normals_and_areas

FLAT = 1e-6  # of the box's diagonal: vertices this near to a plane lie in it, as files hold numbers in single precision
_PARALLEL = 0.9998  # cosine of one degree: a triangle that is inclined more has a plane of its own
_SLIVER = 1e-8  # of the squared diagonal: the normal of a triangle of less area is rounding
_REFITS = 5  # at most: a plane through one small triangle misses vertices far away, one through all triangles does not


@dataclass(frozen=True, eq=False)
class Planes:
    """The parts of a surface that are plane: connected triangles, each of which lies in the plane of its part.

    Attributes
    ----------
    parts : (m,) array of int
        The part of each triangle, from 0 on, the part with the largest triangle first.
    normals : (k, 3) array
        The outward unit normals of the parts.
    offsets : (k,) array
        x lies in the plane of part i where normals[i] @ x = offsets[i].
    """

    parts: IntArray
    normals: Array
    offsets: Array

    def __len__(self) -> int:
        return len(self.normals)


def planes_of(vertices: Array, faces: IntArray, most: int) -> Planes | None:
    """Return the plane parts of a closed surface, vertices (n, 3) and faces (m, 3); None for more than `most`.

    A part grows from its largest triangle over its neighbours, and its plane is fitted to all its triangles.
    """
    normals, areas = normals_and_areas(vertices, faces)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    slivers = areas < _SLIVER * diagonal**2
    beside, (first, second, third) = _neighbours(faces), np.ascontiguousarray(faces.T)
    parts = np.full(len(faces), -1, dtype=np.int64)
    found: list[tuple[Array, float]] = []
    for seed in np.argsort(-areas, kind="stable"):
        if parts[seed] >= 0:
            continue
        if len(found) == most:
            return None
        normal, offset = normals[seed], float(normals[seed] @ vertices[faces[seed, 0]])
        members = np.array([seed])
        for _ in range(_REFITS):
            near = np.abs(vertices @ normal - offset) <= FLAT * diagonal
            suits = near[first] & near[second] & near[third] & (slivers | (normals @ normal > _PARALLEL)) & (parts < 0)
            grown = _reached(int(seed), suits, beside)
            if len(grown) <= len(members):
                break
            members = grown
            normal, offset = _fitted(vertices[faces[members]], normals[members], areas[members])
        parts[members] = len(found)
        found.append((normal, offset))
    return Planes(parts, np.array([normal for normal, _ in found]), np.array([offset for _, offset in found]))


def _neighbours(faces: IntArray) -> IntArray:
    """Return the three triangles at the sides of each triangle of a closed surface, (m, 3)."""
    pairs = edge_triangles(faces)[1]
    owners = np.concatenate([pairs, pairs[:, ::-1]])
    return np.asarray(owners[np.argsort(owners[:, 0], kind="stable"), 1].reshape(-1, 3))


def _reached(seed: int, suits: Array, beside: IntArray) -> IntArray:
    """Return the triangles, ascending, that a triangle reaches through those that suit."""
    seen, waiting = {seed}, deque([seed])
    while waiting:
        for other in beside[waiting.popleft()].tolist():
            if suits[other] and other not in seen:
                seen.add(other)
                waiting.append(other)
    return np.array(sorted(seen))


def _fitted(corners: Array, normals: Array, areas: Array) -> tuple[Array, float]:
    """Return the normal (3,) and the offset of the plane nearest to triangles: corners (k, 3, 3), each by its area."""
    middle = np.average(corners.mean(axis=1), axis=0, weights=areas)
    rows = (corners - middle).reshape(-1, 3) * np.sqrt(np.repeat(areas, 3))[:, None]
    normal = np.linalg.svd(rows, full_matrices=False)[2][2]
    outward = normal if normal @ (areas @ normals) > 0.0 else -normal
    return outward, float(outward @ middle)
