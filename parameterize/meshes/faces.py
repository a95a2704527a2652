"""The faces of elements: which two are one, which are on the boundary, and which do not fit together.

Two faces with the same corner nodes are one where all their nodes are the same. A face is looked at from its corner
with the smallest number, towards the smaller one of the two beside it: then equal faces have equal rows of nodes.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..arrays import Array, IntArray, Mask
from .kinds import ElementKind
from .mesh import VolumeMesh

# Corners of each face, counter-clockwise as seen from outside of a right-handed element.
LOOPS = {
    "hexahedron": np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]),
    "tetra": np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
}


@dataclass(frozen=True, eq=False)
class FaceKind:
    """One face of the elements of a kind.

    nodes: (m,) local numbers of its nodes. places: (m, c) of each node its weights of the c corners, in the loop's
    order, times the degree; weights of a quadrilateral are those of the bilinear map, times both degrees.
    """

    kind: ElementKind
    loop: IntArray
    nodes: IntArray
    places: Array


@cache
def face_kinds(kind: ElementKind) -> tuple[FaceKind, ...]:
    """Return the faces of a kind, in the order of LOOPS."""
    lattice = kind.lattice / np.array(kind.degrees)
    found = []
    for loop in LOOPS[kind.shape]:
        corners = lattice[loop]
        if kind.shape == "tetra":
            barycentric = np.column_stack([1.0 - lattice.sum(axis=1), lattice])
            weights = barycentric[:, loop]
            on_face = np.isclose(weights.sum(axis=1), 1.0)
        else:
            constant = int(np.flatnonzero(np.ptp(corners, axis=0) == 0.0)[0])
            on_face = lattice[:, constant] == corners[0, constant]
            s = lattice @ (corners[1] - corners[0]) - corners[0] @ (corners[1] - corners[0])
            t = lattice @ (corners[3] - corners[0]) - corners[0] @ (corners[3] - corners[0])
            weights = np.column_stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
        nodes = np.flatnonzero(on_face)
        found.append(FaceKind(kind, loop, nodes, weights[nodes]))
    return tuple(found)


@cache
def _turns(kind: ElementKind, face: int) -> tuple[IntArray, IntArray]:
    """Return for each way (w,) to look at a face its corners (w, c), as places in the loop, and its nodes (w, m).

    Ways 0 to c - 1 begin at this corner and follow the loop, ways c to 2 c - 1 go against it.
    """
    found = face_kinds(kind)[face]
    count = len(found.loop)
    ways = [[(start + step * k) % count for k in range(count)] for step in (1, -1) for start in range(count)]
    orders = []
    for way in ways:
        seen = np.round(found.places[:, way], 9)
        orders.append(found.nodes[np.lexsort(seen.T)])  # by the weights of the corners as they are met: last one first
    return np.array(ways), np.array(orders)


@dataclass(frozen=True, eq=False)
class ElementFaces:
    """All faces of a mesh.

    Attributes
    ----------
    blocks : (f,) array of int
        The block of the element of each face.
    elements : (f,) array of int
        The element's row in the mesh, counted through all blocks.
    faces : (f,) array of int
        The face's number in the element.
    corners : (f, 4) array of int
        The nodes of its corners in the loop's order, those of triangles with -1 behind.
    others : (f,) array of int
        The face that it is one with; -1 on the boundary, -2 where it has none for another reason.
    one_sided, crowded, unlike : arrays of int
        Rows of faces: that are one with a face on the same side; that three or more elements have; that have the same
        corners, but other nodes.
    """

    blocks: IntArray
    elements: IntArray
    faces: IntArray
    corners: IntArray
    others: IntArray
    one_sided: IntArray
    crowded: IntArray
    unlike: IntArray

    @property
    def on_boundary(self) -> Mask:
        """Return the mask (f,) of the faces that no other element has."""
        return np.asarray(self.others == -1)


def faces_of(mesh: VolumeMesh, labels: IntArray) -> ElementFaces:
    """Return the faces of a mesh. labels: of its points, equal for points that are taken for one."""
    columns: list[list[IntArray]] = [[] for _ in range(5)]
    rows_of_nodes: list[IntArray] = []
    widest = max(len(f.nodes) for block in mesh.blocks for f in face_kinds(block.kind))
    for number, (block, start) in enumerate(zip(mesh.blocks, mesh.starts, strict=True)):
        nodes = labels[block.nodes]
        for face, found in enumerate(face_kinds(block.kind)):
            corners = nodes[:, found.loop]
            way = _way(corners)
            ways, orders = _turns(block.kind, face)
            canonical = np.full((len(nodes), 4), -1)
            canonical[:, : len(found.loop)] = np.take_along_axis(corners, ways[way], axis=1)
            seen = np.full((len(nodes), widest), -1)
            seen[:, : len(found.nodes)] = np.take_along_axis(nodes, orders[way], axis=1)
            loops = np.full((len(nodes), 4), -1)
            loops[:, : len(found.loop)] = corners
            rows_of_nodes.append(np.column_stack([canonical, way >= len(found.loop), seen]))
            elements = start + np.arange(len(nodes))
            for column, values in zip(
                columns, (np.full(len(nodes), number), elements, np.full(len(nodes), face), loops, way), strict=True
            ):
                column.append(values)
    blocks, elements, faces, corners, _ = map(np.concatenate, columns)
    others, *defects = _paired(np.concatenate(rows_of_nodes))
    return ElementFaces(blocks, elements, faces, corners, others, *defects)


def _way(corners: IntArray) -> IntArray:
    """Return the way (n,) in which faces with these corners (n, c) are looked at."""
    count = corners.shape[1]
    rows = np.arange(len(corners))
    start = corners.argmin(axis=1)
    ahead, behind = corners[rows, (start + 1) % count], corners[rows, (start - 1) % count]
    return np.where(ahead <= behind, start, count + start)


def _paired(rows: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return the other face of each, and the rows of faces that are on one side, crowded and unlike.

    rows: (f, 5 + m) the corners as they are met, whether against the loop, and all nodes as they are met.
    """
    order = np.lexsort(rows[:, 3::-1].T)
    corners = rows[order, :4]
    begins = np.flatnonzero(np.append(True, (corners[1:] != corners[:-1]).any(axis=1)))
    sizes = np.diff(np.append(begins, len(rows)))
    others: IntArray = np.full(len(rows), -1)
    pairs = begins[sizes == 2]
    first, second = order[pairs], order[pairs + 1]
    alike = (rows[first, 5:] == rows[second, 5:]).all(axis=1)
    opposite = rows[first, 4] != rows[second, 4]
    good = alike & opposite
    others[first[good]], others[second[good]] = second[good], first[good]
    crowded = order[np.repeat(sizes > 2, sizes)]
    one_sided = np.concatenate([first[alike & ~opposite], second[alike & ~opposite]])
    unlike = np.concatenate([first[~alike], second[~alike]])
    for rest in (crowded, one_sided, unlike):
        others[rest] = -2
    return others, one_sided, crowded, unlike


