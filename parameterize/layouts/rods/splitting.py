"""Gives each branch at a node a face of a cube, and splits nodes whose branches one cube cannot serve into two."""

from collections.abc import Container
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from ...arrays import Array, IntArray, Mask
from ...surface.solid import Solid
from ..skeleton.graph import Branch, Skeleton
from .frames import arc_lengths, at_lengths, unit

_SKEW = np.radians(48.0)  # between a branch and the normal of its face: above, a junction is split where that helps
_GAIN = np.radians(5.0)  # that the split lowers the largest angle by, at least
_MUCH = np.radians(20.0)  # as much helps five branches or more at any angle: six in a plane fit a cube on its corner
_REACH = 1.5  # radii of a node at which its branches' directions are taken: beyond the ball that they share
_APART = 0.5  # of the room on either side: where the two nodes of a split lie
_ROOM = 2.0  # radii of a node: no room is taken for larger, so that a plate's nodes stay near their branches
_ROUNDINGS = 10  # of a branch that is led to another node, where it has a kink

End = tuple[int, int]  # the number of a branch, and 0 for its first end, 1 for its last
NORMALS = np.array([sign * np.eye(3)[axis] for axis in range(3) for sign in (-1.0, 1.0)])  # of u0, u1, v0, v1, w0, w1
MOST = len(NORMALS)  # branches at one junction


@dataclass(frozen=True, eq=False)
class Assignment:
    """The faces of a cube through which branches leave it.

    Attributes
    ----------
    faces : (d,) array of int
        The number of the face of each branch, in the order u0, u1, v0, v1, w0, w1.
    axes : (3, 3) array
        The directions of u, v and w in space, one a row: orthonormal and right-handed.
    angles : (d,) array
        Between each branch and the outward normal of its face, in radians.
    """

    faces: IntArray
    axes: Array
    angles: Array


def assigned(directions: Array) -> Assignment:
    """Return the assignment whose squared angles have the least sum, for unit vectors (d, 3), 2 <= d <= 6.

    Every assignment is tried, the first branch at u0, since turns of the cube are free; its best turn is that of
    Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32 (1976).
    """
    rest = permutations(range(1, MOST), len(directions) - 1)
    faces = np.array([(0, *others) for others in rest])  # (k, d)
    left, _, right = np.linalg.svd(np.einsum("kda,db->kab", NORMALS[faces], directions))
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    axes = left @ right  # (k, 3, 3): row a is the direction of parameter a
    cosines = np.einsum("kda,kab,db->kd", NORMALS[faces], axes, directions)
    angles = np.arccos(np.clip(cosines, -1.0, 1.0))
    best = int(np.argmin((angles**2).sum(axis=1).round(9)))
    return Assignment(faces[best], axes[best], angles[best])


def split(skeleton: Skeleton, body: Solid, rows: Container[int] = ()) -> Skeleton:
    """Return a skeleton of the same body whose nodes have at most six branches, in directions that fit a cube.

    rows: the nodes that stay as they are, because they get no cube.
    """
    node = 0
    while node < len(skeleton.nodes):
        ends = branch_ends(skeleton, node)
        group = _group(skeleton, node, ends, body) if len(ends) > 3 and node not in rows else ()
        if group:
            skeleton = _parted(skeleton, node, ends, group, body)
        else:
            node += 1
    return skeleton


def branch_ends(skeleton: Skeleton, node: int) -> list[End]:
    """Return the branch ends at a node; a loop has both of its ends there."""
    return [(i, end) for i, branch in enumerate(skeleton.branches) for end in (0, 1) if branch.ends[end] == node]


def stub(branch: Branch, end: int) -> Array:
    """Return the points (k, 3) of a branch from one of its ends on."""
    return branch.points[:: -1 if end else 1]


