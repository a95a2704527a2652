"""Finds the regions between curves, and in which slabs each of them belongs to the body."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from .planar_graph import PlanarGraph
from .polygons import area_of, edges_of, inside_of

_ASIDE = 1e-3  # of a line's length: how far from it a point lies by which the side of the body is known


Loop = tuple[int, ...]  # nodes


@dataclass(frozen=True, eq=False)
class PlaneRegion:
    """A part of the plane between curves.

    Attributes
    ----------
    loops : tuple of tuples of int
        The nodes around it: the outer polygon counterclockwise, those around holes clockwise.
    solid : tuple of bool
        Of each slab whether the body fills it there.
    """

    loops: tuple[Loop, ...]
    solid: tuple[bool, ...]


def regions_of(network: PlanarGraph, profiles: Sequence[Sequence[Array]]) -> tuple[PlaneRegion, ...] | None:
    """Return the regions that belong to the body in some slab; None if a node is met twice by one loop.

    profiles: of each slab the polygons (k, 2) that bound it.
    """
    loops = _loops(network)
    if any(len(set(loop)) < len(loop) for loop in loops):
        return None
    outlines = [outline(network, loop) for loop in loops]
    areas = [area_of(row) for row in outlines]
    members = {k: [loops[k]] for k in range(len(loops)) if areas[k] > 0.0}
    for k in range(len(loops)):
        if areas[k] <= 0.0:
            point = network.nodes[list(loops[k])[:1]]
            around = [j for j in members if not set(loops[j]) & set(loops[k]) and inside_of([outlines[j]], point)[0]]
            if around:
                members[min(around, key=lambda j: areas[j])].append(loops[k])
    regions = []
    for k, own in members.items():
        a, b = outlines[k][:2]
        point = 0.5 * (a + b) + _ASIDE * np.array([a[1] - b[1], b[0] - a[0]])
        solid = tuple(bool(inside_of(profile, point[None])[0]) for profile in profiles)
        if any(solid):
            regions.append(PlaneRegion(tuple(own), solid))
    return tuple(regions)


def outline(network: PlanarGraph, loop: Loop) -> Array:
    """Return the polygon (k, 2) of the curves of a loop."""
    return np.concatenate([network.sides[edge].points[:-1] for edge in edges_of(loop)])


def _loops(network: PlanarGraph) -> list[Loop]:
    """Return the closed paths along curves, each with one region on its left."""
    leaving: dict[int, list[tuple[float, int]]] = {}
    for (a, b), curve in network.sides.items():
        along = curve.points[1] - curve.points[0]
        leaving.setdefault(a, []).append((float(np.arctan2(along[1], along[0])), b))
    turn = {a: [b for _, b in sorted(rows)] for a, rows in leaving.items()}
    left = {(a, b) for a, rows in turn.items() for b in rows}
    loops = []
    for start in sorted(left):
        if start not in left:
            continue
        path, step = [], start
        while step in left:
            left.remove(step)
            path.append(step[0])
            rows = turn[step[1]]
            step = step[1], rows[rows.index(step[0]) - 1]
        loops.append(tuple(path))
    return loops
