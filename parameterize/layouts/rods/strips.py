"""Divides blocks into strips, which go on in the limbs of a row, and all blocks through which these strips pass."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...spline.interface import Interface, axis_side, varying
from .block import Block


@dataclass(frozen=True, eq=False)
class BlockCuts:
    """Where a block is cut across one of its directions.

    Attributes
    ----------
    axis : int
        The direction: 0, 1, 2 for u, v, w.
    shares : (n, 2) array
        Of the first and of the last corner along it at each cut, in ascending order of the last. They are swapped,
        and not computed anew, from the other end, so that the corners of glued faces agree bit by bit.
    """

    axis: int
    shares: Array

    def along(self, axis: int, flipped: bool) -> "BlockCuts":
        """Return the same cuts across a direction of a neighbour."""
        return BlockCuts(axis, self.shares[::-1, ::-1] if flipped else self.shares)

    def parts(self, corners: Array, axis: int) -> list[Array]:
        """Return the parts of corners (..., 2, ...) that are in order along an axis of the array, of the same shape."""
        first, last = np.moveaxis(corners, axis, 0)
        lines = [first, *(one * first + other * last for one, other in self.shares), last]
        return [np.stack(pair, axis=axis) for pair in zip(lines, lines[1:], strict=False)]


class Crossing(ValueError):
    """Says that strips of two rows of limbs pass through the same block."""


def divided(
    blocks: Sequence[Block], interfaces: Sequence[Interface], begun: Iterable[tuple[int, BlockCuts]]
) -> tuple[list[Block], list[int]]:
    """Return blocks cut into strips, and the number of the block to which each belonged.

    begun: the numbers of blocks and their cuts, which go on through glued faces.

    Raises
    ------
    Crossing
        Where a block would be cut twice.
    """
    cuts: dict[int, BlockCuts] = {}
    for start in begun:
        waiting = [start]
        while waiting:
            number, own = waiting.pop()
            if number not in cuts:
                cuts[number] = own
                waiting += _beyond(number, own, interfaces)
            elif cuts[number].axis != own.axis or not np.array_equal(cuts[number].shares, own.shares):
                raise Crossing
    parts = [(_strips(block, cuts[number]) if number in cuts else [block]) for number, block in enumerate(blocks)]
    return [strip for own in parts for strip in own], [number for number, own in enumerate(parts) for _ in own]


def _beyond(number: int, cuts: BlockCuts, interfaces: Sequence[Interface]) -> Iterator[tuple[int, BlockCuts]]:
    """Yield the neighbours of a block through whose common face its cuts go on, and their cuts."""
    for interface in interfaces:
        for own, other in ((interface.first, interface.second), (interface.second, interface.first)):
            if own[0] == number and axis_side(own[1])[0] != cuts.axis:
                place = varying(own[1]).index(cuts.axis)
                there = 1 - place if interface.swapped else place
                of_first = place if own is interface.first else there
                yield other[0], cuts.along(varying(other[1])[there], interface.flipped[of_first])


def _strips(block: Block, cuts: BlockCuts) -> list[Block]:
    """Return the strips of a block. Along w only a block of two sections is cut."""
    axis = 0 if cuts.axis == 2 else cuts.axis + 1  # of the array (m, 2, 2, 3)
    return [
        replace(block, name=f"{block.name}, strip {k}", sections=np.ascontiguousarray(sections))
        for k, sections in enumerate(cuts.parts(block.sections, axis))
    ]
