"""Adds the limbs of a body to the graph of its loops: a curve from each limb's tip through the thick of the body."""

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray
from .lattice import Depth
from .protrusions import protrusions
from .web import Arc, Web, length_of

LEAST = 0.25  # at volume 1: a limb that is shorter is pulled out of its block's face, as a bump is
PASSES = 3  # a limb of a limb that is as wide as its siblings together is found when these have their curves
JOINS = 0.7  # of a point's distance from the surface: a curve that comes so near to another one ends there
TOUCHES = 0.85  # of the distance from a limb's end: the ball around the last point reaches the end, up to cells
BLUNT = 1.0 / 3.0  # of the limb's median radius: thinner points at a tapering end are left out
_SLACK = 1.0  # cells: the distances of lattice points from the surface are that uncertain
_SHALLOWEST = 0.3  # cells: a path may run along the surface, at a price that is finite


def add_limbs(web: Web, depth: Depth, cell: float) -> None:
    """Add a node at each limb's tip and the arc that leads there; a body without loops begins at its deepest point."""
    if not web.nodes:
        web.add_node(depth.deepest())
    for _ in range(PASSES):
        before = len(web.nodes)
        _add_found(web, depth, LEAST / cell)
        if len(web.nodes) == before:
            break
    web.dissolve()


def _add_found(web: Web, depth: Depth, least: float) -> None:
    """Add the limbs that stick out from the web as it is, of at least this length in cells."""
    from skimage.graph import MCP_Geometric

    distance = MCP_Geometric(np.where(depth.inside, 1.0, -1.0)).find_costs(_in_balls(web, depth).tolist())[0]
    limbs = protrusions(depth.inside, distance, least)
    if not limbs:
        return
    core = np.unique(np.rint(web.points()).astype(np.int64), axis=0)
    thick = MCP_Geometric(np.where(depth.inside, np.maximum(depth.values, _SHALLOWEST) ** -2.0, -1.0))
    thick.find_costs(core[depth.inside[tuple(core.T)]].tolist())
    for limb in limbs:
        path = np.array(thick.traceback(limb.tip), dtype=np.float64)[::-1]  # from the tip
        _attach(web, _joined(path, web, depth), depth)


def _in_balls(web: Web, depth: Depth) -> IntArray:
    """Return the points inside (k, 3) in the balls around the points of the web that touch the surface."""
    points, inside = web.points(), np.argwhere(depth.inside)
    gaps, nearest = (np.asarray(found) for found in cKDTree(points).query(inside))
    return inside[gaps <= depth.at(points)[nearest]]


def _joined(path: Array, web: Web, depth: Depth) -> Array:
    """Return the path as far as the first point from which a point of the web is near, and on to that point."""
    points = web.points()
    gaps, nearest = (np.asarray(found) for found in cKDTree(points).query(path))
    near = gaps <= JOINS * depth.at(path)
    near[-1] = True  # the path ends beside the web
    first = int(np.argmax(near))
    steps = np.linspace(0.0, 1.0, max(int(np.ceil(gaps[first])), 1) + 1)[1:, None]
    end = points[nearest[first]]
    tail = path[first] + steps[:-1] * (end - path[first])
    return np.concatenate([path[: first + (gaps[first] > 0.0)], tail, end[None]])


def _attach(web: Web, path: Array, depth: Depth) -> None:
    """Add the arc from a limb's tip, whose path begins at the surface, to a point of the web."""
    path = path[_begin(path, depth.at(path)) :]
    if len(path) > 1 and length_of(path) > depth.at(path[:1])[0]:
        root = web.node_at(path[-1])
        web.arcs.append(Arc(web.add_node(path[0]), root, path))


def _begin(path: Array, radii: Array) -> int:
    """Return the number of the point of a path that is about one radius from the limb's end, where the path begins."""
    gaps = np.linalg.norm(path - path[0], axis=1)
    apart = np.append(radii + _SLACK < TOUCHES * gaps, True)
    thick = radii >= BLUNT * np.median(radii[: len(path) // 2 + 1])
    return max(int(np.argmax(apart)) - 1, int(np.argmax(thick)))
