"""Defines Web: the graph of the skeleton while it is made, of nodes and arcs through the points of a lattice."""

from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array, Floats

Key = int


@dataclass(eq=False)
class Arc:
    """A path (k, 3) in cells from node `first` to node `last`, both included."""

    first: Key
    last: Key
    path: Array

    def from_node(self, node: Key) -> Array:
        """Return the path such that it begins at a node."""
        return self.path if self.first == node else self.path[::-1]

    def other(self, node: Key) -> Key:
        """Return the node at the other end."""
        return self.last if self.first == node else self.first


@dataclass(eq=False)
class Web:
    """A multigraph: nodes with their places (3,) in cells, and arcs. A loop is an arc whose ends are one node."""

    nodes: dict[Key, Array] = field(default_factory=dict)
    arcs: list[Arc] = field(default_factory=list)

    def arcs_at(self, node: Key) -> list[Arc]:
        """Return the arcs that end in a node; a loop stands once."""
        return [arc for arc in self.arcs if node in (arc.first, arc.last)]

    def degree(self, node: Key) -> int:
        """Return the number of ends of arcs at a node; a loop counts twice."""
        return sum((arc.first == node) + (arc.last == node) for arc in self.arcs)

    def add_node(self, place: Floats) -> Key:
        """Add a node and return its number."""
        key = max(self.nodes, default=-1) + 1
        self.nodes[key] = np.asarray(place, dtype=np.float64)
        return key

    def pieces(self) -> int:
        """Return the number of connected pieces."""
        label = {key: key for key in self.nodes}

        def root(key: Key) -> Key:
            while label[key] != key:
                key = label[key]
            return key

        for arc in self.arcs:
            label[root(arc.first)] = root(arc.last)
        return sum(key == root(key) for key in self.nodes)

    def betti(self) -> int:
        """Return the number of independent loops."""
        return len(self.arcs) - len(self.nodes) + self.pieces()

    def without_ends(self) -> None:
        """Take away arcs with an end until only loops, and what joins them, are left: nothing of a tree."""
        while True:
            ends = [key for key in self.nodes if self.degree(key) <= 1]
            if not ends:
                break
            for key in ends:
                self.arcs = [arc for arc in self.arcs if key not in (arc.first, arc.last)]
                del self.nodes[key]
        self.dissolve()

    def dissolve(self) -> None:
        """Join the two arcs at each node of degree 2; a circle keeps one node."""
        for key in list(self.nodes):
            at = self.arcs_at(key)
            if self.degree(key) == 2 and len(at) == 2:
                one, two = at
                path = np.concatenate([one.from_node(key)[::-1], two.from_node(key)[1:]])
                self.arcs = [arc for arc in self.arcs if arc is not one and arc is not two]
                self.arcs.append(Arc(one.other(key), two.other(key), path))
                del self.nodes[key]

    def points(self) -> Array:
        """Return all nodes and points of arcs (k, 3)."""
        return np.concatenate([np.array(list(self.nodes.values()))] + [arc.path for arc in self.arcs])

    def node_at(self, place: Array) -> Key:
        """Return the node at a point of the web; an arc that passes there is divided."""
        for key, own in self.nodes.items():
            if np.array_equal(own, place):
                return key
        for arc in self.arcs:
            here = np.flatnonzero((arc.path == place).all(axis=1))
            if len(here):
                key = self.add_node(place)
                self.arcs = [other for other in self.arcs if other is not arc]
                self.arcs += [Arc(arc.first, key, arc.path[: here[0] + 1]), Arc(key, arc.last, arc.path[here[0] :])]
                return key
        raise AssertionError("no such point")


def length_of(path: Array) -> float:
    """Return the length of a path (k, 3)."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
