"""Gathers limbs that leave a flat part side by side, as fingers leave a palm, into a row at its end.

The curves of such limbs meet deep in the flat part, since it is thickest there, and blocks along them would span the
gaps between the limbs. In a row the limbs begin side by side at one node, where a single curve through the flat part,
the stem, ends. The block along the stem is as wide as the row, and is divided into strips, one for each limb.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray
from ...surface.geometry import connected
from ...surface.solid import Solid
from ..skeleton.graph import Branch, Skeleton, without_lone_nodes
from .frames import arc_lengths, at_lengths, tangents
from .splitting import End, branch_ends, stub

_NEAR = 5.0  # radii of the thicker node: junctions that are nearer are taken as one hub
_SIDE_BY_SIDE = 1.5  # radii of the hub: limbs of a row run on so far before a gap is between them
_ALIKE = 0.7  # the cosine of the angle between such limbs where the gap begins, at least
_BACK = 1.2  # radii of the hub: how far before the gap a limb is cut
_FEWEST = 3  # limbs of a row: one junction serves two
_SAMPLES = np.linspace(0.05, 0.95, 10)[:, None, None]  # places between two limbs where a gap is looked for
_EVEN = 1.75  # of the median distance of neighbours in a row: farther apart, they belong to different rows, as a thumb
_LEAST = 0.1  # radii of the hub: between a limb's root and where it is cut, at least
_STRAIGHTENINGS = 40  # of the curve that two become, where one has a kink
_POINTS, _FEWEST_POINTS = 15, 5  # of a stem; of a limb


@dataclass(frozen=True, eq=False)
class _Limb:
    """A limb: its branch end at the hub, its points (k, 3) outward, and the distances (k,) of these from the hub.

    A distance is straight from the deepest node to the limb's root, and then along the limb.
    """

    end: End
    points: Array
    along: Array

    def at(self, distance: float) -> Array:
        """Return the point (3,) at a distance from the hub."""
        return np.asarray(at_lengths(self.points, np.array([distance - self.along[0]]))[0])

    def part(self, begin: float, end: float, count: int | None = None) -> Array:
        """Return the points (count, 3) between two distances from the hub, evenly spaced, as densely as they are."""
        if count is None:
            share = (end - begin) / (self.along[-1] - self.along[0])
            count = max(round(len(self.points) * share), _FEWEST_POINTS)
        return at_lengths(self.points, np.linspace(begin, end, count) - self.along[0])


@dataclass(frozen=True, eq=False)
class LimbRow:
    """Limbs side by side at one node: the branch end of the stem, and those of the limbs in their order."""

    stem: End
    limbs: tuple[End, ...]


def with_rows(skeleton: Skeleton, body: Solid) -> tuple[Skeleton, dict[int, LimbRow]]:
    """Return the skeleton with the limbs that leave a flat part side by side in rows, and the rows by their nodes.

    The stem of a row ends at the node; the limbs begin beside it.
    """
    nodes = []
    for hub in _hubs(skeleton):
        while row := _row(_limbs(skeleton, hub), float(skeleton.radii[hub].max()), body):
            nodes.append(len(skeleton.nodes))
            skeleton = _with_row(skeleton, row, body)
        skeleton = _tidied(skeleton, hub, body) if nodes else skeleton
    numbers = np.searchsorted(np.flatnonzero(skeleton.degrees), nodes).tolist()
    skeleton = without_lone_nodes(skeleton)
    return skeleton, {node: _row_at(skeleton, node) for node in numbers}


def _row_at(skeleton: Skeleton, node: int) -> LimbRow:
    """Return the row at a node."""
    ends = branch_ends(skeleton, node)
    at_node = [np.array_equal(stub(skeleton.branches[number], end)[0], skeleton.nodes[node]) for number, end in ends]
    stem = ends[at_node.index(True)]
    return LimbRow(stem, tuple(end for end in ends if end != stem))


def _hubs(skeleton: Skeleton) -> list[IntArray]:
    """Return the junctions, those together that short branches join."""
    thick = np.array(skeleton.degrees) > 2
    hub = np.arange(len(thick))
    for branch in skeleton.branches:
        first, last = branch.ends
        if thick[first] and thick[last] and branch.length <= _NEAR * skeleton.radii[[first, last]].max():
            hub[hub == hub[last]] = hub[first]
    return [np.flatnonzero(hub == number) for number in np.unique(hub[thick])]


def _limbs(skeleton: Skeleton, hub: IntArray) -> list[_Limb]:
    """Return the limbs that leave a hub; their distances are those from its thickest node."""
    deep = skeleton.nodes[hub[np.argmax(skeleton.radii[hub])]]
    limbs = []
    for node in hub.tolist():
        for number, end in branch_ends(skeleton, node):
            branch = skeleton.branches[number]
            if skeleton.degrees[branch.ends[1 - end]] == 1:
                points = stub(branch, end)
                limbs.append(_Limb((number, end), points, np.linalg.norm(points[0] - deep) + arc_lengths(points)))
    return limbs


def _row(limbs: list[_Limb], radius: float, body: Solid) -> list[tuple[_Limb, float]]:
    """Return the limbs that leave a flat part side by side, in order, each with the distance at which it is cut.

    The list is empty where they are fewer than three. radius: that of the hub.
    """
    if len(limbs) < _FEWEST:
        return []
    gaps = np.array([[_gap(one, other, body) for other in limbs] for one in limbs])
    gaps = np.minimum(gaps, gaps.T)
    np.fill_diagonal(gaps, 0.0)
    roots = np.array([limb.along[0] for limb in limbs])
    beside = gaps - np.maximum(roots[:, None], roots) > _SIDE_BY_SIDE * radius
    part = connected(np.argwhere(beside), len(limbs))
    members = np.flatnonzero(part == np.bincount(part).argmax())
    if len(members) < _FEWEST:
        return []
    order = _in_order(limbs, members, gaps[np.ix_(members, members)])
    steps = gaps[order[:-1], order[1:]]
    cuts = np.maximum(np.append(steps[:1], steps), np.append(steps, steps[-1:])) - _BACK * radius
    cuts = np.maximum(cuts, roots[order] + _LEAST * radius)
    places = np.array([limbs[i].at(cut) for i, cut in zip(order, cuts, strict=True)])
    apart = np.linalg.norm(np.diff(places, axis=0), axis=1)
    linked = beside[order[:-1], order[1:]] & (apart <= _EVEN * np.median(apart))
    run = max(np.split(np.arange(len(order)), np.flatnonzero(~linked) + 1), key=len)
    return [(limbs[order[k]], float(cuts[k])) for k in run] if len(run) >= _FEWEST else []


def _gap(one: _Limb, other: _Limb, body: Solid) -> float:
    """Return how far from the hub the gap between a limb and another one begins; 0 for limbs that go different ways."""
    nearest = np.asarray(cKDTree(other.points).query(one.points)[1])
    between = one.points + _SAMPLES * (other.points[nearest] - one.points)  # (samples, k, 3)
    apart = np.flatnonzero(~body.contains(between).all(axis=0))
    last = max(apart[0] - 1, 0) if len(apart) else -1
    alike = float(tangents(one.points)[last] @ tangents(other.points)[nearest[last]])
    return float(one.along[last]) if alike > _ALIKE else 0.0


def _in_order(limbs: list[_Limb], members: IntArray, gaps: Array) -> IntArray:
    """Return the numbers of some of the limbs in the order in which they lie across the flat part.

    gaps: (n, n) how far from the hub the gaps between them begin.
    """
    outer = np.array([limbs[i].at(reach) for i, reach in zip(members, gaps.max(axis=1), strict=True)])
    across = np.linalg.svd(outer - outer.mean(axis=0))[2][0]
    return np.asarray(members[np.argsort(outer @ across)])


def _with_row(skeleton: Skeleton, row: list[tuple[_Limb, float]], body: Solid) -> Skeleton:
    """Return the skeleton with a new node, the last one, at which the limbs of a row begin where they are cut."""
    new = len(skeleton.nodes)
    place = np.mean([limb.at(distance) for limb, distance in row], axis=0)
    ends = [skeleton.branches[limb.end[0]].ends[:: -1 if limb.end[1] else 1] for limb, _ in row]  # root and tip
    roots = [root for root, _ in ends]
    root = max(sorted(set(roots)), key=roots.count)
    inner = [limb.part(limb.along[0], distance, _POINTS) for limb, distance in row]
    stem = np.mean([part for part, own in zip(inner, roots, strict=True) if own == root], axis=0)
    stem = stem + np.linspace(0.0, 1.0, _POINTS)[:, None] * (place - stem[-1])
    stem[-1] = place
    cut = {limb.end[0] for limb, _ in row}
    kept = [branch for number, branch in enumerate(skeleton.branches) if number not in cut]
    kept.append(_curve((root, new), stem, body))
    nodes, radii = np.vstack([skeleton.nodes, place]), np.append(skeleton.radii, body.depths(place[None]))
    for (limb, distance), (_, tip) in zip(row, ends, strict=True):
        kept.append(_curve((new, tip), limb.part(distance, limb.along[-1]), body))
    return replace(skeleton, nodes=nodes, radii=radii, branches=tuple(kept))


def _curve(ends: tuple[int, int], points: Array, body: Solid) -> Branch:
    return Branch(ends, points, body.depths(points))


def _tidied(skeleton: Skeleton, hub: IntArray, body: Solid) -> Skeleton:
    """Return the skeleton without the nodes of a hub at which one branch ends, or two, which become one."""
    for node in (*hub.tolist(), *hub.tolist()):  # what goes at one node may leave another one with two
        ends = branch_ends(skeleton, node)
        numbers = {number for number, _ in ends}
        others = [branch for number, branch in enumerate(skeleton.branches) if number not in numbers]
        if len(numbers) == 2 == len(ends):
            (one, first), (two, second) = ends
            curves = stub(skeleton.branches[one], first)[::-1], stub(skeleton.branches[two], second)[1:]
            far = skeleton.branches[one].ends[1 - first], skeleton.branches[two].ends[1 - second]
            others.append(_curve(far, _straightened(np.concatenate(curves)), body))
        if len(ends) <= 2 and len(numbers) == len(ends):
            skeleton = replace(skeleton, branches=tuple(others))
    return skeleton


def _straightened(points: Array) -> Array:
    """Return a curve (k, 3) between the same ends, evenly spaced and with fewer bends."""
    for _ in range(_STRAIGHTENINGS):
        points = at_lengths(points, np.linspace(0.0, arc_lengths(points)[-1], len(points)))
        points[1:-1] = 0.25 * (points[:-2] + 2.0 * points[1:-1] + points[2:])
    return points
