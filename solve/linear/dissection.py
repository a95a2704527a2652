"""Orders the nodes of a sparse matrix by nested dissection, so that its factor has few entries.

Regions of nodes are halved again and again; the separator between the halves comes after both (George, SIAM J. Numer.
Anal. 10, 1973). A cut lies across a coordinate, where the separator is small: a node with neighbours up to some rank is
in the separator of every cut between, so that a cumulative sum counts the separators of all cuts of all regions.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array, IntArray, Mask

LARGEST = 32  # nodes of a region that is not halved
SHARE = 0.2  # least share of a region's nodes on either side of a cut
ROOT = -1  # parent of the last region of each part of a body


@dataclass(frozen=True, eq=False)
class Dissection:
    """Hold an order of nodes, (n,), in which region k ends before place ends[k].

    parents: for each region the next one that it touches by the factor, ROOT where there is none. later: for each
    region the places of the later nodes that it touches so, in ascending order.
    """

    order: IntArray
    ends: IntArray
    parents: IntArray
    later: list[IntArray]

    @classmethod
    def of(cls, graph: csr_array, points: Array) -> "Dissection":
        """Return the dissection of nodes at points (n, d), neighbours where the graph (n, n) has an entry."""
        label = _labels(graph, points)
        labels = np.unique(label)
        depth = np.frexp(labels + 1.0)[1]
        last = (labels + 2) << (depth.max() - depth)  # of the labels inside a region, on the lowest level
        labels = labels[np.lexsort((-depth, last))]
        rank = np.full(labels.max() + 1, ROOT)
        rank[labels] = np.arange(len(labels))
        order = np.argsort(rank[label], kind="stable")
        return cls(order, *_touched(graph[order][:, order].tocsr(), np.cumsum(np.bincount(rank[label]))))


def _touched(graph: csr_array, ends: IntArray) -> tuple[IntArray, IntArray, list[IntArray]]:
    """Return `ends`, `parents` and `later` of a Dissection from the graph in its order."""
    found = [[graph.indices[first:last]] for first, last in pairwise(graph.indptr[[0, *ends]])]
    parents, later = np.full(len(ends), ROOT), []
    for k, end in enumerate(ends):
        nodes = np.unique(np.concatenate(found[k])).astype(np.int64)
        later.append(nodes[np.searchsorted(nodes, end) :])
        if len(later[k]):
            parents[k] = np.searchsorted(ends, later[k][0], side="right")
            found[parents[k]].append(later[k])
    return ends, parents, later


def _labels(graph: csr_array, points: Array) -> IntArray:
    """Return the regions (n,) of nodes: the halves of region k are 2 k + 1 and 2 k + 2, the separator stays in k."""
    rows, columns = graph.nonzero()
    label, is_open = np.zeros(len(points), dtype=np.int64), np.ones(len(points), dtype=bool)
    while True:
        _, region, sizes = np.unique(label[is_open], return_inverse=True, return_counts=True)
        is_open[is_open] = sizes[region] > LARGEST
        nodes = np.flatnonzero(is_open)
        if not len(nodes):
            return label
        inside = is_open[rows] & is_open[columns] & (label[rows] == label[columns])
        rows, columns, place = rows[inside], columns[inside], np.cumsum(is_open) - 1
        _, region = np.unique(label[nodes], return_inverse=True)
        is_right, is_between = _halved(points[nodes], region, place[rows], place[columns])
        label[nodes] += np.where(is_between, 0, label[nodes] + 1 + is_right)
        is_open[nodes] = ~is_between


def _halved(points: Array, region: IntArray, rows: IntArray, columns: IntArray) -> tuple[Mask, Mask]:
    """Return the masks (n,) of the nodes after their region's best cut, and of those between its halves.

    region: (n,), from 0 on. rows, columns: the pairs of neighbours.
    """
    sizes = np.bincount(region)
    starts, owner = np.cumsum(sizes) - sizes, np.repeat(np.arange(len(sizes)), sizes)
    before = np.arange(len(region)) - starts[owner]  # nodes of the region before each cut
    smaller = np.minimum(before, sizes[owner] - before)
    scale = np.where(smaller >= SHARE * sizes[owner], np.sqrt(smaller), 0.0)
    best, (is_right, is_between) = np.full(len(sizes), np.inf), np.zeros((2, len(region)), dtype=bool)
    for coordinate in points.T:
        rank = np.empty_like(region)
        rank[np.lexsort((coordinate, region))] = np.arange(len(region))
        for farthest in (np.maximum, np.minimum):  # the separator lies before the cut, or after it
            reach = rank.copy()
            farthest.at(reach, rows, rank[columns])
            low, high = np.minimum(rank, reach), np.maximum(rank, reach)
            cost = np.where(scale > 0.0, _between(low, high) / np.maximum(scale, 1.0), np.inf)
            least = np.minimum.reduceat(cost, starts)
            found = np.flatnonzero(cost == least[owner])
            cut = found[np.searchsorted(owner[found], np.arange(len(sizes)))][region]
            better = (least < best)[region]
            is_right[better] = (rank >= cut)[better]
            is_between[better] = ((low < cut) & (cut <= high))[better]
            best = np.minimum(best, least)
    return is_right, is_between


def _between(low: IntArray, high: IntArray) -> IntArray:
    """Return for each cut k the number of nodes with low < k <= high."""
    length = len(low) + 1
    return np.cumsum(np.bincount(low + 1, minlength=length) - np.bincount(high + 1, minlength=length))[:-1]
