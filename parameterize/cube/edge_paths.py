"""Finds the cube's corners on the surface, 12 edge paths between them, and the six patches of these (section 4.4.1).

Each patch is a disc whose rim goes to the sides of a square; where every inner vertex is a convex combination of its
neighbours, the map onto that square is one-to-one (Tutte 1963; Floater, Math. Comp. 72, 2003). The combinations
reproduce the network's places wherever these are already one-to-one.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu

from ..arrays import Array, IntArray, Mask
from ..surface.geometry import connected, directed_edges, edge_table, edge_triangles
from ..surface.ridges import Ridges
from .cube import CORNERS, EDGES, CubeLayout, axis_and_side, face_number, project_radially, tangent_axes
from .cutting import cut_along_rays, split_edges

_STRAY = 20.0  # extra cost of a path, relative to its length, at the distance _STRAY_DISTANCE from its cube edge
_STRAY_DISTANCE = 0.05
_FOLLOWED = 0.01  # of its cost, that of a path along a ridge: it may stray by a quarter of the cube's side
_ORDERS = 24  # orders in which the twelve paths are traced before the surface is given up: twice one for each path
_FLAT = 1e-12  # doubled area on the square up to which a triangle counts as turned over
_TINY = 1e-12  # least length, and least 1 + cosine and 1 - cosine, in half tangents


class PathError(RuntimeError):
    """Raised where the cube's edges cannot be traced on the surface."""


@dataclass(frozen=True, eq=False)
class CubeSurface:
    """Hold the surface, cut along the 12 paths.

    layout: the refined mesh. paths: 12 sequences of vertices between the corners, in the order of EDGES. face_labels:
    (m,), the cube face (u0, u1, v0, v1, w0, w1) of each triangle.
    """

    layout: CubeLayout
    paths: list[IntArray]
    face_labels: IntArray


def choose_corners(mapped: Array) -> IntArray:
    """Return eight different vertices (8,), the farthest towards each corner P of the cube: argmax <v - A, P - A>."""
    from scipy.optimize import linear_sum_assignment

    reach = (mapped - 0.5) @ (CORNERS - 0.5).T  # (n, 8)
    candidates = np.unique(np.argsort(-reach, axis=0)[:8])
    rows, columns = linear_sum_assignment(-reach[candidates])
    return candidates[rows[np.argsort(columns)]]


def cut_surface(layout: CubeLayout, corners: IntArray, ridges: Ridges | None = None) -> CubeSurface:
    """Return a surface with places close to the cube's boundary, cut along paths between its corners, vertices (8,).

    ridges: those that paths follow where they lead the same way. Raises PathError where the paths do not bound
    six discs, which happens only far from a cube, or where the corners have the order of a mirrored cube.
    """
    cut = cut_along_rays(layout.places, layout.faces).laid_out(layout)
    paths = _trace_paths(cut, corners, ridges)
    labels = _patches(cut.faces, paths, corners)
    left = np.flatnonzero((directed_edges(cut.faces) == paths[0][:2]).all(axis=1))[0] // 3
    if labels[left] != 0:  # u0 lies to the left of the path from (0,0,0) to (0,0,1), seen from outside
        raise PathError("the corners are those of a mirrored cube: swap corners 0-3 with 4-7, or let them be chosen")
    return CubeSurface(cut, paths, labels)


def _trace_paths(cut: CubeLayout, corners: IntArray, ridges: Ridges | None) -> list[IntArray]:
    """Return disjoint paths along mesh edges, one for each cube edge.

    Where a path is blocked, all paths are traced again, and this path comes first.
    """
    edges = edge_table(cut.faces)[0]
    factors = np.ones(len(edges))
    order = list(range(len(EDGES)))
    if ridges is not None:
        factors[ridges.along(cut.points, edges)] = _FOLLOWED
        order.sort(key=lambda number: _share_aside(cut, edges, factors, corners, number))
    for _ in range(_ORDERS):
        paths, blocked = _trace_in_order(cut.places, edges, factors, corners, order)
        if blocked is None:
            return [paths[k] for k in range(len(EDGES))]
        order.remove(blocked)
        order.insert(0, blocked)
    i, j = EDGES[order[0]]
    raise PathError(f"no path left on the surface between cube corners {CORNERS[i]} and {CORNERS[j]}")


