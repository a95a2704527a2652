"""Numbers the spans of blocks: neighbours, the control points that act on spans, the spans at the blocks' edges.

A span is given by its block and its place in the three directions, (k, 4). Masks hold all spans of all blocks, (m,).
"""

from functools import lru_cache
from itertools import product

import numpy as np

from ..arrays import IntArray, Mask
from ..spline.body import shared_numbers
from ..spline.spline_map import ControlNets


def in_blocks(spans: list[IntArray]) -> IntArray:
    """Return spans with their blocks, (k, 4), from the spans (k, 3) of each block in order."""
    return np.concatenate([np.insert(rows.reshape(-1, 3), 0, block, axis=1) for block, rows in enumerate(spans)])


def numbers(spans: IntArray, nets: ControlNets) -> IntArray:
    """Return the numbers (k,) of spans (k, 4) in a mask."""
    counts = np.array(nets.spans)[spans[:, 0]]
    inside = (spans[:, 1] * counts[:, 1] + spans[:, 2]) * counts[:, 2] + spans[:, 3]
    return np.asarray(nets.first_spans[spans[:, 0]] + inside)


def with_neighbours(spans: IntArray, nets: ControlNets) -> Mask:
    """Return the mask (m,) of the spans (k, 4) and of all spans that touch these, through interfaces too."""
    labels = _corner_labels(nets)
    touched = np.zeros(max(int(row.max()) for row in labels) + 1, dtype=bool)
    for block, row in enumerate(labels):
        own = spans[spans[:, 0] == block, 1:]
        for corner in product((0, 1), repeat=3):
            touched[row[tuple((own + corner).T)]] = True
    return np.concatenate([_any_corner(touched[row]).ravel() for row in labels])


@lru_cache(maxsize=4)
def _corner_labels(nets: ControlNets) -> tuple[IntArray, ...]:
    """Return the number of each corner of the spans of each block; corners that interfaces make one have one number."""
    return shared_numbers([(u + 1, v + 1, w + 1) for u, v, w in nets.spans], nets.interfaces)[0]


def _any_corner(corners: Mask) -> Mask:
    """Return which cells of a grid have a marked corner."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(corners, (2, 2, 2)).any(axis=(3, 4, 5)))


def acting_on(spans: Mask, nets: ControlNets) -> Mask:
    """Return the mask (n,) of the control points that act on marked spans (m,), on both sides of interfaces."""
    marked = []
    for block, counts in enumerate(nets.spans):
        own = spans[nets.first_spans[block] : nets.first_spans[block + 1]].reshape(counts)
        around = np.pad(own, nets.degree)
        windows = np.lib.stride_tricks.sliding_window_view(around, (nets.degree + 1,) * 3)
        marked.append(windows.any(axis=(3, 4, 5)).ravel())
    return nets.merged_mask(np.concatenate(marked))


def edge_spans(nets: ControlNets) -> IntArray:
    """Return the spans (k, 4) that touch one of the 12 edges of their block."""
    found = []
    for counts in nets.spans:
        index = np.indices(counts).reshape(3, -1).T
        at_side = (index == 0) | (index == np.array(counts) - 1)
        found.append(index[at_side.sum(axis=1) >= 2])
    return in_blocks(found)
