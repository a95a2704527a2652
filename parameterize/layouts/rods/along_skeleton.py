"""Defines BlockLayout: blocks glued by whole faces, a thin start inside a body with handles or limbs."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, IntArray, Mask, in_brackets
from ...certificate.boundary import check_boundary
from ...spline.body import Body as SplineBody
from ...spline.interface import Face, Interface, face_label, orientations, varying
from ...spline.volume import FACE_NAMES
from ...surface.solid import Solid
from ..skeleton.graph import Skeleton
from .block import Block
from .block_builder import BlockBuilder
from .centering import centered
from .merging import merge
from .rings import PARTS
from .rods import Rod
from .rows import LimbRow, with_rows
from .splitting import split
from .strips import Crossing, divided

_log = logging.getLogger(__name__)

__all__ = ["Block", "BlockLayout", "LayoutError", "block_layout"]

SPANS = 6  # across each block
_LONGEST = 4  # times the spans across: those along a rod at most
_STRETCH = 2.0  # how long a span along a rod is, over one across the body: little changes along a rod
_REPAIRS = 60  # rounds in which what is folded, leaves the body or meets another part is made thinner


class LayoutError(ValueError):
    """Says in one line why no start of blocks fits into a body, and what can be done."""


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


def block_layout(
    skeleton: Skeleton,
    vertices: Array,
    faces: IntArray,
    spans: int = SPANS,
    where: Callable[[Array], str] = in_brackets,
) -> BlockLayout:
    """Return a thin start inside a body: rods along the branches of its skeleton, a block at each junction.

    Limbs have closed ends in their tips. The faces that are not glued form one closed surface of the body's genus.

    Parameters
    ----------
    skeleton : Skeleton
        Of the body, in the units of the surface.
    vertices : (n, 3) array
        Of the surface.
    faces : (m, 3) array of int
        Its triangles, wound outward.
    spans : int
        Of the knot vectors across each block; along a rod there are more where it is long.
    where : function
        Turns a place (3,) into words for messages, such as its coordinates in the user's units.

    Raises
    ------
    LayoutError
        For a skeleton without branches, and where blocks stay folded, outside or in each other, however thin.
    """
    if not skeleton.branches:
        raise LayoutError("the skeleton is a single point, without limbs or handles: one cube serves such a body")
    body = Solid(vertices, faces)
    merged = merge(centered(skeleton, body), body)
    in_rows, rows = with_rows(merged, body)
    for row in rows.values():
        _log.info("%d limbs side by side: a row, and a strip of the flat part for each", len(row.limbs))
    if rows:
        try:
            return _laid(in_rows, rows, body, spans, where)
        except LayoutError as error:
            _log.info("without rows of limbs: %s", error)
    return _laid(merged, {}, body, spans, where)


def _laid(
    skeleton: Skeleton, rows: Mapping[int, LimbRow], body: Solid, spans: int, where: Callable[[Array], str]
) -> BlockLayout:
    """Return the start of blocks along a skeleton with some rows of limbs."""
    draft = BlockBuilder(split(skeleton, body, rows), body, rows)
    for _ in range(_REPAIRS):
        faults = draft.repaired()
        if faults:
            continue
        layout, drafted = _layout(draft, spans)
        met = check_boundary(SplineBody(tuple(block.spline for block in layout.blocks), layout.interfaces)).meeting
        if met is None:
            return layout
        draft.thin_near(np.array(met.point), tuple(drafted[number] for number in met.patches or ()))
        faults = [("two rods meet", np.array(met.point))]
    what, place = faults[0]
    raise LayoutError(
        f"no start of blocks fits into the body: {what} near {where(place)}; make the surface wider there"
    )


def _layout(draft: BlockBuilder, spans: int) -> tuple[BlockLayout, list[int]]:
    """Return the layout of a draft, and the number that each block had before flat parts were cut into strips."""
    whole = BlockLayout.from_blocks(list(_blocks(draft, spans)))
    numbers = {block.name: number for number, block in enumerate(whole.blocks)}
    begun = [(numbers[f"rod {number}"], cuts) for number, cuts in draft.strips()]
    if not begun:
        return whole, list(range(len(whole)))
    try:
        blocks, drafted = divided(whole.blocks, whole.interfaces, begun)
    except Crossing:
        raise LayoutError("no start of blocks fits into the body: two rows of limbs share a flat part") from None
    return BlockLayout.from_blocks(blocks), drafted


def _blocks(draft: BlockBuilder, spans: int) -> Iterator[Block]:
    """Yield the junctions, then the rods of a draft."""
    for node in draft.junctions:
        yield Block(f"junction {node}", np.moveaxis(draft.corners(node), 2, 0), (spans, spans, spans))
    for number, rod in draft.rods.items():
        sections = draft.sections(number)
        parts = PARTS if number in draft.quarters else 1
        step = (len(sections) - 1) // parts
        for k in range(parts):
            name = f"rod {number}" if parts == 1 else f"rod {number}, part {k}"
            yield Block(name, sections[k * step : (k + 1) * step + 1], (spans, spans, _spans_along(rod, parts, spans)))


def _spans_along(rod: Rod, parts: int, spans: int) -> int:
    """Return the spans along a part of a rod: by its length over the body's width."""
    count = round(spans * rod.length / (parts * _STRETCH * rod.body_width))
    return int(np.clip(count, spans, _LONGEST * spans))


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
