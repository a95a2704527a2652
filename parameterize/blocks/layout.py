"""Defines Block and BlockLayout: rods and junctions of straight pieces, glued by whole faces, as a start inside a body.

The faces of a block have the names and the order of a patch's: u0, u1, v0, v1, w0, w1. A face is an array of corners
(2, 2, 3) across a block and (2, m, 3) along it, in the order u, v, w of its two directions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, Mask
from ..spline.interface import Face, Interface, face_label, face_layer, orientations, varying
from ..spline.volume import FACE_NAMES


@dataclass(frozen=True, eq=False)
class Block:
    """A rod of quadrilateral sections: bilinear across it, linear from each section to the next.

    Attributes
    ----------
    name : str
        What it is of the body, for messages and reports.
    sections : (m, 2, 2, 3) array
        The corners [u][v] of m >= 2 sections, evenly spaced in w from 0 to 1, at volume 1. (u, v, w) is right-handed.
    spans : three int
        The number of knot spans along u, v and w.
    """

    name: str
    sections: Array
    spans: tuple[int, int, int]

    def __post_init__(self) -> None:
        if len(self.sections) < 2 or self.sections.shape[1:] != (2, 2, 3):
            raise ValueError(f"block {self.name}: sections must be (m >= 2, 2, 2, 3), got {self.sections.shape}")
        if min(self.spans) < 1:
            raise ValueError(f"block {self.name}: each direction needs one span or more, got {self.spans}")

    def face(self, name: str) -> Array:
        """Return the corners of a face: (2, 2, 3) of w0 and w1, (2, m, 3) of the others."""
        return face_layer(np.moveaxis(self.sections, 0, 2), name)

    def points(self, places: Array) -> Array:
        """Return the points (..., 3) at parameters (..., 3) in the unit cube."""
        u, v, w = np.moveaxis(places, -1, 0)[..., None]
        last = len(self.sections) - 2
        below = np.clip((w[..., 0] * (last + 1)).astype(np.int64), 0, last)
        along = w * (last + 1) - below[..., None]
        corners = self.sections[below], self.sections[below + 1]
        low, high = (
            (1 - u) * ((1 - v) * c[..., 0, 0, :] + v * c[..., 0, 1, :])
            + u * ((1 - v) * c[..., 1, 0, :] + v * c[..., 1, 1, :])
            for c in corners
        )
        return np.asarray((1 - along) * low + along * high)


@dataclass(frozen=True, eq=False)
class BlockLayout:
    """Blocks that are glued by whole faces.

    Attributes
    ----------
    blocks : tuple of Block
    interfaces : tuple of Interface
        Pairs of faces with the same corners, bit by bit, and the same spans; a face is glued once at most.

    Raises
    ------
    ValueError
        Where the corners or the spans of two glued faces differ, or a face is glued twice; the message names them.
    """

    blocks: tuple[Block, ...]
    interfaces: tuple[Interface, ...]

    def __post_init__(self) -> None:
        glued = [face for interface in self.interfaces for face in (interface.first, interface.second)]
        for face in glued:
            if glued.count(face) > 1:
                raise ValueError(f"{face_label(*face)} is glued twice")
        for interface in self.interfaces:
            (p, first), (q, second) = interface.first, interface.second
            if not _is_same(self.blocks[p].face(first), interface.turned(self.blocks[q].face(second))):
                raise ValueError(f"interface {interface}: the corners of the two faces differ")
            spans = [self.blocks[q].spans[axis] for axis in varying(second)]
            if [self.blocks[p].spans[axis] for axis in varying(first)] != spans[:: -1 if interface.swapped else 1]:
                raise ValueError(f"interface {interface}: the spans along the two faces differ")

    @classmethod
    def from_blocks(cls, blocks: Sequence[Block]) -> "BlockLayout":
        """Return the blocks, glued wherever two faces have the same corners."""
        return cls(tuple(blocks), tuple(_interfaces(blocks)))

    @cached_property
    def exposed(self) -> Mask:
        """Return whether each face is not glued: (number of blocks, 6), in the order u0, u1, v0, v1, w0, w1."""
        free: Mask = np.ones((len(self.blocks), len(FACE_NAMES)), dtype=bool)
        for interface in self.interfaces:
            for number, face in (interface.first, interface.second):
                free[number, FACE_NAMES.index(face)] = False
        return free

    @property
    def corners(self) -> Array:
        """Return the corners of all sections of all blocks, (k, 3)."""
        return np.concatenate([block.sections.reshape(-1, 3) for block in self.blocks])

    def __len__(self) -> int:
        return len(self.blocks)


def _interfaces(blocks: Sequence[Block]) -> Iterator[Interface]:
    """Yield the pairs of faces that have the same corners, each turned so that they lie on each other."""
    waiting: dict[bytes, Face] = {}
    for number, block in enumerate(blocks):
        for name in FACE_NAMES:
            corners = block.face(name)
            points = corners.reshape(-1, 3)
            key = points[np.lexsort(points.T)].tobytes()
            face = (number, name)
            if key not in waiting:
                waiting[key] = face
                continue
            first = waiting.pop(key)
            nets = blocks[first[0]].face(first[1]), corners
            yield next(way for way in orientations(first, face) if _is_same(nets[0], way.turned(nets[1])))


def _is_same(first: Array, second: Array) -> bool:
    return first.shape == second.shape and bool(np.array_equal(first, second))
