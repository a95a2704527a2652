"""Contracts the nodes of a graph that are near each other, and divides those with too many arcs."""

import numpy as np

from ...arrays import Array
from .lattice import Depth
from .web import Arc, Key, Web, length_of

MOST = 6  # arcs at a node: the faces of the block that is laid there
NEAR = 1.0  # radii of the thicker node: the blocks of two nodes that are nearer would overlap
STUB = 1.3  # radii of the junction: an end that reaches less far is a bump on the block there


def contract(web: Web, depth: Depth) -> None:
    """Contract arcs between two junctions that are shorter than the radius of the thicker one; loops stay."""
    while True:
        short = [(share, i) for i, arc in enumerate(web.arcs) if (share := _shortness(arc, web, depth)) < 1.0]
        if not short:
            return
        _contract(web, web.arcs[min(short)[1]], depth)


def _shortness(arc: Arc, web: Web, depth: Depth) -> float:
    """Return the length of an arc over that under which it is contracted, infinity for one that must stay."""
    degrees = web.degree(arc.first), web.degree(arc.last)
    if arc.first == arc.last or min(degrees) < 3 or sum(degrees) - 2 > MOST:
        return float("inf")
    radius = max(depth.at(arc.path[[0, -1]]).max(), 1.0)
    return length_of(arc.path) / (NEAR * float(radius))


def _contract(web: Web, arc: Arc, depth: Depth) -> None:
    """Move the arcs at the thinner end of an arc to its thicker end, along it."""
    first, last = depth.at(arc.path[[0, -1]])
    kept, gone = (arc.first, arc.last) if first >= last else (arc.last, arc.first)
    stub = arc.from_node(kept)
    web.arcs = [other for other in web.arcs if other is not arc]
    for other in web.arcs_at(gone):
        path = other.from_node(gone)
        if other.first == other.last:
            moved = Arc(kept, kept, np.concatenate([stub, path[1:], stub[-2::-1]]))
        else:
            moved = Arc(kept, other.other(gone), np.concatenate([stub, path[1:]]))
        web.arcs[next(i for i, own in enumerate(web.arcs) if own is other)] = moved
    del web.nodes[gone]


def drop_stubs(web: Web, depth: Depth) -> None:
    """Take away ends that hardly stick out of the ball around their junction, such as the deepest point itself."""
    while True:
        stubs = [arc for arc in web.arcs if _sticks_out(arc, web, depth) < STUB]
        if not stubs:
            return
        stub = min(stubs, key=lambda arc: length_of(arc.path))
        end = stub.first if web.degree(stub.first) == 1 else stub.last
        web.arcs = [arc for arc in web.arcs if arc is not stub]
        del web.nodes[end]
        web.dissolve()


def _sticks_out(arc: Arc, web: Web, depth: Depth) -> float:
    """Return how far the ball at an end reaches, over the radius of its junction; infinite for arcs that must stay."""
    if sorted(min(web.degree(key), 3) for key in (arc.first, arc.last)) != [1, 3]:
        return float("inf")
    path = arc.from_node(arc.first if web.degree(arc.first) == 1 else arc.last)
    end, junction = depth.at(path[[0, -1]])
    return float((np.linalg.norm(path[0] - path[-1]) + end) / max(junction, 1.0))


def divide(web: Web, depth: Depth) -> None:
    """Divide nodes of more than six arcs: a part of the arcs begins one radius away, along the thickest of them."""
    for node in list(web.nodes):
        while web.degree(node) > MOST:
            _divide(web, node, depth)


def _divide(web: Web, node: Key, depth: Depth) -> None:
    """Move as many arcs as a node may have, less two, to a new node on one of the arcs."""
    radius = max(float(depth.at(web.nodes[node][None])[0]), 2.0)
    stems = [arc for arc in web.arcs_at(node) if arc.first != arc.last]
    stems = [arc for arc in stems if length_of(arc.path) > 2.0 * radius] or stems
    stem = max(stems, key=lambda arc: float(np.median(depth.at(arc.path))))
    path = stem.from_node(node)
    cut = _at_distance(path, radius)
    new = web.add_node(path[cut])
    others = [arc for arc in web.arcs_at(node) if arc.first != arc.last and arc is not stem]
    others.sort(key=lambda arc: -_along(arc.from_node(node), radius, path[cut] - path[0]))
    moved = others[: max(min(web.degree(node) - MOST + 1, MOST - 2), 1)]
    kept = [arc for arc in web.arcs if all(arc is not gone for gone in [stem, *moved])]
    parts = [Arc(node, new, path[: cut + 1]), Arc(new, stem.other(node), path[cut:])]
    # Both ends of the first, straight step of a moved arc lie in the ball around the node, which is inside the body.
    outer = [(arc.other(node), arc.from_node(node)) for arc in moved]
    parts += [Arc(new, other, np.vstack([path[cut], curve[_at_distance(curve, radius) :]])) for other, curve in outer]
    web.arcs = kept + parts


def _at_distance(path: Array, radius: float) -> int:
    """Return the number of the first inner point of a path that is farther than a radius from its begin."""
    away = np.linalg.norm(path - path[0], axis=1) > radius
    return min(int(np.argmax(away)) if away.any() else len(path) // 2, len(path) - 2)


def _along(path: Array, radius: float, direction: Array) -> float:
    """Return how far a path has gone along a direction when it leaves a ball around its begin."""
    return float((path[_at_distance(path, radius)] - path[0]) @ direction)
