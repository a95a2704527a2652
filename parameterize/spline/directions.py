"""Finds which spans of the directions of blocks are one: where blocks are glued, they have the same knots.

A span of a direction is the slab of a block between two neighbouring knots. An interface makes the slabs on both of its
sides continue each other, so that a knot inserted into the one must be inserted into the other. A slab that comes back
to its block through a loop of others, turned, is one with a slab of another direction there, or with its mirror image.
"""

from itertools import pairwise

import numpy as np

from ..arrays import IntArray
from .body import numbers_of_classes
from .control_nets import ControlNets
from .interface import varying


def tied_spans(nets: ControlNets) -> list[IntArray]:
    """Return for each direction of each block, in the order u, v, w of block after block, the classes of its spans.

    Spans that interfaces make one have the same class. Classes have the numbers from 0 on, in the order in which their
    first spans come; without interfaces each span has its own.
    """
    starts = np.cumsum([0, *(count for counts in nets.spans for count in counts)])
    rows = [np.arange(first, last) for first, last in pairwise(starts)]
    pairs = [np.empty((2, 0), dtype=np.int64)]
    for interface in nets.interfaces:
        (p, face), (q, other) = interface.first, interface.second
        axes = varying(other)[::-1] if interface.swapped else varying(other)
        for a, b, flip in zip(varying(face), axes, interface.flipped, strict=True):
            row = rows[3 * q + b]
            pairs.append(np.stack([rows[3 * p + a], row[::-1] if flip else row]))
    classes = numbers_of_classes(int(starts[-1]), np.concatenate(pairs, axis=1))
    return [classes[row] for row in rows]
