"""Merges neighbouring junctions whose branches fit one cube: one block instead of two with a short rod between.

Of 29 shapes six have such junctions. Without merging no start fits into an octopus, and a lattice cell's blocks meet
themselves; a triple torus has 10 blocks instead of 6. Where it is not needed it costs some distortion: two thick graphs
have 0.89 and 0.98 times as much without it.
"""

from dataclasses import replace

import numpy as np

from ...surface.solid import Solid
from ..skeleton.graph import Branch, Skeleton, without_lone_nodes
from .frames import at_lengths
from .splitting import MOST, branch_ends, junction_at, led_to

_SHORT = 2.0  # radii of the thicker node: the length of a branch that may be taken out
_TIGHT_FIT = np.radians(40.0)  # where there are more than four: the same for these
_AROUND = 4  # branches around a cube: their angles may be large as long as their order is right
_CLOSE = 1.2  # radii: a branch so short leaves no room for two blocks; where one does not serve, the node is split anew
_CROWD = 8  # branches at a node, at most
_LOOP = 4.0  # lengths of the branch that is taken out: what another one between its nodes has, to become a loop
_FIT = np.radians(50.0)  # between a branch and its face's normal, at most, at the node that takes the place of two


def merge(skeleton: Skeleton, body: Solid) -> Skeleton:
    """Return a skeleton of the same body with fewer junctions; the number of loops stays."""
    while True:
        lengths = {
            k: branch.length / float(skeleton.radii[list(branch.ends)].max())
            for k, branch in enumerate(skeleton.branches)
            if _joins_two_junctions(skeleton, branch)
        }
        short = sorted((length, k) for k, length in lengths.items() if length <= _SHORT)
        better = next((one for length, k in short if (one := _merged(skeleton, k, length, body))), None)
        if better is None:
            return skeleton
        skeleton = better


def _merged(skeleton: Skeleton, number: int, length: float, body: Solid) -> Skeleton | None:
    """Return the skeleton with both nodes of a branch made one; None where the other branches do not fit it.

    length: of the branch, in radii of its nodes.
    """
    merged = _contracted(skeleton, number)
    node = len(merged.nodes) - 1
    ends = branch_ends(merged, node)
    if len(ends) > _CROWD or not all(body.contains(merged.branches[i].points).all() for i, _ in ends):
        return None
    limit = _FIT if len(ends) <= _AROUND else _TIGHT_FIT
    fits = len(ends) <= MOST and float(junction_at(merged, node)[1].angles.max()) <= limit
    return merged if fits or length <= _CLOSE else None


def _joins_two_junctions(skeleton: Skeleton, branch: Branch) -> bool:
    """Return whether a branch joins two nodes of three branches or more, and no other short one joins them, too."""
    first, last = branch.ends
    twins = [other.length for other in skeleton.branches if set(other.ends) == {first, last}]
    alone = sum(length < _LOOP * branch.length for length in twins) == 1
    return first != last and alone and min(skeleton.degrees[first], skeleton.degrees[last]) > 2


def _contracted(skeleton: Skeleton, number: int) -> Skeleton:
    """Return the skeleton without a branch: both its nodes become one, the last, at the middle of the branch."""
    branch = skeleton.branches[number]
    place = at_lengths(branch.points, np.array([0.5 * branch.length]))[0]
    radius = float(np.interp(0.5, np.linspace(0.0, 1.0, len(branch.radii)), branch.radii))
    new, branches = len(skeleton.nodes), list(skeleton.branches)
    for node in branch.ends:
        for i, end in branch_ends(skeleton, node):
            branches[i] = led_to(branches[i], end, new, place, skeleton.nodes[node])
    del branches[number]
    nodes, radii = np.concatenate([skeleton.nodes, place[None]]), np.append(skeleton.radii, radius)
    return without_lone_nodes(replace(skeleton, nodes=nodes, radii=radii, branches=tuple(branches)))