def directions(skeleton: Skeleton, node: int, ends: list[End]) -> Array:
    """Return the unit vectors (d, 3) in which branches leave a node, taken beyond the ball that they share."""
    center = skeleton.nodes[node]
    rows = []
    for i, end in ends:
        points = stub(skeleton.branches[i], end)
        far = _REACH * skeleton.radii[node]
        inner = points[: max(2, (len(points) + 1) // 2)]
        beyond = np.flatnonzero(np.linalg.norm(inner - center, axis=1) >= far)
        rows.append(inner[beyond[0] if len(beyond) else -1] - center)
    return unit(np.array(rows))


def junction_at(skeleton: Skeleton, node: int) -> tuple[list[End], Assignment]:
    """Return the branch ends at a node, and the faces of a cube that they are given."""
    ends = branch_ends(skeleton, node)
    return ends, assigned(directions(skeleton, node, ends))


def _group(skeleton: Skeleton, node: int, ends: list[End], body: Solid) -> tuple[int, ...]:
    """Return which of the branch ends, by their places in the list, leave a second node: () where one serves all."""
    ways = directions(skeleton, node, ends)
    worst = float(assigned(ways).angles.max()) if len(ends) <= MOST else np.inf
    gain = _GAIN if worst > _SKEW else _MUCH if len(ends) > 4 else np.inf
    if gain >= worst:
        return ()
    best: tuple[float, tuple[int, ...]] = (worst - gain, ())
    for size in range(2, len(ends) // 2 + 1):
        for group in combinations(range(len(ends)), size):
            if 2 * size == len(ends) and 0 not in group:
                continue  # the other half of a pair that was tried
            skew = _skew_of(_parted(skeleton, node, ends, group, body), (node, len(skeleton.nodes)))
            best = min(best, (skew + _mixed(ways, group), group))
    return best[1]


def _mixed(ways: Array, group: tuple[int, ...]) -> float:
    """Return pi where no plane between the two nodes parts the directions of a group from the others, else 0.

    Branches of the two nodes would then run into each other.
    """
    chosen, axis = _axis(ways, group)
    heights = ways @ axis
    return 0.0 if heights[chosen].min() > heights[~chosen].max() else np.pi


def _axis(ways: Array, group: tuple[int, ...]) -> tuple[Mask, Array]:
    """Return which directions (d, 3) belong to a group, and the unit vector (3,) from the others' mean to theirs."""
    chosen = np.isin(np.arange(len(ways)), group)
    axis = unit(ways[chosen].mean(axis=0) - ways[~chosen].mean(axis=0))
    return chosen, axis if axis.any() else np.eye(3)[0]


def _skew_of(skeleton: Skeleton, nodes: tuple[int, int]) -> float:
    """Return the largest angle at two nodes; more than six branches at one weigh more than any angle."""
    skew = 0.0
    for node in nodes:
        count = len(branch_ends(skeleton, node))
        skew = max(skew, np.pi + count if count > MOST else float(junction_at(skeleton, node)[1].angles.max()))
    return skew


def _parted(skeleton: Skeleton, node: int, ends: list[End], group: tuple[int, ...], body: Solid) -> Skeleton:
    """Return the skeleton with a node divided: the branch ends of the group leave a new node, the last one."""
    center, radius, new = skeleton.nodes[node], float(skeleton.radii[node]), len(skeleton.nodes)
    ways = directions(skeleton, node, ends)
    chosen, axis = _axis(ways, group)
    room = np.minimum(body.rays(center, np.array([-axis, axis])), _ROOM * radius)
    places = center + _APART * np.array([-room[0], room[1]])[:, None] * axis
    branches = list(skeleton.branches)
    for (i, end), moved in zip(ends, chosen, strict=True):
        branches[i] = led_to(branches[i], end, new if moved else node, places[int(moved)], center)
    across = np.linspace(places[0], places[1], 5)
    radii = np.full(len(across), radius)
    nodes = np.concatenate([skeleton.nodes, places[1:]])
    nodes[node] = places[0]
    return replace(
        skeleton,
        nodes=nodes,
        radii=np.append(skeleton.radii, radius),
        branches=(*branches, Branch((node, new), across, radii)),
    )


def led_to(branch: Branch, end: int, node: int, place: Array, center: Array) -> Branch:
    """Return a branch that ends at another place, led there from beyond the ball around the old node."""
    points, radii = stub(branch, end), branch.radii[:: -1 if end else 1]
    inner = np.arange(len(points)) < max(1, len(points) // 2)
    near = inner & (np.linalg.norm(points - center, axis=1) < 1.5 * np.linalg.norm(place - center))
    kept = np.concatenate([place[None], points[~near]])
    along = arc_lengths(kept)
    even = np.linspace(0.0, along[-1], len(points))
    radii = np.interp(even, along, np.concatenate([radii[:1], radii[~near]]))
    rounded = _rounded(at_lengths(kept, even))
    kept = at_lengths(rounded, np.linspace(0.0, arc_lengths(rounded)[-1], len(points)))
    ends = (branch.ends[0], node) if end else (node, branch.ends[1])
    step = -1 if end else 1
    return Branch(ends, kept[::step], radii[::step])


def _rounded(points: Array) -> Array:
    """Return a curve (k, 3) with its kinks rounded off in its first half; its ends stay."""
    share = np.clip(2.0 - 4.0 * np.arange(1, len(points) - 1) / len(points), 0.0, 1.0)[:, None]
    for _ in range(_ROUNDINGS):
        middle = 0.25 * (points[:-2] + 2.0 * points[1:-1] + points[2:])
        points = np.concatenate([points[:1], points[1:-1] + share * (middle - points[1:-1]), points[-1:]])
    return points
