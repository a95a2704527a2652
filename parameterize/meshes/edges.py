"""Edges of the boundary that more than two of its faces have: elements touch there, and are not glued.

Around such an edge the elements form sectors, from one face of the boundary through glued faces to another. These faces
meet in the edge alone, so that their order around it is the same all along. Where the sectors are apart at its middle,
by more than rounding, they may be pulled apart a little, and the theorem of docs/certificate.md applies.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from .evaluation import jacobian_at
from .faces import LOOPS, ElementFaces
from .mesh import VolumeMesh

_APART = 1e-6  # angle between two sectors
_MOST = 2000  # edges: each takes a millisecond


@dataclass(frozen=True, eq=False)
class Touching:
    """What is known around crowded edges.

    links: (k, 2) rows of faces of the boundary that belong to one sector. apart: True where all sectors are apart,
    False where two of them overlap, None where neither is known. row: a face at the edge that this is said of.
    """

    links: IntArray
    apart: bool | None
    row: int


def around(mesh: VolumeMesh, faces: ElementFaces, crowded: IntArray) -> Touching:
    """Return what is known around edges, given by the labels (k, 2) of their ends, ascending."""
    rows_of = _faces_at(faces, crowded)
    links: list[tuple[int, int]] = []
    doubtful = None if len(crowded) <= _MOST else rows_of[0][0]
    for ends, rows in zip(crowded[:_MOST], rows_of, strict=False):
        sectors = _sectors(mesh, faces, ends, rows)
        links += [(first, last) for first, last, _, _ in sectors]
        gap = _least_gap([(start, length) for _, _, start, length in sectors])
        if gap < -_APART:
            return Touching(np.array(links), False, rows[0])
        if gap < _APART and doubtful is None:
            doubtful = rows[0]
    return Touching(np.array(links), None if doubtful is not None else True, doubtful if doubtful is not None else -1)


def _faces_at(faces: ElementFaces, edges: IntArray) -> list[list[int]]:
    """Return for each edge the rows of all faces that have it."""
    corners = faces.corners
    last = np.where(corners[:, 3] < 0, corners[:, 0], corners[:, 3])
    ahead = np.column_stack([corners[:, 1:3], last, corners[:, 0]])
    pairs = np.sort(np.stack([corners, ahead], axis=2), axis=2).reshape(-1, 2)  # a triangle's last has -1: none
    count = int(corners.max()) + 1
    keys, wanted = pairs[:, 0] * count + pairs[:, 1], edges[:, 0] * count + edges[:, 1]
    order = np.argsort(wanted)
    place = np.minimum(np.searchsorted(wanted[order], keys), len(wanted) - 1)
    found = np.flatnonzero((wanted[order][place] == keys) & (pairs[:, 0] >= 0))
    rows_of: list[list[int]] = [[] for _ in edges]
    for at in found.tolist():
        rows_of[int(order[place[at]])].append(at // 4)
    return rows_of


def _sectors(
    mesh: VolumeMesh, faces: ElementFaces, ends: IntArray, rows: list[int]
) -> list[tuple[int, int, float, float]]:
    """Return the sectors around an edge: first and last face of the boundary, the angle where it begins, its length."""
    partner = {}
    for row in rows:
        own = [other for other in rows if faces.elements[other] == faces.elements[row] and other != row]
        partner[row] = own[0]
    frame = None
    sectors, done = [], set[int]()
    for row in rows:
        if faces.others[row] != -1 or row in done:
            continue
        at, length, begins = row, 0.0, []
        while True:
            across = partner[at]
            directions, tangent = _directions(mesh, faces, ends, (at, across))
            frame = _frame(tangent, directions[0]) if frame is None else frame
            first, second = (float(np.arctan2(frame[1] @ d, frame[0] @ d)) for d in directions)
            turn = (second - first) % (2.0 * np.pi)
            forward = turn < np.pi
            begins.append(first if forward else second)
            length += turn if forward else 2.0 * np.pi - turn
            if faces.others[across] < 0:
                break
            at = int(faces.others[across])
        done |= {row, across}
        sectors.append((row, across, begins[0] if forward else begins[-1], length))
    return sectors


def _directions(
    mesh: VolumeMesh, faces: ElementFaces, ends: IntArray, rows: tuple[int, int]
) -> tuple[list[Array], Array]:
    """Return the directions (3,) from the middle of an edge into two faces of an element, and along the edge."""
    number = int(faces.blocks[rows[0]])
    block = mesh.blocks[number]
    nodes = block.nodes[faces.elements[rows[0]] - mesh.starts[number]]
    corners = block.kind.lattice[: block.kind.corner_count] / np.array(block.kind.degrees)
    places = []
    for row in rows:
        loop, labels = LOOPS[block.kind.shape][faces.faces[row]], faces.corners[row]
        at_edge = np.isin(labels[: len(loop)], ends)
        places.append((corners[loop[at_edge]], corners[loop[~at_edge]].mean(axis=0), labels[: len(loop)][at_edge]))
    (edge, _, labels) = places[0]
    edge = edge[np.argsort(labels)]
    middle = edge.mean(axis=0)
    slopes = jacobian_at(block.kind, mesh.points[nodes], middle)
    return [slopes @ (inner - middle) for _, inner, _ in places], slopes @ (edge[1] - edge[0])


def _frame(tangent: Array, direction: Array) -> tuple[Array, Array]:
    """Return two unit vectors across a tangent, with which it is right-handed."""
    t = tangent / np.linalg.norm(tangent)
    first = direction - (direction @ t) * t
    first = first / np.linalg.norm(first)
    return first, np.cross(t, first)


def _least_gap(sectors: list[tuple[float, float]]) -> float:
    """Return the least angle between the end of a sector (begin, length) and the beginning of the next."""
    ordered = sorted((begin % (2.0 * np.pi), length) for begin, length in sectors)
    nexts = [*(begin for begin, _ in ordered[1:]), ordered[0][0] + 2.0 * np.pi]
    return min(ahead - begin - length for (begin, length), ahead in zip(ordered, nexts, strict=True))