def _share_aside(cut: CubeLayout, edges: IntArray, factors: Array, corners: IntArray, number: int) -> float:
    """Return the share of one path, traced alone, that lies off all ridges.

    Paths that follow ridges are traced first: others would take the first piece of such a ridge on their way.
    """
    paths, _ = _trace_in_order(cut.places, edges, factors, corners, [number])
    if not paths:
        return 1.0
    steps = np.sort(np.stack([paths[number][:-1], paths[number][1:]], axis=1), axis=1)
    followed = edges[factors < 1.0]
    off = ~np.isin(steps @ [len(cut.points), 1], followed @ [len(cut.points), 1])
    lengths = np.linalg.norm(cut.points[steps[:, 1]] - cut.points[steps[:, 0]], axis=1)
    return float(lengths[off].sum() / lengths.sum())


def _trace_in_order(
    position: Array, edges: IntArray, factors: Array, corners: IntArray, order: list[int]
) -> tuple[dict[int, IntArray], int | None]:
    """Return the cheapest paths by edge number, and the first blocked edge; vertices off the cube edge cost more.

    factors: (e,), of the cost of the mesh's edges (e, 2).
    """
    length = np.linalg.norm(position[edges[:, 0]] - position[edges[:, 1]], axis=1)
    radial = 0.5 + project_radially(position - 0.5)
    free = np.ones(len(position), dtype=bool)
    free[corners] = False
    paths: dict[int, IntArray] = {}
    for number in order:
        i, j = EDGES[number]
        usable = free.copy()
        usable[corners[[i, j]]] = True
        keep = usable[edges].all(axis=1)
        stray = _distance_to_segment(radial, CORNERS[i], CORNERS[j])[edges[keep]].max(axis=1)
        cost = factors[keep] * (length[keep] + 1e-9) * (1.0 + _STRAY * stray / _STRAY_DISTANCE)
        a, b = edges[keep].T
        graph = coo_array((cost, (a, b)), shape=(len(position),) * 2).tocsr()
        _, previous = dijkstra(graph, directed=False, indices=corners[i], return_predecessors=True)
        path = [int(corners[j])]
        while path[-1] != corners[i]:
            if previous[path[-1]] < 0:
                return paths, number
            path.append(int(previous[path[-1]]))
        free[path] = False
        paths[number] = np.array(path[::-1])
    return paths, None


def _distance_to_segment(points: Array, start: Array, end: Array) -> Array:
    along = np.clip((points - start) @ (end - start), 0.0, 1.0)
    return np.linalg.norm(points - start - along[:, None] * (end - start), axis=1)


def _patches(faces: IntArray, paths: list[IntArray], corners: IntArray) -> IntArray:
    """Return the cube face (m,) of each triangle: the paths bound six patches, each identified by its four corners."""
    on_path = {tuple(sorted(pair)) for path in paths for pair in pairwise(path.tolist())}
    pairs, owners = edge_triangles(faces)
    open_sides = np.array([tuple(p) not in on_path for p in pairs.tolist()])
    patch = connected(owners[open_sides], len(faces))
    if patch.max() != 5:
        raise PathError(f"the edge paths bound {patch.max() + 1} patches, not 6")
    labels = np.full(6, -1)
    for k in range(6):
        inside = CORNERS[np.isin(corners, faces[patch == k])]
        if len(inside) != 4:
            raise PathError(f"a patch between the edge paths has {len(inside)} corners, not 4")
        axis = int(np.argmin(np.ptp(inside, axis=0)))
        labels[k] = face_number(axis, int(inside[0, axis]))
    if len(set(labels.tolist())) != 6:
        raise PathError("two patches belong to the same face of the cube")
    return np.asarray(labels[patch], dtype=np.int64)


def edge_targets(mapped: Array, paths: list[IntArray]) -> tuple[IntArray, Array, IntArray]:
    """Return path vertices (k,), their targets on the cube's edges by arc length (k, 3), neighbouring pairs (s, 2)."""
    targets = []
    for (i, j), path in zip(EDGES, paths, strict=True):
        steps = np.linalg.norm(np.diff(mapped[path], axis=0), axis=1)
        share = np.concatenate([[0.0], np.cumsum(steps)]) / max(steps.sum(), 1e-12)
        targets.append((1.0 - share)[:, None] * CORNERS[i] + share[:, None] * CORNERS[j])
    ends = np.cumsum([len(path) for path in paths]) - 1  # no vertex follows the last one of a path
    starts = np.delete(np.arange(ends[-1] + 1), ends)
    return np.concatenate(paths), np.concatenate(targets), np.stack([starts, starts + 1], axis=1)


