"""Turns the paths through lattice points into smooth curves in the middle of the body, with evenly spaced points."""

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array

from ...arrays import Array, IntArray
from .lattice import Depth
from .web import Arc, Web, length_of

SPACING = 1.0  # cells between the points of a curve
FEWEST, FEWEST_OF_LOOP = 5, 13  # points: a polygon of fewer would leave no room for what a loop surrounds
STEPS = (10, 400)  # least and most: one step smooths over one cell, so the radius squared of them over a radius
CENTERING = 0.25  # cells a step, uphill: half a cell would leap across the middle of the body and back
HELD = 0.7  # of its first depth at least is what a point keeps: no curve cuts a corner out of the body


def smoothed(web: Web, depth: Depth) -> Web:
    """Return the web with curves that are averaged over about one radius, in the middle of the body.

    The tips of limbs move across their curves alone: no limb gets shorter.
    """
    if not web.arcs:
        return web
    points, parts = _numbered(web)
    average = _averages(parts, len(points))
    ahead, behind = _along(parts, len(points))
    tips = np.bincount(np.concatenate([part[[0, -1]] for part in parts]), minlength=len(points)) == 1
    floor = HELD * depth.at(points)
    for _ in range(int(np.clip(np.median(depth.at(points)) ** 2, *STEPS))):
        tangent = points[ahead] - points[behind]
        tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
        uphill = depth.uphill(points)
        moved = np.where(tips[:, None], points, average @ points)
        moved += CENTERING * (uphill - (uphill * tangent).sum(axis=1, keepdims=True) * tangent)
        allowed = depth.at(moved) >= np.minimum(floor, depth.at(points))
        points = np.where(allowed[:, None], moved, points)
    nodes = dict(zip(web.nodes, points, strict=False))
    curves = [evenly(points[part], len(part)) for part in parts]
    return Web(nodes, [Arc(arc.first, arc.last, curve) for arc, curve in zip(web.arcs, curves, strict=True)])


def evenly(path: Array, count: int) -> Array:
    """Return so many points on a path (k, 3), evenly spaced along it, its ends included."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(wanted, along, column) for column in path.T], axis=1)


def _numbered(web: Web) -> tuple[Array, list[IntArray]]:
    """Return the points (n, 3) of nodes and of the insides of arcs, evenly spaced, and the numbers along each arc."""
    number = {key: i for i, key in enumerate(web.nodes)}
    points, parts, total = [np.array(list(web.nodes.values()))], [], len(number)
    for arc in web.arcs:
        fewest = FEWEST_OF_LOOP if arc.first == arc.last else FEWEST
        path = evenly(arc.path, max(round(length_of(arc.path) / SPACING) + 1, fewest))
        inner = np.arange(total, total + len(path) - 2)
        parts.append(np.concatenate([[number[arc.first]], inner, [number[arc.last]]]))
        points.append(path[1:-1])
        total += len(inner)
    return np.concatenate(points), parts


def _averages(parts: list[IntArray], count: int) -> csr_array:
    """Return the matrix (n, n) that takes the mean of each point and the mean of its neighbours."""
    first, second = np.concatenate([np.stack([part[:-1], part[1:]]) for part in parts], axis=1)
    both = np.concatenate([first, second]), np.concatenate([second, first])
    links = csr_array(coo_array((np.ones(len(both[0])), both), shape=(count, count)))
    neighbours = np.bincount(both[0], minlength=count)
    return csr_array(0.5 * (diags_array(np.ones(count)) + diags_array(1.0 / np.maximum(neighbours, 1)) @ links))


def _along(parts: list[IntArray], count: int) -> tuple[IntArray, IntArray]:
    """Return the next and the last point (n,) of each point; of a junction both are itself: it moves in all directions.

    At a node with one arc one of them is the node: its tangent is that of the arc.
    """
    ahead, behind = np.arange(count), np.arange(count)
    degree = np.bincount(np.concatenate([part[[0, -1]] for part in parts]), minlength=count)
    for part in parts:
        inner = part[1:-1]
        ahead[inner], behind[inner] = part[2:], part[:-2]
        if degree[part[0]] == 1:
            ahead[part[0]] = part[1]
        if degree[part[-1]] == 1:
            behind[part[-1]] = part[-2]
    return ahead, behind
