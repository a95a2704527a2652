"""Thins the lattice points of a body to curves, and reads these as a graph.

The thinning keeps the topology: T. C. Lee, R. L. Kashyap, C. N. Chu, Building skeleton models via 3-D medial
surface/axis thinning algorithms, CVGIP 56, 1994.
"""

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray, Mask
from ...surface.geometry import connected
from .web import Arc, Web

_NEIGHBOUR = 1.8  # cells: more than the diagonal of a cell, less than two cells
_AROUND_A_CORNER = 6  # points of a path that leaves a knot of points and returns to it at once: no loop of the body


def web_of(inside: Mask) -> Web:
    """Return the curves to which the points inside are thinned.

    Points with more than two neighbours that touch each other form one knot, whose middle point is the node.
    """
    from skimage.morphology import skeletonize

    points = np.argwhere(skeletonize(inside))
    pairs = cKDTree(points).query_pairs(_NEIGHBOUR, output_type="ndarray").astype(np.int64)
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    neighbours: list[list[int]] = [[] for _ in points]
    for i, j in pairs.tolist():
        neighbours[i].append(j)
        neighbours[j].append(i)
    web = Web()
    node = _nodes(points, pairs, web)
    passed: set[tuple[int, int]] = set()
    for start in node:
        for second in neighbours[start]:
            if (start, second) in passed or node.get(second) == node[start]:
                continue
            path = _followed([start, second], node, neighbours)
            passed |= {(path[0], path[1]), (path[-1], path[-2])}
            first, last = node[path[0]], node[path[-1]]
            if first == last and path[0] != path[-1] and len(path) < _AROUND_A_CORNER:
                continue
            curve = [web.nodes[first], *points[path], web.nodes[last]]
            web.arcs.append(Arc(first, last, _without_repeats(np.array(curve, dtype=np.float64))))
    return web


def _nodes(points: IntArray, pairs: IntArray, web: Web) -> dict[int, int]:
    """Add the nodes to a web, and return the node of each point that belongs to one."""
    degree = np.bincount(pairs.ravel(), minlength=len(points))
    tight = (degree > 2)[pairs].all(axis=1)
    knots = connected(pairs[tight], len(points))
    node: dict[int, int] = {}
    for knot in np.unique(knots[degree > 2]):
        members = np.flatnonzero(knots == knot)
        middle = points[members].mean(axis=0)
        nearest = members[np.argmin(((points[members] - middle) ** 2).sum(axis=1))]
        node.update(dict.fromkeys(members.tolist(), web.add_node(points[nearest])))
    for end in np.flatnonzero(degree < 2).tolist():
        node[end] = web.add_node(points[end])
    pieces = connected(pairs, len(points))
    circles = set(pieces.tolist()) - set(pieces[list(node)].tolist())
    for circle in sorted(circles):
        first = int(np.flatnonzero(pieces == circle)[0])
        node[first] = web.add_node(points[first])
    return node


def _followed(path: list[int], node: dict[int, int], neighbours: list[list[int]]) -> list[int]:
    """Return the path continued to the next node."""
    while path[-1] not in node:
        path.append(next(i for i in neighbours[path[-1]] if i != path[-2]))
    return path


def _without_repeats(path: Array) -> Array:
    """Return the path without points that repeat the one before; a loop keeps its two ends."""
    moves = np.any(path[1:] != path[:-1], axis=1)
    return path[np.concatenate([[True], moves])]
