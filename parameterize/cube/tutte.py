"""A first layout of the surface on the cube without a single flipped triangle.

The surface is cut along the 12 edge paths. Each of the six patches is a disc whose rim goes to the sides of a square;
with every inner vertex a convex combination of its neighbours the map onto that square is one-to-one (Tutte 1963;
Floater, Math. Comp. 72, 2003). The combinations reproduce the network's places wherever those are one-to-one already.
"""

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array
from scipy.sparse.linalg import splu

from ..arrays import Array, IntArray, Mask
from ..config import LAYOUT, LayoutConfig
from ..surface.geometry import edge_table
from .cube import axis_and_side, tangent_axes
from .cutting import split_edges
from .edge_paths import cut_surface, edge_targets
from .flips import Layout

_FLAT = 1e-12  # area of a triangle on the square that counts as turned over
_TINY = 1e-12


def lay_out(
    mapped: Array, vertices: Array, faces: IntArray, corners: IntArray, layout: LayoutConfig = LAYOUT
) -> Layout:
    """Cut the surface (n, 3) along the paths that the mapped one (n, 3) suggests; lay its patches out on the cube."""
    surface = cut_surface(mapped, faces, corners, layout)
    vertices, places = surface.cut.carry(vertices), surface.cut.carry(mapped)
    path, target, _ = edge_targets(places, surface.paths)
    places[path] = target
    fixed = np.zeros(len(places), dtype=bool)
    fixed[path] = True
    pieces = []
    for face in range(6):
        patch = surface.cut.faces[surface.face_labels == face]
        bridges = _bridges(patch, fixed)
        patch = split_edges(patch, bridges, len(vertices))
        vertices, places = (np.concatenate([x, x[bridges].mean(axis=1)]) for x in (vertices, places))
        fixed = np.concatenate([fixed, np.zeros(len(bridges), dtype=bool)])
        _spread(places, vertices, patch, fixed, face)
        pieces.append(patch)
    return Layout(vertices, np.concatenate(pieces), places)


def _bridges(patch: IntArray, fixed: Mask) -> IntArray:
    """Return the inner edges (k, 2) between two vertices of the rim: a triangle of such edges could end up flat."""
    edges, count = edge_table(patch)
    return edges[(count == 2) & fixed[edges].all(axis=1)]


def _spread(places: Array, vertices: Array, patch: IntArray, fixed: Mask, face: int) -> None:
    """Put the inner vertices of a patch (m, 3) on their cube face, in place."""
    axis, end = axis_and_side(face)
    plane = tangent_axes(axis)[:: 1 if end else -1]  # counter-clockwise seen from outside
    used, triangles = np.unique(patch, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    flat = places[used][:, plane]
    inner = ~fixed[used]
    weights = _combinations(flat, vertices[used], triangles)
    matrix = eye_array(int(inner.sum()), format="csc") - weights[inner][:, inner].tocsc()
    flat[inner] = splu(matrix).solve(weights[inner][:, ~inner] @ flat[~inner])
    places[used[inner][:, None], plane] = flat[inner]
    places[used[inner], axis] = end


def _combinations(flat: Array, vertices: Array, triangles: IntArray) -> csr_array:
    """Return the mean value coordinates of each vertex, (n, n): the weights of its neighbours, which sum to 1.

    They are computed from the places (n, 2) where the triangles around the vertex do not overlap there, and otherwise
    from the triangles of the surface itself.
    """
    turned = np.zeros(len(flat), dtype=bool)
    ab, ac = (flat[triangles[:, k]] - flat[triangles[:, 0]] for k in (1, 2))
    turned[triangles[ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0] <= _FLAT]] = True
    rows, columns, values = [], [], []
    for k in range(3):
        here, *ends = (triangles[:, (k + shift) % 3] for shift in range(3))
        of_places, of_surface = (_half_tangents(points, here, *ends) for points in (flat, vertices))
        for end, by_places, by_surface in zip(ends, of_places, of_surface, strict=True):
            rows.append(here)
            columns.append(end)
            values.append(np.where(turned[here], by_surface, by_places))
    indices = (np.concatenate(rows), np.concatenate(columns))
    matrix = csr_array(coo_array((np.concatenate(values), indices), shape=(len(flat),) * 2))
    return csr_array(matrix.multiply(1.0 / matrix.sum(axis=1)[:, None]))


def _half_tangents(points: Array, i: IntArray, j: IntArray, k: IntArray) -> tuple[Array, Array]:
    """Return tan(angle / 2) at corner i, divided by the length of i-j and by that of i-k."""
    to_j, to_k = points[j] - points[i], points[k] - points[i]
    length_j, length_k = (np.maximum(np.linalg.norm(d, axis=1), _TINY) for d in (to_j, to_k))
    cosine = (to_j * to_k).sum(axis=1) / (length_j * length_k)
    tangent = np.sqrt(np.maximum(1.0 - cosine, _TINY) / np.maximum(1.0 + cosine, _TINY))
    return tangent / length_j, tangent / length_k
