"""Defines Skeleton: the graph of centre curves of a solid, with the distance of each point from the surface."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...arrays import Array


class SkeletonError(ValueError):
    """Says in one line why a solid has no curve skeleton, and what can be done."""


@dataclass(frozen=True, eq=False)
class Branch:
    """A curve of the skeleton between two nodes: the middle of a limb, or of a part of a handle.

    Attributes
    ----------
    ends : (int, int)
        The numbers of its first and last node. They are equal for a loop at one node.
    points : (k, 3) array
        The curve from the first node to the last, both included, evenly spaced, in the units of the surface.
    radii : (k,) array
        The distance of these points from the surface.
    """

    ends: tuple[int, int]
    points: Array
    radii: Array

    @property
    def length(self) -> float:
        """Return the length of the curve."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A connected graph of curves inside a solid, with as many independent loops as the solid has handles.

    A node with one branch is the tip of a limb, one with three or more is a junction, and a circle has one node, whose
    two branch ends belong to the same branch. A body without limbs and without handles is a single node.

    Attributes
    ----------
    nodes : (n, 3) array
        In the units of the surface.
    radii : (n,) array
        The distance of the nodes from the surface.
    branches : tuple of Branch
        Empty for a single node.
    tube : float
        The share of the solid's volume that lies in balls around the curves, which touch the surface: near 1 for a
        body of tubes, small for a sheet or a shell.
    cell : float
        The edge of the cells of the lattice from which the skeleton was made.
    """

    nodes: Array
    radii: Array
    branches: tuple[Branch, ...]
    tube: float
    cell: float

    @property
    def handles(self) -> int:
        """Return the first Betti number of the graph, which is connected."""
        return len(self.branches) - len(self.nodes) + 1

    @cached_property
    def degrees(self) -> tuple[int, ...]:
        """Return the number of branch ends at each node: a loop at one node counts twice."""
        ends = np.array([branch.ends for branch in self.branches], dtype=np.int64).ravel()
        return tuple(np.bincount(ends, minlength=len(self.nodes)).tolist())


def without_lone_nodes(skeleton: Skeleton) -> Skeleton:
    """Return a skeleton without the nodes at which no branch ends."""
    kept = np.flatnonzero(skeleton.degrees)
    number = {int(old): k for k, old in enumerate(kept)}
    branches = (replace(one, ends=(number[one.ends[0]], number[one.ends[1]])) for one in skeleton.branches)
    return replace(skeleton, nodes=skeleton.nodes[kept], radii=skeleton.radii[kept], branches=tuple(branches))