def lay_out(layout: CubeLayout, corners: IntArray, ridges: Ridges | None = None) -> CubeLayout:
    """Return a layout without a flipped triangle: the surface is cut along paths, and its patches spread on the cube.

    layout: a layout with places close to the cube's boundary, which may be tangled. corners: (8,), vertices. ridges: as
    in `cut_surface`, which raises PathError.
    """
    surface = cut_surface(layout, corners, ridges)
    points, places = surface.layout.points, surface.layout.places
    path, target, _ = edge_targets(places, surface.paths)
    places[path] = target
    fixed = np.zeros(len(places), dtype=bool)
    fixed[path] = True
    pieces = []
    for face in range(6):
        patch = surface.layout.faces[surface.face_labels == face]
        edges, count = edge_table(patch)
        bridges = edges[
            (count == 2) & fixed[edges].all(axis=1)
        ]  # inner edges between fixed points: a triangle of three would be flat
        patch = split_edges(patch, bridges, len(points))
        points, places = (np.concatenate([x, x[bridges].mean(axis=1)]) for x in (points, places))
        fixed = np.concatenate([fixed, np.zeros(len(bridges), dtype=bool)])
        _spread(places, points, patch, fixed, face)
        pieces.append(patch)
    return CubeLayout(points, np.concatenate(pieces), places, layout.n_own)


def _spread(places: Array, points: Array, patch: IntArray, fixed: Mask, face: int) -> None:
    """Move the inner vertices of a patch, triangles (m, 3), to their cube face, in place."""
    axis, end = axis_and_side(face)
    plane = tangent_axes(axis)[:: 1 if end else -1]  # counter-clockwise seen from outside
    used, triangles = np.unique(patch, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    flat = places[used][:, plane]
    inner = ~fixed[used]
    weights = _combinations(flat, points[used], triangles)
    matrix = eye_array(int(inner.sum()), format="csc") - weights[inner][:, inner].tocsc()
    flat[inner] = splu(matrix).solve(weights[inner][:, ~inner] @ flat[~inner])
    places[used[inner][:, None], plane] = flat[inner]
    places[used[inner], axis] = end


def _combinations(flat: Array, points: Array, triangles: IntArray) -> csr_array:
    """Return the mean value coordinates (n, n): each row has the weights of a vertex's neighbours, which sum to 1.

    The coordinates are computed from the places (n, 2) where the triangles around the vertex do not overlap there, and
    otherwise from the triangles of the surface itself.
    """
    turned = np.zeros(len(flat), dtype=bool)
    ab, ac = (flat[triangles[:, k]] - flat[triangles[:, 0]] for k in (1, 2))
    turned[triangles[ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0] <= _FLAT]] = True
    rows, columns, values = [], [], []
    for k in range(3):
        here, *ends = (triangles[:, (k + shift) % 3] for shift in range(3))
        of_places, of_surface = (_half_tangents(x, here, *ends) for x in (flat, points))
        for end, by_places, by_surface in zip(ends, of_places, of_surface, strict=True):
            rows.append(here)
            columns.append(end)
            values.append(np.where(turned[here], by_surface, by_places))
    indices = (np.concatenate(rows), np.concatenate(columns))
    matrix = csr_array(coo_array((np.concatenate(values), indices), shape=(len(flat),) * 2))
    return csr_array(matrix.multiply(1.0 / matrix.sum(axis=1)[:, None]))


def _half_tangents(points: Array, i: IntArray, j: IntArray, k: IntArray) -> tuple[Array, Array]:
    """Return tan(angle / 2) at corner i, divided by the length of i-j and by the length of i-k."""
    to_j, to_k = points[j] - points[i], points[k] - points[i]
    length_j, length_k = (np.maximum(np.linalg.norm(d, axis=1), _TINY) for d in (to_j, to_k))
    cosine = (to_j * to_k).sum(axis=1) / (length_j * length_k)
    tangent = np.sqrt(np.maximum(1.0 - cosine, _TINY) / np.maximum(1.0 + cosine, _TINY))
    return tangent / length_j, tangent / length_k
