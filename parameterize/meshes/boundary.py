"""The boundary of a mesh as quadrilateral Bezier pieces, for the proofs of certificate/patch_proofs.py.

A triangle becomes three quadrilaterals around its corners, that meet in the middles of its edges and in its centre.
Of degree p in the triangle, the map is of degree p in both parameters of each.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import product

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..certificate.patch_proofs import Pieces
from ..spline.bernstein import binomials, elevation
from ..spline.body import numbers_of_classes
from .bezier import bernstein_of_values, net_matrix, simplex_bernstein, simplex_indices
from .faces import ElementFaces, face_kinds
from .kinds import ElementKind
from .mesh import VolumeMesh

Matrix = tuple[tuple[Fraction, ...], ...]

DEPTH = 16  # halvings of a piece, at most
_HALVED = 2 * DEPTH  # in both directions
_CORNERS = [(0, 0), (0, 1), (1, 1), (1, 0)]  # of a quadrilateral's parameters: in the loop's order, turned
_ENDS = np.array([[0, 1], [3, 2], [0, 3], [1, 2]])  # corners of the edges of a piece, as patch_proofs.py orders edges


@cache
def face_nets(kind: ElementKind, face: int, degree: int) -> Array:
    """Return the matrix (quadrilaterals, (degree + 1)^2, nodes) from an element's nodes to a face's control points.

    The first parameter leads from corner 0 to corner 3 of the quadrilateral, the second from corner 0 to corner 1.
    """
    if kind.shape == "tetra":
        return np.array([_triangle_part(kind, face, part, degree) for part in range(3)])
    p = np.array(kind.degrees)
    corners = kind.lattice[face_kinds(kind)[face].loop]
    along, across = ((corners[k] - corners[0]) // p for k in (1, 3))
    q, r = int(np.abs(across) @ p), int(np.abs(along) @ p)
    net = net_matrix(kind)
    rows = []
    for i, j in product(range(q + 1), range(r + 1)):
        u, v, w = corners[0] + i * across + j * along
        rows.append([float(x) for x in net[(u * (p[1] + 1) + v) * (p[2] + 1) + w]])
    raised = np.kron(elevation(q, degree), elevation(r, degree))
    return (raised @ np.array(rows))[None]


def _triangle_part(kind: ElementKind, face: int, part: int, degree: int) -> Array:
    """Return the matrix ((degree + 1)^2, nodes) to the control points of one of the three parts of a triangle."""
    p = kind.degrees[0]
    corner, ahead, behind = np.roll(face_kinds(kind)[face].loop, -part).tolist()
    whole, half, third = Fraction(1), Fraction(1, 2), Fraction(1, 3)
    ends = [{corner: whole}, {corner: half, ahead: half}, dict.fromkeys((corner, ahead, behind), third)]
    ends.append({corner: half, behind: half})
    net, indices = net_matrix(kind), simplex_indices(p)
    values = []
    for i, j in product(range(p + 1), repeat=2):
        s, t = Fraction(i, p), Fraction(j, p)
        shares = ((1 - s) * (1 - t), (1 - s) * t, s * t, s * (1 - t))
        place = [sum((w * end.get(k, 0) for w, end in zip(shares, ends, strict=True)), Fraction(0)) for k in range(4)]
        weights = [simplex_bernstein(p, index, place[1:]) for index in indices]
        used = [(weight, row) for weight, row in zip(weights, net, strict=True) if weight]
        values.append([sum((weight * row[n] for weight, row in used), Fraction(0)) for n in range(len(net[0]))])
    one = bernstein_of_values(p)
    rows = []
    for i, j in product(range(p + 1), repeat=2):
        shares_of = [(one[i][a] * one[j][b], values[a * (p + 1) + b]) for a, b in product(range(p + 1), repeat=2)]
        rows.append([float(sum((w * row[n] for w, row in shares_of), Fraction(0))) for n in range(len(net[0]))])
    raised = np.kron(elevation(p, degree), elevation(p, degree))
    return np.asarray(raised @ np.array(rows))


@dataclass(frozen=True, eq=False)
class Quadrilaterals:
    """The quadrilaterals of a boundary.

    nets: (n, q + 1, q + 1, 3) control points. corners: (n, 4) labels of the corners in the loop's order, the first
    parameter leading from 0 to 3, the second from 0 to 1. faces: (n,) the row of the face in the mesh. error: a bound
    of the rounding error of a coordinate.
    """

    nets: Array
    corners: IntArray
    faces: IntArray
    error: float

    @property
    def pieces(self) -> Pieces:
        """Return them as pieces."""
        count = len(self.nets)
        axes: IntArray = np.full(count, 2)
        return Pieces(0, QuadrilateralNames(self.corners), np.arange(count), axes, np.zeros((count, 3), int), self.nets)


def quadrilaterals(mesh: VolumeMesh, faces: ElementFaces, labels: IntArray, points: Array) -> Quadrilaterals:
    """Return the boundary of a mesh. labels: of its points; points: (n, 3), scaled to magnitude 1 near the origin."""
    degree = max(max(block.kind.degrees) for block in mesh.blocks)
    nets, corners, owners = [], [], []
    bound = 0.0
    middles = _Middles(len(points))
    outer = np.flatnonzero(faces.on_boundary)
    for number, (block, start) in enumerate(zip(mesh.blocks, mesh.starts, strict=True)):
        for face, kind in enumerate(face_kinds(block.kind)):
            own = outer[(faces.blocks[outer] == number) & (faces.faces[outer] == face)]
            matrices = face_nets(block.kind, face, degree)
            nodes = block.nodes[faces.elements[own] - start]
            net = np.einsum("qcn,knx->kqcx", matrices, points[nodes], optimize=True)
            nets.append(net.reshape(-1, degree + 1, degree + 1, 3))
            corners.append(middles.corners(labels[nodes[:, kind.loop]], own))
            owners.append(np.repeat(own, len(matrices)))
            roundings = matrices.shape[2] + 2 * degree + 10
            bound = max(bound, roundings * float(np.abs(matrices).sum(axis=2).max()))
    size = float(np.abs(points).max(initial=0.0))
    found, labelled, rows = map(np.concatenate, (nets, corners, owners))
    return Quadrilaterals(found, labelled, rows, 1.01 * (bound + _HALVED * (degree + 1)) * 2.0**-53 * size)


class _Middles:
    """Labels the middles of edges and the centres of triangles, behind the labels of points."""

    def __init__(self, count: int) -> None:
        self._count = count

    def corners(self, corners: IntArray, rows: IntArray) -> IntArray:
        """Return the corners (k, 4) of the quadrilaterals of faces with these corners (n, c), the faces' rows (n,)."""
        if corners.shape[1] == 4:
            return corners
        n = self._count
        ahead = np.roll(corners, -1, axis=1)
        low, high = np.minimum(corners, ahead), np.maximum(corners, ahead)
        middle = n + n + low * n + high  # of edge k, from corner k on: behind points and other middles
        centre = -1 - rows  # negative: no other label is
        parts = [np.stack([corners[:, k], middle[:, k], centre, middle[:, (k + 2) % 3]], axis=1) for k in range(3)]
        return np.stack(parts, axis=1).reshape(-1, 4)