def unlike_edge(mesh: VolumeMesh, faces: ElementFaces, labels: IntArray, outer: IntArray) -> int | None:
    """Return the row of a face of the boundary with an edge whose corner nodes, but not others, another edge has."""
    keys, nodes, owners = [], [], []
    widest = max(max(block.kind.degrees) for block in mesh.blocks) - 1
    if not widest:
        return None
    for number, (block, start) in enumerate(zip(mesh.blocks, mesh.starts, strict=True)):
        for face, found in enumerate(face_kinds(block.kind)):
            rows = outer[(faces.blocks[outer] == number) & (faces.faces[outer] == face)]
            own = labels[block.nodes[faces.elements[rows] - start]]
            count = len(found.loop)
            for k in range(count):
                ahead = (k + 1) % count
                others = [c for c in range(count) if c not in (k, ahead)]
                on_edge = (found.places[:, others] < 1e-9).all(axis=1) & (found.places[:, [k, ahead]] > 1e-9).all(
                    axis=1
                )
                inner = found.nodes[on_edge][np.argsort(found.places[on_edge, ahead])]
                ends = own[:, found.loop[[k, ahead]]]
                row = np.full((len(rows), widest), -1)
                along = own[:, inner]
                row[:, : len(inner)] = np.where((ends[:, :1] < ends[:, 1:]), along, along[:, ::-1])
                keys.append(np.sort(ends, axis=1))
                nodes.append(row)
                owners.append(rows)
    table = np.column_stack([np.concatenate(keys), np.concatenate(nodes)])
    order = np.lexsort(table.T[::-1])
    same_ends = (table[order][1:, :2] == table[order][:-1, :2]).all(axis=1)
    unlike = same_ends & (table[order][1:, 2:] != table[order][:-1, 2:]).any(axis=1)
    return int(np.concatenate(owners)[order[1:][unlike][0]]) if unlike.any() else None
