"""Sheets of a surface that lie on each other, touch, or hang loose.

Doubled faces are removed, and sheets that hang on an edge by one side; edges and vertices where sheets touch are split.

Neither changes the volume. Sheets that touch along an edge are told apart by the material between them: of the faces
around the edge, in the order of their angles, those are joined that have the body's inside between them.
"""

import igl
import numpy as np

from ..arrays import Array, IntArray, Mask
from .errors import MeshError
from .geometry import connected, directed_edges, edge_table, normals_and_areas, signed_volume
from .mesh_repair import MeshRepair


def without_doubled(mesh: MeshRepair) -> tuple[MeshRepair, list[str]]:
    """Return the mesh without faces that are given more than once, and a notice of their number.

    One of the equal faces is kept where the surface is open without them, none where it is closed, as at the wall
    between two rooms or where two triangles lie on each other.
    """
    rows = np.sort(mesh.faces, axis=1)
    _, first, label, counts = np.unique(rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
    label = label.ravel()
    if counts.max(initial=0) < 2:
        return mesh, []
    single = counts[label] == 1
    doubled = first[counts > 1]  # one face of each set of equal ones
    kept = doubled[_needed(mesh.faces[single], mesh.faces[doubled])]
    if single.sum() + len(kept) < 4:
        raise MeshError("encloses no volume (its faces lie exactly on each other): give it thickness")
    chosen = np.sort(np.concatenate([np.flatnonzero(single), kept]))
    twice, walls = int(counts[label[kept]].sum()) - len(kept), len(doubled) - len(kept)
    notices = []
    if twice:
        notices.append(f"dropped {twice} doubled faces: each lies exactly on another one, which is kept")
    if walls:
        lost = np.setdiff1d(doubled, kept)
        area = float(normals_and_areas(mesh.vertices, mesh.faces[lost])[1].sum())
        notices.append(
            f"dropped {int(counts[label[lost]].sum())} faces that lie exactly on each other inside the body or beside "
            f"it (walls of no thickness, area {area:.3g}): the volume is unchanged"
        )
    return mesh.with_faces(chosen), notices


def _needed(others: IntArray, doubled: IntArray) -> Mask:
    """Return which faces (k,) close the surface of the other faces; those joined by edges are judged together."""
    edges, counts = edge_table(others)
    sides = np.sort(directed_edges(doubled), axis=1)
    base = int(max(doubled.max(), others.max(initial=0))) + 1
    keys, side = np.unique(sides[:, 0] * base + sides[:, 1], return_inverse=True)
    around = np.zeros(len(keys), dtype=np.int64)  # other faces at each edge
    _, mine_at, theirs_at = np.intersect1d(keys, edges[:, 0] * base + edges[:, 1], return_indices=True)
    around[mine_at] = counts[theirs_at]
    mine = np.bincount(side, minlength=len(keys))
    owner = np.repeat(np.arange(len(doubled)), 3)
    patch = connected(np.stack([owner, len(doubled) + side], axis=1), len(doubled) + len(keys))
    rims = patch[len(doubled) :]

    def wrong(count: IntArray) -> IntArray:
        return np.bincount(rims, (count != 0) & (count != 2), minlength=int(patch.max()) + 1).astype(np.int64)

    closed = np.bincount(rims, mine % 2, minlength=int(patch.max()) + 1) == 0  # bodies of their own
    better: Mask = closed | (wrong(around + mine) < wrong(around))
    return better[patch[: len(doubled)]]


def split(mesh: MeshRepair) -> tuple[MeshRepair, list[str]]:
    """Return the mesh whose sheets have edges and vertices of their own where they touch, and a notice.

    Edges whose faces do not enclose material by turns keep all their faces, as they are. A vertex where holes of one
    component meet is kept: their filling joins the faces there.
    """
    counts = edge_table(mesh.faces)[1]
    pinched = ~igl.is_vertex_manifold(mesh.faces)
    if counts.max() <= 2 and not pinched.any():
        return mesh, []
    links, parted = _joined_corners(mesh)
    corner = connected(links, 3 * len(mesh.faces))
    vertex = mesh.faces.ravel()
    _, first, label = np.unique(corner, return_index=True, return_inverse=True)  # the fans of faces around vertices
    fan_vertex = vertex[first]
    order = np.lexsort((first, fan_vertex))
    again = np.zeros(len(first), dtype=bool)
    again[order[1:]] = np.diff(fan_vertex[order]) == 0
    if not again.any():
        return mesh, []
    number = fan_vertex.copy()
    number[again] = len(mesh.points) + np.arange(np.count_nonzero(again))
    copied = fan_vertex[again]
    found = mesh.with_copies(copied, number[label].reshape(-1, 3))
    places = len(np.unique(copied))
    said = f"{places} {'vertex' if places == 1 else 'vertices'}"
    said += f" and {parted} {'edge' if parted == 1 else 'edges'}" if parted else ""
    where = mesh.where(int(copied.min()))
    return found, [f"split {said} where sheets touch, the first at {where}: the volume is unchanged"]


def _joined_corners(mesh: MeshRepair) -> tuple[IntArray, int]:
    """Return pairs (k, 2) of corners 3 i + j of faces joined across an edge, and the number of edges that are split."""
    sides = directed_edges(mesh.faces)
    _, edge, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(edge.ravel(), kind="stable")
    starts = np.cumsum(counts) - counts
    pairs = [order[starts[counts == 2][:, None] + np.arange(2)]]
    inward = signed_volume(mesh.points, mesh.faces) < 0
    parted = 0
    for start, count in zip(starts[counts > 2], counts[counts > 2], strict=True):
        around = order[start : start + count]
        found = _across_material(mesh.points, mesh.faces, sides, around, inward)
        parted += found is not None
        pairs.append(np.stack([around[:-1], around[1:]], axis=1) if found is None else found)
    first, second = np.concatenate(pairs).T
    face = connected(np.stack([first, second], axis=1) // 3, len(mesh.faces))  # the component of each face
    next_corner = 3 * (np.arange(len(sides)) // 3) + (np.arange(len(sides)) + 1) % 3
    ends = [np.stack([np.arange(len(sides)), next_corner], axis=1)[row] for row in (first, second)]
    turned = sides[first, 0] != sides[second, 0]
    ends[1][turned] = ends[1][turned][:, ::-1]
    joined = [np.stack([ends[0][:, k], ends[1][:, k]], axis=1) for k in (0, 1)]
    joined.append(_at_holes(mesh.faces, order[starts[counts == 1]], face))
    return np.concatenate(joined), parted


def _at_holes(faces: IntArray, border: IntArray, component: IntArray) -> IntArray:
    """Return pairs (k, 2) of corners at a vertex where holes of one component meet; border: the open sides (e,)."""
    corners = np.concatenate([border, 3 * (border // 3) + (border + 1) % 3])
    keys = faces.ravel()[corners] * (int(component.max()) + 1) + component[corners // 3]
    order = np.argsort(keys, kind="stable")
    same = np.diff(keys[order]) == 0
    return np.stack([corners[order[:-1][same]], corners[order[1:][same]]], axis=1)


def _across_material(
    points: Array, faces: IntArray, sides: IntArray, around: IntArray, inward: bool
) -> IntArray | None:
    """Return pairs (k, 2) of the sides at an edge with material between them; None where there is none by turns."""
    low, high = np.sort(sides[around[0]])
    axis = points[high] - points[low]
    tips = points[faces.ravel()[3 * (around // 3) + (around + 2) % 3]] - points[low]
    across = tips - np.outer(tips @ axis, axis) / max(float(axis @ axis), 1e-300)
    ahead = across[0] / max(float(np.linalg.norm(across[0])), 1e-300)
    upward = np.cross(axis / max(float(np.linalg.norm(axis)), 1e-300), ahead)
    angle = np.arctan2(across @ upward, across @ ahead)
    order = around[np.argsort(angle, kind="stable")]
    forward = (sides[order, 0] == low) != inward  # its material lies on the side of smaller angles
    if len(order) % 2 or np.any(forward == np.roll(forward, 1)):
        return None
    if forward[0]:
        order = np.roll(order, -1)
    return order.reshape(-1, 2)


def without_flaps(mesh: MeshRepair) -> tuple[MeshRepair, list[str]]:
    """Return the mesh without its loose faces, and a notice of their number and area.

    Loose are the sheets, bounded by edges of more than two faces, that have an open edge; they are dropped where every
    edge on which they hang has two faces left, otherwise all are kept.
    """
    numbers = edge_table(mesh.faces)[1]
    if not (numbers == 1).any() or numbers.max() < 3:
        return mesh, []
    sides = directed_edges(mesh.faces)
    _, edge, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1, 3)  # of each face
    label = _smooth_sheets(edge, counts)
    marked = [np.bincount(label, wrong[edge].any(axis=1)) > 0 for wrong in (counts == 1, counts > 2)]
    loose = (marked[0] & marked[1])[label]
    left = np.bincount(edge[~loose].ravel(), minlength=len(counts))
    if loose.all() or np.any(left[np.unique(edge[loose])] % 2) or np.any(left[counts > 2] > 2):
        return mesh, []
    dropped = np.flatnonzero(loose)
    area = float(normals_and_areas(mesh.vertices, mesh.faces[dropped])[1].sum())
    notice = f"dropped {len(dropped)} loose faces (area {area:.3g}) that hang on the body by an edge: "
    return mesh.with_faces(np.flatnonzero(~loose)), [notice + "the volume is unchanged"]


def _smooth_sheets(edge: IntArray, counts: IntArray) -> IntArray:
    """Return the number of the sheet of each face (m,): faces (m, 3 edges) are joined across edges of two faces."""
    face, side = np.nonzero(counts[edge] == 2)
    links = np.stack([face, len(edge) + edge[face, side]], axis=1)
    return np.unique(connected(links, len(edge) + len(counts))[: len(edge)], return_inverse=True)[1]