class QuadrilateralNames:
    """Gives points on quadrilaterals names, the same to points of a common corner or edge."""

    def __init__(self, corners: IntArray) -> None:
        labels, own = np.unique(corners, return_inverse=True)
        self._corners = own.reshape(-1, 4)
        ends = self._corners[:, _ENDS]  # (n, 4, 2)
        self._backward = ends[..., 0] > ends[..., 1]
        keys, edges = np.unique(np.sort(ends, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
        self._edges = len(labels) + edges.reshape(-1, 4)
        self._insides = len(labels) + len(keys)

    @property
    def edges(self) -> IntArray:
        """Return the numbers (n, 4) of the edges."""
        return self._edges

    def names(self, patches: IntArray, axes: IntArray, positions: IntArray, steps: int) -> IntArray:
        """Return the names (n, m, 3) of points; positions: (n, m, 3), a quadrilateral being `steps` long."""
        i, j = positions[..., 0], positions[..., 1]
        own = patches[:, None]
        at_ends = [(j, i == 0), (j, i == steps), (i, j == 0), (i, j == steps)]
        found = np.stack([np.broadcast_to(self._insides + own, i.shape), i, j], axis=-1)
        for edge, (along, here) in enumerate(at_ends):
            turned = np.where(self._backward[own, edge], steps - along, along)
            name = np.stack([np.broadcast_to(self._edges[own, edge], i.shape), turned, np.zeros_like(i)], axis=-1)
            found = np.where(here[..., None], name, found)
        for corner, (a, b) in enumerate(_CORNERS):
            here = (i == a * steps) & (j == b * steps)
            name = np.stack([np.broadcast_to(self._corners[own, corner], i.shape), 0 * i, 0 * i], axis=-1)
            found = np.where(here[..., None], name, found)
        return np.asarray(found)


class QuadrilateralSurface:
    """Evaluates quadrilaterals, for the search for a common point."""

    def __init__(self, found: Quadrilaterals) -> None:
        self._nets, self._corners = found.nets, found.corners

    def _basis(self, where: Array, order: int) -> Array:
        """Return the Bernstein polynomials of a parameter (k,) or their derivatives: (k, q + 1)."""
        q = self._nets.shape[1] - 1
        if order:
            lower = _bernstein(q - 1, where)
            zero = np.zeros((len(where), 1))
            return np.asarray(q * (np.hstack([zero, lower]) - np.hstack([lower, zero])))
        return _bernstein(q, where)

    def points(self, faces: IntArray, where: Array) -> Array:
        """Return points (k, 3) at parameters (k, 3) of quadrilaterals (k,)."""
        return self._values(faces, where, 0, 0)

    def jacobian(self, faces: IntArray, where: Array) -> Array:
        """Return the derivatives (k, 3, 3); that of the third parameter is zero."""
        slopes = [self._values(faces, where, 1, 0), self._values(faces, where, 0, 1), np.zeros((len(faces), 3))]
        return np.stack(slopes, axis=2)

    def _values(self, faces: IntArray, where: Array, first: int, second: int) -> Array:
        u, v = self._basis(where[:, 0], first), self._basis(where[:, 1], second)
        return np.einsum("ki,kj,kijx->kx", u, v, self._nets[faces], optimize=True)

    def middles(self, pieces: Pieces, rows: IntArray) -> Array:
        """Return the parameters (k, 3) of the middle of pieces."""
        return (pieces.low[rows] + pieces.high[rows]) / 2.0 ** (pieces.depth + 1)

    def distance(self, faces: list[IntArray], where: list[Array]) -> Array:
        """Return a lower bound (k,) of the distance of two parameters, in one face or through common corners."""
        direct = np.where(faces[0] == faces[1], np.abs(where[0] - where[1]).max(axis=1), 1.0)
        alike = self._corners[faces[0]][:, :, None] == self._corners[faces[1]][:, None]  # (k, 4, 4)
        to_edges = [np.minimum(place, 1.0 - place)[:, :2].min(axis=1) for place in where]
        return np.where(alike.any(axis=(1, 2)), np.minimum(direct, to_edges[0] + to_edges[1]), direct)


def _bernstein(degree: int, where: Array) -> Array:
    powers = np.arange(degree + 1)
    return np.asarray(binomials(degree) * where[:, None] ** powers * (1.0 - where[:, None]) ** (degree - powers))


def edges_of(corners: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return the ends (e, 2) of the edges of faces (f, 4), how many faces each has, and the edges (f, 4) of each face.

    corners: those of triangles have -1 behind, and their fourth edge is -1. Ends are ascending.
    """
    last = np.where(corners[:, 3] < 0, corners[:, 0], corners[:, 3])
    ahead = np.column_stack([corners[:, 1:3], last, corners[:, 0]])
    real = np.column_stack([np.ones((len(corners), 3), dtype=bool), corners[:, 3] >= 0])
    pairs = np.sort(np.stack([corners, ahead], axis=2), axis=2)[real]
    ends, numbers, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    edges: IntArray = np.full((len(corners), 4), -1)
    edges[real] = numbers.ravel()
    return ends, counts, edges


def shells_of(edges: IntArray, is_plain: Mask, links: IntArray) -> IntArray:
    """Return the number (f,) of the shell of each face: faces with a common plain edge, and linked ones, are in one.

    edges: (f, 4) of each face, -1 for none. is_plain: (e,) whether two faces have an edge. links: (k, 2) of faces.
    """
    rows, places = np.nonzero((edges >= 0) & is_plain[edges])
    pairs = np.stack([rows, len(edges) + edges[rows, places]])
    joined = np.concatenate([pairs, links.reshape(-1, 2).T], axis=1)
    return numbers_of_classes(len(edges) + len(is_plain), joined)[: len(edges)]
