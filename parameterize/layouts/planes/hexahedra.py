"""Makes hexahedra of convex cells, and says how good they are."""

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np

from ...arrays import Array, IntArray
from ..complex import Complex
from ..planar.polygons import edges_of
from .cell_merging import ConvexCell


def quality(blocks: Complex) -> float:
    """Return the smallest quality of any hexahedron: 1 for a box, 0 and below for one with a fold at a corner.

    It is the smallest scaled Jacobian at a corner, times the cube root of the ratio of det J at its corners, as one
    that ends in a sliver is no better than one with a flat corner.
    """
    dets, scaled = _jacobians(blocks.points[blocks.hexahedra])
    ratios = dets.min(axis=1) / np.maximum(np.abs(dets).max(axis=1), 1e-300)
    return float((scaled.min(axis=1) * np.cbrt(np.maximum(ratios, 0.0))).min())


def cost(blocks: Complex) -> float:
    """Return the number of hexahedra over the square of their quality, by which decompositions are compared.

    So an L becomes three boxes rather than two blocks with a mitre.
    """
    return len(blocks) / max(quality(blocks), 1e-300) ** 2


def along_axes(blocks: Complex) -> Complex:
    """Return the same hexahedra, each with u, v and w along x, y and z as far as possible."""
    return Complex(blocks.points, np.array([_turned(blocks.points, one) for one in blocks.hexahedra]))


def _jacobians(corners: Array) -> tuple[Array, Array]:
    """Return det J and the scaled Jacobians (k, 8) at the corners of hexahedra (k, 2, 2, 2, 3)."""
    along = [np.repeat(np.diff(corners, axis=axis), 2, axis=axis) for axis in (1, 2, 3)]
    dets = np.sum(np.cross(along[0], along[1]) * along[2], axis=-1)
    lengths = np.prod([np.linalg.norm(row, axis=-1) for row in along], axis=0)
    return dets.reshape(-1, 8), (dets / np.maximum(lengths, 1e-300)).reshape(-1, 8)


def _turned(points: Array, corners: IntArray) -> IntArray:
    """Return one of the 24 right-handed orders of the corners (2, 2, 2): u, v, w as near to x, y, z as there is."""
    rows = points[corners]
    means = np.stack([np.diff(rows, axis=axis).reshape(-1, 3).mean(axis=0) for axis in range(3)])
    means /= np.linalg.norm(means, axis=1, keepdims=True)
    best, order, flips = -np.inf, (0, 1, 2), (1, 1, 1)
    for axes in permutations(range(3)):
        parity = round(float(np.linalg.det(np.eye(3)[list(axes)])))
        for signs in product((1, -1), repeat=3):
            agreement = float(np.array(signs) @ means[list(axes), range(3)])
            if parity * np.prod(signs) > 0 and agreement > best + 1e-9:
                best, order, flips = agreement, axes, signs  # type: ignore[assignment]
    return corners.transpose(order)[tuple(slice(None, None, sign) for sign in flips)]


def cubes(points: Array, cells: Sequence[ConvexCell]) -> Complex | None:
    """Return cells that have the faces of cubes as hexahedra; None where one has not."""
    hexahedra = [_cube(cell) for cell in cells]
    return None if any(one is None for one in hexahedra) else Complex(points, np.array(hexahedra))


def _cube(cell: ConvexCell) -> IntArray | None:
    """Return the corners (2, 2, 2) of a cell with the faces of a cube."""
    if len(cell.faces) != 6 or len(cell.corners) != 8 or any(len(face) != 4 for face in cell.faces):
        return None
    bottom = cell.faces[0]
    mates = _mates(bottom, cell.faces)
    return None if len(set(mates.values())) != 4 else column(bottom, mates)


def _mates(bottom: tuple[int, ...], faces: Sequence[tuple[int, ...]]) -> dict[int, int]:
    """Return for each corner of a face the other end of the edge that leaves the face there."""
    return {a: b for face in faces for a, b in edges_of(face) if a in bottom and b not in bottom}


def column(bottom: Sequence[int], mates: dict[int, int]) -> IntArray:
    """Return the corners (2, 2, 2) of a hexahedron over a quadrilateral, and their mates at the other end of w.

    The quadrilateral is counterclockwise seen from outside, so that w runs into the body.
    """
    a, b, c, d = bottom
    low = np.array([[a, b], [d, c]])
    return np.stack([low, np.vectorize(mates.__getitem__)(low)], axis=-1)


def subdivided(points: Array, cells: Sequence[ConvexCell]) -> Complex | None:
    """Return a hexahedron for each corner of each convex cell; None where more than three faces meet at one.

    It lies between the corner, the middles of the edges and faces there, and the middle of the cell. Middles belong to
    edges and faces, so that neighbouring cells have them in common.
    """
    rows, numbers = list(points), dict[frozenset[int], int]()

    def middle(corners: Sequence[int]) -> int:
        key = frozenset(corners)
        if key not in numbers:
            numbers[key] = len(rows)
            rows.append(points[sorted(key)].mean(axis=0))
        return numbers[key]

    hexahedra = []
    for cell in cells:
        for corner in cell.corners:
            beside = {face[face.index(corner) - 1]: face for face in cell.faces if corner in face}  # face after an edge
            if len(beside) != 3:
                return None
            first, face = next(iter(beside.items()))
            second = face[(face.index(corner) + 1) % len(face)]
            other = beside.get(second, ())
            third = other[(other.index(corner) + 1) % len(other)] if other else -1
            last = beside.get(third, ())
            if not last or last[(last.index(corner) + 1) % len(last)] != first:
                return None
            bottom = (corner, middle((corner, second)), middle(face), middle((corner, first)))
            tops = (middle((corner, third)), middle(other), middle(cell.corners), middle(last))
            hexahedra.append(column(bottom, dict(zip(bottom, tops, strict=True))))
    return Complex(np.array(rows), np.array(hexahedra))
